"""The policy against fakes: every way to end has its cause, and it aims where quality is."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from pipeline.control.candidates import Candidates
from pipeline.control.cloud import DepthPicture
from pipeline.control.decision import Cause, Strategy
from pipeline.control.policy import Attempt
from pipeline.control.robot import Reading, State
from tests.control.fakes import FakeEyes, FakeRobot
from tests.control.plates import CLOSED, CONFIG, OPEN, RADIUS_M, TOP_M, plate, tried


@pytest.mark.parametrize(
    ("fails_at", "cause"),
    [
        (None, Cause.LIFTED),
        (State.PREGRASP, Cause.COLLISION),
        (State.APPROACH, Cause.COLLISION),
        (State.SEAL, Cause.NO_SEAL),
        (State.LIFT, Cause.LOST_IN_LIFT),
        (State.SHAKE, Cause.LOST_IN_SHAKE),
        (State.TRANSPORT, Cause.LOST_IN_TRANSPORT),
    ],
)
def test_each_failure_has_its_cause(fails_at: State | None, cause: Cause) -> None:
    robot = FakeRobot(TOP_M, fails_at)
    assert tried(plate(), robot)[0].cause is cause
    assert robot.states[-1] is State.DONE


@pytest.mark.parametrize(
    ("points", "cause"),
    [
        (np.empty((0, 3)), Cause.EMPTY_CLOUD),
        (plate(0.001), Cause.EMPTY_CLOUD),
        (np.full((50, 3), np.nan), Cause.EMPTY_CLOUD),
        (plate().reshape(161, 161, 3)[::13, ::13].reshape(-1, 3), Cause.NO_CANDIDATE),
    ],
    ids=["nothing", "bare table", "NaN depth", "points 8 mm apart"],
)
def test_a_poor_view_ends_the_attempt_not_the_run(points: np.ndarray, cause: Cause) -> None:
    robot = FakeRobot(TOP_M)
    assert tried(points, robot, OPEN)[0].cause is cause
    assert robot.poses == []


@pytest.mark.parametrize("pictures", [0, 1, 2, 4], ids=lambda n: f"after {n}")
def test_a_camera_that_stops_ends_the_attempt(pictures: int) -> None:
    decision, _ = tried(plate(), FakeRobot(TOP_M), pictures=pictures)
    assert decision.cause is Cause.CAMERA_STOPPED


def test_what_cannot_be_reached_is_named() -> None:
    robot = FakeRobot(TOP_M, reach_m=0.01)
    points = plate() + np.array([0.2, 0.0, 0.0])
    assert tried(points, robot)[0].cause is Cause.UNREACHABLE


def test_of_two_plates_the_one_within_reach_is_tried() -> None:
    robot = FakeRobot(TOP_M, reach_m=0.1)
    points = np.concatenate([plate(), plate() + np.array([0.25, 0.0, 0.0])])
    decision, _ = tried(points, robot)
    assert decision.cause is Cause.LIFTED
    assert decision.world_from_contact[0, 3] < 0.1


def test_a_surface_that_is_not_there_is_no_contact() -> None:
    assert tried(plate(), FakeRobot(surface_m=-1.0))[0].cause is Cause.NO_CONTACT


def test_it_goes_to_the_best_and_corrects_on_the_way() -> None:
    robot = FakeRobot(TOP_M)
    decision, eyes = tried(plate(), robot)
    assert eyes.static_looks == 1
    # Two looks before the choice, as the plate's corners are 141 mm apart, then some.
    assert eyes.wrist_looks == CONFIG.policy.wrist_views + decision.corrections
    assert decision.corrections >= 4
    assert decision.world_from_contact[:2, 3].sum() > 0.08
    np.testing.assert_allclose(decision.world_from_contact[:3, 2], [0, 0, 1], atol=0.02)


def place_after_a_bump(strategy: Strategy) -> np.ndarray:
    """Where the pad ends, x and y, on a plate that was pushed by 10 mm as the approach began."""
    robot = FakeRobot(TOP_M)
    eyes = FakeEyes(plate(), robot)
    rng = np.random.default_rng(0)
    attempt = Attempt(eyes, robot, strategy, CONFIG, RADIUS_M, rng)
    enter = robot.enter

    def bumped(state: State) -> None:
        enter(state)
        if state is State.APPROACH:
            eyes.points = plate() - np.array([0.01, 0.01, 0.0])

    robot.enter = bumped  # type: ignore[method-assign]
    return np.asarray(attempt.run().world_from_contact[:2, 3])


def test_a_correction_follows_an_object_that_moved() -> None:
    """The corner that was chosen is now at 40 mm; without corrections the pad hangs over it."""
    assert place_after_a_bump(CLOSED).max() <= 0.041
    assert place_after_a_bump(replace(CLOSED, corrects=False)).max() > 0.041


@pytest.mark.parametrize("passes_m_s", [0.0, 0.1])
def test_it_meets_an_object_that_passes(passes_m_s: float) -> None:
    """Also where the camera is too near to see it any more."""
    robot = FakeRobot(TOP_M)
    eyes = FakeEyes(plate()[::3] * [0.8, 0.8, 1.0], robot)
    begun = eyes.points[:, 0].mean()
    step = robot.step

    def passing(world_from_gripper: np.ndarray, speed_m_s: float) -> Reading:
        if not robot.sucks:
            eyes.points = eyes.points + np.array([passes_m_s / CONFIG.policy.rate_hz, 0.0, 0.0])
        return step(world_from_gripper, speed_m_s)

    def near_the_middle(_: Sequence[DepthPicture], candidates: Candidates) -> np.ndarray:
        aside = candidates.world_from_contact[:, :2, 3] - eyes.points[:, :2].mean(axis=0)
        return np.asarray(np.exp(-np.linalg.norm(aside, axis=1) / 0.03))

    robot.step = passing  # type: ignore[method-assign]
    strategy = replace(CLOSED, ranking=near_the_middle)
    rng = np.random.default_rng(0)
    decision = Attempt(eyes, robot, strategy, CONFIG, RADIUS_M, rng).run()
    assert decision.cause is Cause.LIFTED
    middle = eyes.points[:, :2].mean(axis=0)
    assert middle[0] - begun >= 3 * passes_m_s * 0.2
    assert np.linalg.norm(decision.world_from_contact[:2, 3] - middle) < 0.012


def test_an_attempt_ends_where_the_object_keeps_moving_away() -> None:
    robot = FakeRobot(TOP_M)
    eyes = FakeEyes(plate()[::3], robot)
    step = robot.step

    def fleeing(world_from_gripper: np.ndarray, speed_m_s: float) -> Reading:
        eyes.points = eyes.points + np.array([0.02, 0.0, 0.0])
        reading = step(world_from_gripper, speed_m_s)
        travels = speed_m_s == CONFIG.policy.travel_m_s
        return replace(reading, wrench=np.zeros(6), arrived=reading.arrived and travels)

    robot.enter = lambda state: setattr(  # type: ignore[method-assign]
        robot, "step", fleeing if state is State.APPROACH else step
    )
    rng = np.random.default_rng(0)
    decision = Attempt(eyes, robot, CLOSED, CONFIG, RADIUS_M, rng).run()
    assert decision.cause in (Cause.NO_CONTACT, Cause.UNREACHABLE)


def test_without_corrections_the_first_pose_stands() -> None:
    decision, eyes = tried(plate(), FakeRobot(TOP_M), OPEN)
    assert eyes.wrist_looks == decision.corrections == 0
    assert decision.cause is Cause.LIFTED


def test_the_pad_touches_where_the_corrected_aim_is() -> None:
    """What looks best changes on the way down, so that the aim moves sideways late."""
    robot = FakeRobot(TOP_M)
    sealed_at: list[np.ndarray] = []
    switch = robot.vacuum

    def remembered(on: bool) -> None:
        sealed_at.extend([robot.pose()] * on)
        switch(on)

    def drifting(_: Sequence[DepthPicture], candidates: Candidates) -> np.ndarray:
        from_near = robot.state is State.APPROACH and robot.pose()[2, 3] < TOP_M + 0.16
        aside = candidates.world_from_contact[:, 0, 3] - (0.03 if from_near else 0.0)
        return np.asarray(np.exp(-np.abs(aside) / 0.01))

    robot.vacuum = remembered  # type: ignore[method-assign]
    decision, _ = tried(plate(), robot, replace(CLOSED, ranking=drifting))
    aim = decision.world_from_contact
    assert aim[0, 3] > 0.01
    assert np.linalg.norm((sealed_at[0] - aim)[:2, 3]) < 2 * CONFIG.policy.align_m


def test_a_place_that_failed_is_not_tried_again() -> None:
    first, _ = tried(plate(), FakeRobot(TOP_M, State.SEAL), OPEN)
    failed = first.world_from_contact[:3, 3]
    second, _ = tried(plate(), FakeRobot(TOP_M), OPEN, avoid_m=[failed])
    distance = np.linalg.norm(second.world_from_contact[:3, 3] - failed)
    assert distance > CONFIG.policy.avoid_radius_m


def test_a_place_that_looks_bad_from_near_is_left_for_another() -> None:
    """Two small plates; the first promises more from afar and nothing from near."""
    robot = FakeRobot(TOP_M)
    small = plate() * [0.4, 0.4, 1.0]
    points = np.concatenate([small, small + np.array([0.25, 0.0, 0.0])])

    def deceived(_: Sequence[DepthPicture], candidates: Candidates) -> np.ndarray:
        first = candidates.world_from_contact[:, 0, 3] < 0.1
        from_near = robot.state is State.APPROACH
        return np.where(first, 0.05 if from_near else 0.9, 0.6)

    decision, _ = tried(points, robot, replace(CLOSED, ranking=deceived))
    assert decision.cause is Cause.LIFTED
    assert decision.world_from_contact[0, 3] > 0.15


@pytest.mark.parametrize(("promised", "drawn"), [(0.9, 1), (0.1, 4)])
def test_more_candidates_are_drawn_only_where_none_promises_enough(
    promised: float, drawn: int
) -> None:
    def promises(_: Sequence[DepthPicture], candidates: Candidates) -> np.ndarray:
        return np.full(len(candidates), promised)

    decision, _ = tried(plate(), FakeRobot(TOP_M), replace(OPEN, ranking=promises))
    assert len(decision.candidates) == drawn * CONFIG.policy.candidates


@pytest.mark.parametrize(("level_promises", "aims_steep"), [(0.6, False), (0.1, True)])
def test_a_steep_place_is_tried_only_where_no_other_promises_enough(
    level_promises: float, aims_steep: bool
) -> None:
    slope = np.radians(-65)  # it faces the camera over the level plate
    steep = plate(0.0) @ np.array(
        [[np.cos(slope), 0, -np.sin(slope)], [0, 1, 0], [np.sin(slope), 0, np.cos(slope)]]
    )
    points = np.concatenate([plate(), steep + np.array([0.25, 0.0, TOP_M])])

    def promises(_: Sequence[DepthPicture], candidates: Candidates) -> np.ndarray:
        return np.where(candidates.world_from_contact[:, 2, 2] < 0.5, 0.9, level_promises)

    decision, _ = tried(points, FakeRobot(TOP_M), replace(OPEN, ranking=promises))
    assert (decision.world_from_contact[2, 2] < 0.5) == aims_steep
