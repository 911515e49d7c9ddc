"""A node finds a job by its name, with what is passed beside the item; no cluster is needed here.

What a cluster makes of jobs is in tests/stages/test_cluster.
"""

import pickle
from collections.abc import Callable
from functools import partial

import pytest

from pipeline.errors import MachineError
from pipeline.execution.ray_executor import job_by_name


def joined(first: str, item: str, last: str = "") -> str:
    return first + item + last


@pytest.mark.parametrize(
    ("job", "made"),
    [
        (partial(joined, "a"), "ab"),
        (partial(joined, "a", last="c"), "abc"),
        (partial(partial(joined, "a"), last="c"), "abc"),
    ],
)
def test_a_job_travels_with_its_arguments(job: Callable[[str], str], made: str) -> None:
    sent = pickle.loads(pickle.dumps(job_by_name(job)))  # noqa: S301 - our own bytes
    assert sent("b") == made == job("b")


def test_a_function_that_no_name_leads_to_is_refused() -> None:
    def inner(item: str) -> str:
        return item

    for job in (inner, lambda item: item, partial(inner), "a".join):
        with pytest.raises(MachineError, match=r"cannot run on a cluster.*top level"):
            job_by_name(job)
