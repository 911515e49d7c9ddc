"""What attempts come to: counted by hand on a few of them."""

import numpy as np
import pytest

from pipeline.artifacts.tensors import to_tensor
from pipeline.messages.evaluation_results import CouldBeLifted, could_be_lifted, results_of
from pipeline.recording.results import results_markdown
from pipeline.world.scene import ClutterScene, PlacedObject
from schemas.softgrip.v1.evaluation_pb2 import Attempt

GONE = (np.nan, np.nan)
CAN, CANNOT = (2.0, 1.0), (0.5, 1.0)
# Of three objects the second can be lifted only once the first is gone, the third never.
ATTEMPTS = [
    ("lifted", 1, [CAN, CANNOT, CANNOT]),
    ("failed", 3, [GONE, CAN, CANNOT]),  # at what cannot be lifted
    ("failed", 0, [GONE, CAN, CANNOT]),  # met nothing, though one could be lifted
    ("lifted", 2, [GONE, CAN, CANNOT]),
    ("failed", 3, [GONE, GONE, CANNOT]),
]


def attempts(told: bool = True) -> list[Attempt]:
    return [
        Attempt(
            scene_id="one",
            policy="closed-loop",
            outcome=outcome,
            cause="" if outcome == "lifted" else "no seal",
            target=f"object {body}" if body else "",
            target_body=body,
            seals=1,
            duration_s=10.0,
            ceilings_n=to_tensor(np.array(ceilings)) if told else None,
        )
        for outcome, body, ceilings in ATTEMPTS
    ]


def scene() -> ClutterScene:
    placed = tuple(PlacedObject(f"object {i}", i, np.eye(4)) for i in (1, 2, 3))
    return ClutterScene("one", 1, "test", 0, placed, np.full(3, np.inf), (), 0.0, ())


def test_what_could_be_lifted_is_counted_by_object_and_by_attempt() -> None:
    assert could_be_lifted(attempts()) == CouldBeLifted(objects=2, attempts=3, unforeseen=0)


def test_what_was_lifted_could_be_lifted() -> None:
    made = attempts()
    made[-1].outcome = "lifted"
    assert could_be_lifted(made) == CouldBeLifted(objects=3, attempts=4, unforeseen=1)


def test_nothing_is_told_where_it_was_not_looked_for() -> None:
    assert could_be_lifted(attempts(told=False)) == CouldBeLifted()


@pytest.mark.parametrize("told", [True, False])
def test_summary_and_table_tell_of_what_can_be_lifted(told: bool) -> None:
    results = results_of([scene()], ["closed-loop"], attempts(told), (5.0,))
    figures = results.summary()["policies"]
    assert isinstance(figures, dict)
    mine = figures["closed-loop"]
    assert (mine["lifted"], mine["attempts"], mine["rate"]) == (2, 5, 0.4)
    text = results_markdown(results.levels, results.policies, results.comparisons)
    if told:
        assert mine["objects_that_can_be_lifted"] == 2
        assert mine["lifted_of_these"] == 1.0
        assert mine["success_at_these"] == pytest.approx(2 / 3)
        assert "2 / 2 (100 %), 67 % of attempts at these" in text
    else:
        assert "success_at_these" not in mine
        assert "not looked for" in text
