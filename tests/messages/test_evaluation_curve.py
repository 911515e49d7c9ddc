"""Success by the size of a robot's errors: the same clutters, counted at each scale."""

import numpy as np

from pipeline.messages.evaluation_curve import curve_figures, curve_of, curve_scenes
from pipeline.recording.results import curve_markdown
from pipeline.world.scene import ClutterScene, PlacedObject
from schemas.softgrip.v1.evaluation_pb2 import Attempt


def scene(name: str, level: int) -> ClutterScene:
    placed = (PlacedObject("cup", 1, np.eye(4)),)
    return ClutterScene(name, level, "test", 0, placed, np.full(1, np.inf), (), 0.0, ())


SCENES = [scene("a", 1), scene("b", 1), scene("c", 4), scene("d", 4)]


def made(policy: str, name: str, outcome: str) -> Attempt:
    return Attempt(policy=policy, scene_id=name, outcome=outcome, cause="no seal", duration_s=8.0)


def test_so_many_clutters_of_each_level_are_taken() -> None:
    assert [s.scene_id for s in curve_scenes(SCENES, 1)] == ["a", "c"]
    assert curve_scenes(SCENES, 5) == SCENES


def test_each_policy_is_counted_at_each_scale() -> None:
    attempts = {
        0.0: [made(p, n, "lifted") for p in ("closed-loop", "open-loop") for n in "ac"],
        2.0: [
            made("closed-loop", "a", "lifted"),
            made("closed-loop", "c", "failed"),
            made("open-loop", "a", "failed"),
            made("open-loop", "c", "failed"),
        ],
    }
    chosen = curve_scenes(SCENES, 1)
    curve = curve_of(chosen, ("closed-loop", "open-loop"), attempts, (1.0,))
    rates = {(p.policy, p.imperfection_scale): p.success_rate for p in curve}
    assert rates == {
        ("closed-loop", 0.0): 1.0,
        ("open-loop", 0.0): 1.0,
        ("closed-loop", 2.0): 0.5,
        ("open-loop", 2.0): 0.0,
    }
    figures = curve_figures(curve)
    assert figures["closed-loop"]["2"]["rate"] == 0.5
    assert figures["open-loop"]["2"]["failures"] == {"no seal": 2}
    text = curve_markdown(curve)
    assert "| policy | 0 times | 2 times |" in text
    assert "| closed-loop | 100 % (" in text


def test_nothing_is_said_of_a_curve_that_was_not_asked_for() -> None:
    assert curve_of(SCENES, ("closed-loop",), {}, ()) == []
    assert curve_markdown([]) == ""
