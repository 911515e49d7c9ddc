"""The policy against fakes: where it seals next after a seal, a tug or a transport that failed."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from pipeline.control.candidates import Candidates
from pipeline.control.cloud import DepthPicture
from pipeline.control.decision import Cause
from pipeline.control.robot import Reading, State
from tests.control.fakes import FakeRobot, HeavyRobot
from tests.control.plates import CLOSED, CONFIG, OPEN, TOP_M, plate, tried, with_policy


def heavy(lever_m: float) -> HeavyRobot:
    return HeavyRobot(TOP_M, np.array([-0.01, 0.0, 0.02]), lever_m, CONFIG.hand.length_m)


def test_what_broke_away_askew_is_grasped_nearer_to_where_it_hangs() -> None:
    """All that is seen says: the corner. The tug says where the weight is."""
    robot = heavy(lever_m=0.02)
    decision, _ = tried(plate(), robot)
    assert decision.cause is Cause.LIFTED
    assert 1 <= decision.regrasps <= CONFIG.policy.regrasps
    first, last = (np.linalg.norm(p[:2, 3] - robot.centre_m[:2]) for p in robot.sealed_at[:2])
    assert last < 0.7 * first
    assert robot.states.count(State.SEAL) == 1 + decision.regrasps


def test_without_a_second_seal_it_is_a_failure() -> None:
    robot = heavy(lever_m=0.02)
    decision, _ = tried(plate(), robot, replace(CLOSED, seals_again=False))
    assert decision.cause is Cause.NO_SEAL
    assert decision.regrasps == 0
    assert robot.states.count(State.SEAL) == decision.seals == 1


def test_regrasps_end() -> None:
    robot = heavy(lever_m=0.0)
    decision, _ = tried(plate(), robot)
    assert decision.cause is Cause.NO_SEAL
    assert decision.regrasps <= CONFIG.policy.regrasps


class LeakyRobot(FakeRobot):
    """The first place that is tried has a hole."""

    def __init__(self, surface_m: float) -> None:
        super().__init__(surface_m)
        self.sealed_at: list[np.ndarray] = []

    def vacuum(self, on: bool) -> None:
        if on:
            self.sealed_at.append(self.pose()[:3, 3])
        leaks = np.linalg.norm(self.pose()[:3, 3] - self.sealed_at[0]) < 0.025
        super().vacuum(on and not leaks)


def test_without_the_wrench_the_next_best_is_sealed_as_often() -> None:
    """The tug says where the weight is; who does not feel goes by rank."""
    robot = heavy(lever_m=0.0)
    decision, _ = tried(plate(), robot, replace(OPEN, seals_again=True))
    assert decision.cause is Cause.NO_SEAL
    assert decision.seals == len(robot.sealed_at) == 1 + CONFIG.policy.regrasps
    away = [p[:2, 3] - robot.sealed_at[0][:2, 3] for p in robot.sealed_at[1:]]
    assert min(np.linalg.norm(away, axis=1)) >= 0.9 * CONFIG.policy.another_m


class ShakyRobot(FakeRobot):
    """Loses its object where it is carried faster than ``most_m_s2``."""

    def __init__(self, surface_m: float, most_m_s2: float) -> None:
        super().__init__(surface_m)
        self.most_m_s2 = most_m_s2

    def carry(self, acceleration_m_s2: float) -> Reading:
        self.sucks = acceleration_m_s2 <= self.most_m_s2
        return super().carry(acceleration_m_s2)


@pytest.mark.parametrize(("most", "carried"), [(0.5, 0.0), (1.0, 1.0), (4.0, 3.0), (9.0, 5.0)])
def test_what_falls_in_transport_is_lost(most: float, carried: float) -> None:
    decision, _ = tried(plate(), ShakyRobot(TOP_M, most))
    assert decision.carried_m_s2 == carried
    assert decision.cause is (Cause.LIFTED if carried == 5.0 else Cause.LOST_IN_TRANSPORT)


def test_where_nothing_holds_another_place_is_grasped_in_the_same_attempt() -> None:
    robot = LeakyRobot(TOP_M)
    decision, eyes = tried(plate(), robot)
    assert decision.cause is Cause.LIFTED
    assert decision.regrasps == len(decision.failed_contacts_m) == 1
    assert eyes.static_looks == 1
    np.testing.assert_allclose(decision.failed_contacts_m[0][:2], robot.sealed_at[0][:2], atol=2e-3)


class WindyRobot(FakeRobot):
    """Nothing holds; the vacuum that is felt falls with the distance from a place."""

    def __init__(self, surface_m: float, best_m: np.ndarray, reach_m: float) -> None:
        super().__init__(surface_m, State.SEAL)
        self.best_m, self.felt_reach_m = best_m, reach_m
        self.sealed_at: list[np.ndarray] = []

    def step(self, world_from_gripper: np.ndarray, speed_m_s: float) -> Reading:
        reading = super().step(world_from_gripper, speed_m_s)
        if not self.sucks:
            return replace(reading, pressure=0.0)
        away = reading.world_from_gripper[:3, 3] - self.sealed_at[-1]
        broke_away = away[2] > 0.001
        apart_m = np.linalg.norm(self.sealed_at[-1][:2] - self.best_m)
        vacuum = 0.0 if broke_away else 0.5 * np.exp(-((apart_m / self.felt_reach_m) ** 2))
        return replace(reading, pressure=float(vacuum))

    def vacuum(self, on: bool) -> None:
        super().vacuum(on)
        if on:
            self.sealed_at.append(self.pose()[:3, 3])


@pytest.mark.parametrize(("reach_m", "stays"), [(0.05, True), (1e-3, False)])
def test_after_a_seal_that_failed_the_vacuum_felt_leads(reach_m: float, stays: bool) -> None:
    """Nothing promises more than anything else: what was nearly sealed is tried beside itself."""

    def level(_: Sequence[DepthPicture], candidates: Candidates) -> np.ndarray:
        return np.full(len(candidates), 0.01)

    robot = WindyRobot(TOP_M, np.zeros(2), reach_m)
    decision, _ = tried(plate()[::2], robot, replace(CLOSED, ranking=level))
    assert decision.cause is Cause.NO_SEAL
    apart_m = np.linalg.norm((robot.sealed_at[1] - robot.sealed_at[0])[:2])
    assert (apart_m < 0.03) == stays
    assert all(seal.vacuum >= 0.0 for seal in decision.tried)


def test_every_place_that_did_not_hold_is_told() -> None:
    robot = FakeRobot(TOP_M, State.SEAL)
    decision, _ = tried(plate(), robot)
    assert decision.cause is Cause.NO_SEAL
    assert len(decision.failed_contacts_m) == 1 + decision.regrasps == 1 + CONFIG.policy.regrasps


@pytest.mark.parametrize(("least", "regrasps"), [(0.0, CONFIG.policy.regrasps), (0.1, 0)])
def test_a_second_try_must_promise_enough(least: float, regrasps: int) -> None:
    def promises(_: Sequence[DepthPicture], candidates: Candidates) -> np.ndarray:
        return np.full(len(candidates), 0.05)

    config = with_policy(regrasp_quality=least)
    strategy = replace(CLOSED, ranking=promises)
    decision, _ = tried(plate(), FakeRobot(TOP_M, State.SEAL), strategy, config=config)
    assert decision.cause is Cause.NO_SEAL
    assert decision.regrasps == regrasps


def test_where_all_places_failed_before_they_are_tried_again() -> None:
    small = plate() * [0.1, 0.1, 1.0]
    decision, _ = tried(small, FakeRobot(TOP_M), OPEN, avoid_m=[np.array([0.0, 0.0, TOP_M])])
    assert decision.cause is Cause.LIFTED
