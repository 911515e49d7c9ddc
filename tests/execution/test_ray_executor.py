"""A node finds a job by its name, with what is passed beside the item; no cluster is needed here.

What a cluster makes of jobs is in tests/stages/test_cluster.
"""

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from pipeline.errors import MachineError, SoftgripError
from pipeline.execution.ray_executor import NODE_BACK_WITHIN_S, Sending, job_by_name, result_of

ROOT = Path(__file__).resolve().parents[2]


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


PROGRAM = """
from dataclasses import dataclass
from pipeline.execution.ray_executor import job_by_name, program_name
from pipeline.execution.packed_items import ItemPacker, unpack_item

@dataclass(frozen=True)
class Item:
    number: int

def job(item):
    assert type(item).__module__ == __name__, type(item).__module__
    return Item(item.number + 1)

if __name__ == "__main__":
    sent = ItemPacker().pack((job_by_name(job), Item(1)))
    import program  # a second time, as a node does: its classes are others
    named, item = unpack_item(sent, {"__main__": program_name()})
    assert isinstance(item, program.Item) and not isinstance(item, Item)
    result = unpack_item(ItemPacker().pack(named(item)), {program_name(): "__main__"})
    assert result == Item(2), result
    print("done")
"""


def test_classes_of_a_program_are_those_of_its_module_on_a_node(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(PROGRAM)
    done = subprocess.run(
        [sys.executable, "-m", "program"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == "done\n", done.stderr


def test_a_function_that_no_name_leads_to_is_refused() -> None:
    def inner(item: str) -> str:
        return item

    for job in (inner, lambda item: item, partial(inner), "a".join):
        with pytest.raises(MachineError, match=r"cannot run on a cluster.*top level"):
            job_by_name(job)


WORKS = {"Alive": True, "Resources": {"CPU": 8.0}}
HEAD = {"Alive": True, "Resources": {}}  # takes no work
GONE = WORKS | {"Alive": False}


@pytest.mark.parametrize(
    ("looks", "said", "waits"),
    [
        ([[HEAD, GONE]] * 9, r"No node .* is left to work.*goes on where it stopped", 2),
        ([[HEAD, WORKS]] * 9, r"A work item took longer than 600 s: its worker hangs", 5),
        ([[GONE], [WORKS], [GONE], [WORKS], [WORKS]], "took longer than 600 s", 5),
    ],
)
def test_where_no_node_comes_back_it_is_said_long_before_an_item_may_hang(
    monkeypatch: pytest.MonkeyPatch, looks: list[list[dict[str, object]]], said: str, waits: int
) -> None:
    ray = pytest.importorskip("ray", reason="Ray is not installed")
    waited: list[float] = []

    def get(_: object, timeout: float) -> bytes:
        waited.append(timeout)
        raise ray.exceptions.GetTimeoutError

    monkeypatch.setattr(ray, "get", get)
    monkeypatch.setattr(ray, "nodes", lambda: looks[len(waited) - 1])
    with pytest.raises(SoftgripError, match=said):
        result_of(None, Sending(), limit_s=5 * NODE_BACK_WITHIN_S)
    assert waited == [NODE_BACK_WITHIN_S] * waits
