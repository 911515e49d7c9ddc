"""Velocity by heights: known shifts come back, what stands still has none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.config.policy import MotionConfig
from pipeline.control.motion import Motion

PERIOD_S = 1 / 15
SEEN_M = 0.055
AIM_M = np.array([0.02, -0.03, 0.04])


def box(middle_m: np.ndarray, rng: np.random.Generator, noise_m: float = 0.0) -> np.ndarray:
    """Points on the top of a turned box, and on its sides as far as a camera sees them."""
    a, b = rng.uniform(-0.03, 0.03, 4000), rng.uniform(-0.025, 0.025, 4000)
    x, y = 0.8 * a - 0.6 * b, 0.6 * a + 0.8 * b
    top = np.column_stack([x, y, np.full(len(x), 0.04)])
    return np.asarray(middle_m * [1.0, 1.0, 0.0] + top + rng.normal(0.0, noise_m, top.shape))


def watched(velocity_m_s: np.ndarray, periods: int, noise_m: float, seed: int) -> Motion:
    rng = np.random.default_rng(seed)
    motion = Motion(PERIOD_S, SEEN_M, MotionConfig())
    for period in range(periods):
        passed_m = velocity_m_s * period * PERIOD_S
        motion.see(box(AIM_M + passed_m, rng, noise_m), AIM_M + passed_m)
        motion.count_period()
    return motion


@settings(max_examples=25, deadline=None)
@given(st.floats(0, 0.12), st.floats(-np.pi, np.pi), st.integers(0, 2**32 - 1))
def test_velocity_is_found(speed_m_s: float, heading: float, seed: int) -> None:
    velocity = speed_m_s * np.array([np.cos(heading), np.sin(heading), 0.0])
    found = watched(velocity, 8, 0.0005, seed).velocity_m_s
    np.testing.assert_allclose(found, velocity, atol=0.006)


def test_what_stands_still_has_no_velocity() -> None:
    for seed in range(5):
        assert not watched(np.zeros(3), 10, 0.001, seed).velocity_m_s.any()


def test_it_follows_far_beyond_the_first_picture() -> None:
    velocity = np.array([0.1, 0.0, 0.0])
    found = watched(velocity, 30, 0.0005, 1).velocity_m_s
    assert found[0] == pytest.approx(0.1, abs=0.008)


def test_nothing_seen_is_nothing_known() -> None:
    motion = Motion(PERIOD_S, SEEN_M, MotionConfig())
    motion.see(np.empty((0, 3)), AIM_M)
    motion.count_period()
    motion.see(np.empty((0, 3)), AIM_M)
    assert not motion.velocity_m_s.any()


def test_an_even_surface_without_edges_gives_no_velocity() -> None:
    rng = np.random.default_rng(3)
    motion = Motion(PERIOD_S, SEEN_M, MotionConfig())
    for _ in range(6):
        plate = rng.uniform(-0.15, 0.15, (30_000, 3))
        plate[:, 2] = 0.04 + rng.normal(0.0, 0.001, len(plate))
        motion.see(plate, AIM_M)
        motion.count_period()
        assert not motion.velocity_m_s.any()


def test_a_look_that_wanders_is_no_motion() -> None:
    """A picture shows what is around the aim; its border moves with the aim, the plate does not."""
    rng = np.random.default_rng(4)
    motion = Motion(PERIOD_S, SEEN_M, MotionConfig())
    plate = rng.uniform(-0.08, 0.08, (40_000, 3))
    plate[:, 2] = 0.04
    for aside_m in (0.0, 0.012, 0.024, 0.012):
        aim = AIM_M + np.array([aside_m, 0.0, 0.0])
        cut = plate[np.linalg.norm(plate[:, :2] - aim[:2], axis=1) < SEEN_M + 0.005]
        motion.see(cut, aim)
        motion.count_period()
        assert np.linalg.norm(motion.velocity_m_s) == 0.0
