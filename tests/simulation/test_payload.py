"""Loads of an attempt against mechanics, and what a seal bears of them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.config.evaluation import EvaluateConfig, LiftConfig, TransportConfig
from pipeline.control.transport import way_inwards
from pipeline.simulation.payload import (
    GRAVITY_M_S2,
    accelerations_m_s2,
    loads_of_a_kilogram,
    weight_borne_n,
)
from pipeline.simulation.suction import SealLimits
from tests.bodies import pose_at

STRONG = SealLimits(pressure=1.0, pull_n=20.0, side_n=1e9, torsion_nm=1e9, peel_nm=1e9)
STILL = EvaluateConfig(
    lift=LiftConfig(shake_m=0.0), transport=TransportConfig(accelerations_m_s2=())
)
angle = st.floats(-1.2, 1.2)


def test_a_kilogram_that_hangs_still_pulls_with_its_weight_at_its_lever() -> None:
    load = loads_of_a_kilogram(
        pose_at(0.1, 0.2, 0.3), np.array([0.14, 0.2, 0.25]), np.zeros((1, 3))
    )
    # Its centre is 40 mm along x from the pad: the weight turns about y, x cross -z = +y.
    np.testing.assert_allclose(load[0], [0, 0, -9.81, 0, 0.04 * 9.81, 0], atol=1e-12)


@given(angle, angle)
def test_a_turned_gripper_feels_the_same_force_and_moment(about_x: float, about_y: float) -> None:
    cx, sx, cy, sy = math.cos(about_x), math.sin(about_x), math.cos(about_y), math.sin(about_y)
    turn = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]) @ np.array(
        [[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]
    )
    level, turned = pose_at(0.1, 0.2, 0.3), pose_at(0.1, 0.2, 0.3)
    turned[:3, :3] = turn
    centre, moved = np.array([0.15, 0.18, 0.2]), np.array([[1.0, -2.0, 3.0]])
    plain = loads_of_a_kilogram(level, centre, moved)[0]
    seen = loads_of_a_kilogram(turned, centre, moved)[0]
    np.testing.assert_allclose(turn @ seen[:3], plain[:3], atol=1e-9)
    np.testing.assert_allclose(turn @ seen[3:], plain[3:], atol=1e-9)


def test_an_attempt_lifts_shakes_and_carries_as_configured() -> None:
    config = EvaluateConfig(
        lift=LiftConfig(shake_m=0.005, shake_hz=2.0),
        transport=TransportConfig(accelerations_m_s2=(1.0, 4.0)),
    )
    found = accelerations_m_s2(np.array([0.3, 0.4, 0.1]), config)
    assert (found == 0.0).all(axis=1).any()  # also at rest
    assert found[:, 2].max() == config.policy.acceleration_m_s2
    np.testing.assert_allclose(
        sorted(found @ way_inwards(np.array([0.3, 0.4, 0.1])))[:: len(found) - 1], [-4.0, 4.0]
    )
    shake = (2 * np.pi * 2.0) ** 2 * 0.005
    assert np.isclose(found[:, 0], shake).any()


def test_the_way_leads_to_the_middle_and_along_x_from_there() -> None:
    np.testing.assert_allclose(way_inwards(np.array([0.3, -0.4, 0.9])), [-0.6, 0.8, 0.0])
    np.testing.assert_allclose(way_inwards(np.array([0.0, 0.0, 0.9])), [1.0, 0.0, 0.0])


def test_a_straight_pull_bears_less_weight_the_faster_it_is_lifted() -> None:
    pose, under = pose_at(0, 0, 0.1), np.array([0.0, 0.0, 0.05])
    acceleration = STILL.policy.acceleration_m_s2
    assert weight_borne_n(STRONG, pose, under, STILL) == pytest.approx(
        20.0 * GRAVITY_M_S2 / (GRAVITY_M_S2 + acceleration)
    )


def test_a_lever_bears_less_and_so_does_a_faster_transport() -> None:
    pose = pose_at(0.2, 0, 0.1)
    weak = SealLimits(pressure=1.0, pull_n=20.0, side_n=3.0, torsion_nm=0.1, peel_nm=0.2)
    beside = [
        weight_borne_n(weak, pose, np.array([0.2 + x, 0.0, 0.1]), STILL) for x in (0.0, 0.02, 0.04)
    ]
    assert (np.diff(beside) < 0).all()
    carried = [
        weight_borne_n(
            weak,
            pose,
            np.array([0.2, 0.0, 0.1]),
            STILL.model_copy(update={"transport": TransportConfig(accelerations_m_s2=(fast,))}),
        )
        for fast in (1.0, 3.0, 5.0)
    ]
    assert carried[0] >= carried[1] >= carried[2]
    assert carried[2] == pytest.approx(3.0 * GRAVITY_M_S2 / 5.0)
