"""Limits of a seal, in newtons, against closed forms."""

import math

import numpy as np
import pytest

from pipeline.config import GripperConfig
from pipeline.config.evaluation import SuctionConfig
from pipeline.gripper.pad import build_pad
from pipeline.simulation.suction import SealLimits, seal_limits
from tests.gripper.surfaces import everywhere, plane

GRIPPER, SUCTION = GripperConfig(), SuctionConfig()
PAD = build_pad(GRIPPER.pad)


def test_a_plane_holds_vacuum_times_area() -> None:
    found = seal_limits(PAD, plane(PAD), everywhere(PAD), GRIPPER, SUCTION)
    assert found.pressure == pytest.approx(1.0, abs=1e-9)
    # Reg.V is drawn as a polygon: its area is a little less than the circle's.
    circle_n = SUCTION.vacuum_pa * math.pi * GRIPPER.pad.radius_m**2
    assert 0.5 * circle_n < found.pull_n <= circle_n
    assert found.side_n == pytest.approx(found.pull_n * 0.5 * math.sqrt(3) / 3)
    assert found.torsion_nm == pytest.approx(found.side_n * 0.025)
    assert found.peel_nm == pytest.approx(found.pull_n * 0.020)


def test_twice_the_vacuum_holds_twice_as_much() -> None:
    stronger = SuctionConfig(vacuum_pa=2 * SUCTION.vacuum_pa)
    one = seal_limits(PAD, plane(PAD), everywhere(PAD), GRIPPER, SUCTION)
    two = seal_limits(PAD, plane(PAD), everywhere(PAD), GRIPPER, stronger)
    assert two.pull_n == pytest.approx(2 * one.pull_n)
    assert two.pressure == one.pressure


def test_nothing_under_the_pad_holds_nothing() -> None:
    heights = np.full(len(PAD.vertices_xy_m), -np.inf)
    found = seal_limits(PAD, heights, np.zeros(len(heights), dtype=bool), GRIPPER, SUCTION)
    assert found.pull_n == found.pressure == 0.0


LIMITS = SealLimits(pressure=1.0, pull_n=10.0, side_n=3.0, torsion_nm=0.05, peel_nm=0.2)


@pytest.mark.parametrize(
    ("load", "broken"),
    [
        ((0, 0, -9.9, 0, 0, 0), False),
        ((0, 0, -10.1, 0, 0, 0), True),
        ((0, 0, 500, 0, 0, 0), False),  # pressing on is no pull
        ((2.9, -2.9, 0, 0, 0, 0), False),
        ((0, -3.1, 0, 0, 0, 0), True),
        ((0, 0, 0, 0, 0, 0.06), True),
        ((0, 0, 0, 0.15, 0.15, 0), True),
        ((0, 0, 0, 0.19, 0, 0), False),
    ],
)
def test_each_limit_breaks_on_its_own(load: tuple[float, ...], broken: bool) -> None:
    assert LIMITS.bears(np.array(load, dtype=float)) is not broken


def test_the_largest_scale_is_where_the_first_limit_breaks() -> None:
    loads = np.array([[0, 0, -1.0, 0, 0, 0], [0.5, 0, -1.0, 0.01, 0, 0], [0, 0, 5.0, 0, 0, 0]])
    scale = LIMITS.largest_scale(loads)
    assert scale == pytest.approx(6.0)  # 3 N of side force over 0.5 N
    assert all(LIMITS.bears(0.999 * scale * load) for load in loads)
    assert not all(LIMITS.bears(1.001 * scale * load) for load in loads)
    assert LIMITS.largest_scale(loads[2:]) == np.inf
