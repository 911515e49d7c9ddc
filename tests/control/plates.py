"""Attempts on a level plate whose quality grows towards a corner."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.config import EvaluateConfig
from pipeline.control.candidates import Candidates
from pipeline.control.cloud import DepthPicture
from pipeline.control.decision import Decision, Strategy
from pipeline.control.policy import Attempt
from tests.control.fakes import FakeEyes, FakeRobot

CONFIG = EvaluateConfig()
RADIUS_M = 0.01
TOP_M = 0.05


def plate(height_m: float = TOP_M) -> np.ndarray:
    """A level plate, 100 mm a side."""
    x, y = np.meshgrid(np.linspace(-0.05, 0.05, 161), np.linspace(-0.05, 0.05, 161))
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, height_m)])


def near_corner(_: Sequence[DepthPicture], candidates: Candidates) -> np.ndarray:
    """Quality grows towards the plate's corner."""
    place = candidates.world_from_contact[:, :2, 3]
    return np.asarray(0.5 + 5 * place.sum(axis=1))


CLOSED = Strategy("closed-loop", near_corner, True, True, seals_again=True, feels=True)
OPEN = replace(CLOSED, several_views=False, corrects=False, seals_again=False, feels=False)


def with_policy(**changes: float) -> EvaluateConfig:
    return CONFIG.model_copy(update={"policy": CONFIG.policy.model_copy(update=changes)})


def tried(
    points: np.ndarray,
    robot: FakeRobot,
    strategy: Strategy = CLOSED,
    pictures: int = 10_000,
    avoid_m: Sequence[np.ndarray] = (),
    config: EvaluateConfig = CONFIG,
) -> tuple[Decision, FakeEyes]:
    eyes = FakeEyes(points, robot, pictures)
    rng = np.random.default_rng(0)
    attempt = Attempt(eyes, robot, strategy, config, RADIUS_M, rng, avoid_m)
    return attempt.run(), eyes
