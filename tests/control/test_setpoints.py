"""A setpoint comes to rest at its target, and keeps within its speed and its acceleration."""

import numpy as np
import pytest

from pipeline.control.setpoints import Way, next_speed_m_s
from pipeline.control.transport import way_aside_m
from pipeline.geometry.compiled_poses import turned

FASTEST_M_S, ACCELERATION_M_S2, PERIOD_S = 0.25, 1.0, 0.004
START = np.eye(4)
TARGET = turned(START, np.array([0.0, 0.3, 0.4]))
TARGET[:3, 3] = [0.1, -0.05, 0.02]


def test_the_ends_of_a_way_are_its_poses() -> None:
    way = Way.between(START, TARGET)
    np.testing.assert_allclose(way.at(0.0), START, atol=1e-15)
    np.testing.assert_allclose(way.at(1.0), TARGET, atol=1e-12)
    assert not way.is_done
    assert Way.between(TARGET, TARGET).is_done


def test_a_turn_on_the_spot_has_a_length() -> None:
    spun = turned(START, np.array([0.0, 0.0, 0.5]))
    assert Way.between(START, spun).length_m == pytest.approx(0.1)


def test_it_rests_at_the_target_within_speed_and_acceleration() -> None:
    pose, speed, speeds = START, 0.0, [0.0]
    for _ in range(1000):
        way = Way.between(pose, TARGET)
        left_m = way.length_m
        if left_m < 1e-9:
            break
        speed = next_speed_m_s(speed, FASTEST_M_S, left_m, ACCELERATION_M_S2, PERIOD_S)
        pose = way.at(min(speed * PERIOD_S / left_m, 1.0))
        speeds.append(speed)
    np.testing.assert_allclose(pose, TARGET, atol=1e-6)
    assert max(speeds) == FASTEST_M_S
    assert np.diff(speeds).max() <= ACCELERATION_M_S2 * PERIOD_S + 1e-12


def test_the_way_aside_is_the_longest_that_can_be_gone() -> None:
    """Inwards is -x from here; only the first 60 mm of it can be reached."""
    start = np.eye(4)
    start[0, 3] = 0.3
    np.testing.assert_allclose(way_aside_m(start, 0.2, lambda _: True), [-0.2, 0.0, 0.0])
    near = way_aside_m(start, 0.2, lambda end: bool(0.24 <= end[0, 3] <= 0.3 and end[1, 3] == 0.0))
    np.testing.assert_allclose(near, [-0.05, 0.0, 0.0])
    np.testing.assert_array_equal(way_aside_m(start, 0.2, lambda _: False), np.zeros(3))
