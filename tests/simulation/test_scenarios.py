"""Supplement VIII as scenes: what is said of them holds, and each attempt ends with a cause."""

import numpy as np
import pytest

from pipeline.config import RunConfig
from pipeline.control.decision import Cause
from pipeline.control.strategies import build_strategy
from pipeline.simulation.picking import Clutter
from pipeline.simulation.scenarios import SCENARIOS, make_trials, with_segmentation

BY_NAME = {scenario.name: scenario for scenario in SCENARIOS}
PERFECT = RunConfig.model_validate({"evaluate": {"imperfection": {"scale": 0.0}}})


def flatness(cloud: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Stands for a network: how level the middle of the sub cloud is, and whether it is seen."""
    middle = slice(5, -5)
    heights = np.where(seen, cloud[..., 2], np.nan)[:, middle, middle].reshape(len(cloud), -1)
    known = np.isfinite(heights).mean(axis=1)
    spread = np.nanstd(np.where(known[:, None] > 0, heights, 0.0), axis=1)
    return np.asarray(known * np.exp(-5 * spread))


def tried(name: str, config: RunConfig = PERFECT, seed: int = 0) -> tuple[Cause, Clutter]:
    rng = np.random.default_rng(seed)
    scenario = BY_NAME[name]
    scene, objects = next(make_trials(scenario, 1, 300.0, rng))
    config = with_segmentation(config, scenario)
    clutter = Clutter(scene, objects, config, rng)
    clutter.gripper.conveyor_m_s = scenario.speed_m_s
    return clutter.make_attempt(build_strategy("closed-loop", flatness, config), []).cause, clutter


@pytest.mark.parametrize("config", [PERFECT, RunConfig()], ids=["perfect", "imperfect"])
def test_a_plain_box_is_lifted(config: RunConfig) -> None:
    cause, clutter = tried("plain", config)
    assert cause is Cause.LIFTED
    assert clutter.bodies == {}


def test_a_slow_box_is_caught_in_motion() -> None:
    assert tried("moving, 10 mm/s")[0] is Cause.LIFTED


@pytest.mark.parametrize("seed", range(3))
def test_a_transparent_box_is_found_by_its_outline_alone(seed: int) -> None:
    assert tried("transparent", seed=seed)[0] is not Cause.LIFTED
    assert tried("transparent, segmented", seed=seed)[0] is Cause.LIFTED


@pytest.mark.parametrize("name", ["flush neighbours", "slim, side by side"])
def test_neighbours_stand_at_their_gap_and_level(name: str) -> None:
    scenario = BY_NAME[name]
    scene, _ = next(make_trials(scenario, 1, 300.0, np.random.default_rng(1)))
    first, second = (placed.world_from_object[:3, 3] for placed in scene.objects)
    gap = np.linalg.norm(first - second) - scenario.sides_m[1]
    assert gap == pytest.approx(scenario.gap_m)
    assert first[2] == second[2]


def test_a_box_that_falls_off_is_taken_out_and_named() -> None:
    """Carried over the table's edge while the pad goes for it: the attempt ends, not the run."""
    rng = np.random.default_rng(0)
    scene, objects = next(make_trials(BY_NAME["plain"], 1, 300.0, rng))
    clutter = Clutter(scene, objects, PERFECT, rng)
    clutter.gripper.conveyor_m_s = 0.8
    cause = clutter.make_attempt(build_strategy("closed-loop", flatness, PERFECT), []).cause
    assert cause is not Cause.LIFTED
    assert clutter.bodies == {}
