"""The policy against fakes: every way to end has its cause, and it aims where quality is."""

import numpy as np
import pytest

from pipeline.config import EvaluateConfig
from pipeline.control.candidates import candidates_at
from pipeline.control.policy import Cause, Observation, State, attempt

CONFIG = EvaluateConfig()
RADIUS_M = 0.01
EYE = np.array([0.0, 0.0, 0.9])


def plate(height_m: float = 0.05) -> np.ndarray:
    """A level plate, 100 mm a side."""
    x, y = np.meshgrid(np.linspace(-0.05, 0.05, 41), np.linspace(-0.05, 0.05, 41))
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, height_m)])


class FakeSensor:
    def __init__(self, points: np.ndarray) -> None:
        self.points = points
        self.looks = 0

    def look(self) -> Observation:
        self.looks += 1
        return Observation(self.points, EYE, np.zeros((2, 2)))


class FakeRobot:
    """Does all it is told, but for one thing."""

    def __init__(self, fails_at: State | None = None) -> None:
        self.fails_at = fails_at
        self.state = State.OBSERVE
        self.states: list[State] = []
        self.poses: list[np.ndarray] = []

    def enter(self, state: State) -> None:
        self.state = state
        self.states.append(state)

    def _done(self) -> bool:
        return self.state is not self.fails_at

    def move(self, world_from_gripper: np.ndarray) -> bool:
        self.poses.append(world_from_gripper)
        return self._done()

    def seal(self) -> bool:
        return self._done()

    def lift(self) -> bool:
        return self._done()

    def shake(self) -> bool:
        return self._done()


def near_corner(_: Observation, world_from_contact: np.ndarray) -> np.ndarray:
    """Quality grows towards the plate's corner."""
    return np.asarray(world_from_contact[:, 0, 3] + world_from_contact[:, 1, 3])


def tried(points: np.ndarray, fails_at: State | None = None) -> tuple[Cause, FakeRobot, FakeSensor]:
    robot, sensor = FakeRobot(fails_at), FakeSensor(points)
    rng = np.random.default_rng(0)
    decision = attempt(sensor, robot, near_corner, CONFIG, RADIUS_M, rng)
    return decision.cause, robot, sensor


@pytest.mark.parametrize(
    ("fails_at", "cause"),
    [
        (None, Cause.LIFTED),
        (State.PREGRASP, Cause.COLLISION),
        (State.APPROACH, Cause.COLLISION),
        (State.SEAL, Cause.NO_SEAL),
        (State.LIFT, Cause.LOST_IN_LIFT),
        (State.SHAKE, Cause.LOST_IN_SHAKE),
    ],
)
def test_each_failure_has_its_cause(fails_at: State | None, cause: Cause) -> None:
    assert tried(plate(), fails_at)[0] is cause


@pytest.mark.parametrize(
    ("points", "cause"),
    [
        (np.empty((0, 3)), Cause.EMPTY_CLOUD),
        (plate(0.001), Cause.EMPTY_CLOUD),
        (np.full((50, 3), np.nan), Cause.EMPTY_CLOUD),
        (plate()[:, [2, 1, 0]] + np.array([0.0, 0.0, 0.1]), Cause.NO_CANDIDATE),
    ],
    ids=["nothing", "bare table", "NaN depth", "a wall"],
)
def test_a_poor_view_ends_the_attempt_not_the_run(points: np.ndarray, cause: Cause) -> None:
    found, robot, _ = tried(points)
    assert found is cause
    assert robot.poses == []


def test_it_goes_to_the_best_candidate_and_looks_again_on_the_way() -> None:
    _, robot, sensor = tried(plate())
    assert sensor.looks == 1 + CONFIG.policy.corrections
    first, last = robot.poses[0], robot.poses[-1]
    assert last[0, 3] + last[1, 3] >= first[0, 3] + first[1, 3] > 0.07
    heights = [pose[2, 3] for pose in robot.poses]
    assert heights == sorted(heights, reverse=True)
    assert robot.states[-1] is State.DONE


def test_approach_is_the_mean_normal_of_a_tilted_plate() -> None:
    tilt = 0.3
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    points = plate() @ turn.T
    frames = candidates_at(points, np.array([840]), EYE, RADIUS_M, CONFIG.policy.tilt_max_rad)
    np.testing.assert_allclose(frames[0, :3, 2], turn[:, 2], atol=1e-9)
    assert len(candidates_at(points, np.array([840]), EYE, RADIUS_M, tilt_max_rad=0.2)) == 0
