"""Draping: the lowest surface above the scene that respects Delta_d and H."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from pipeline.config import GripperConfig, PadConfig
from pipeline.gripper import GraspStatus, build_pad, label
from pipeline.gripper.draping import contact_vertices, drape, drape_reference
from tests.gripper.surfaces import everywhere, plane

CONFIG = GripperConfig()
PAD = build_pad(CONFIG.pad)
COARSE = build_pad(PadConfig(radius_step_rg=0.24, rotation_step_rad=0.8))


def rough(seed: int, amplitude_m: float, missing: float, count: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    heights = rng.normal(scale=amplitude_m, size=count)
    heights[rng.random(count) < missing] = rng.choice([-np.inf, np.nan])
    return heights


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([1e-4, 2e-3, 2e-2, 0.2]),
    st.sampled_from([0.0, 0.3, 0.99, 1.0]),
)
def test_sweeps_agree_with_the_definition(seed: int, amplitude_m: float, missing: float) -> None:
    heights = rough(seed, amplitude_m, missing, len(PAD.vertices_xy_m))
    np.testing.assert_allclose(
        drape(PAD, heights[None])[0], drape_reference(PAD, heights), rtol=0, atol=1e-14
    )


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_is_the_lowest_surface_that_linear_programming_finds(seed: int) -> None:
    heights = rough(seed, 0.004, 0.2, len(COARSE.vertices_xy_m))
    heights[0] = 0.0
    a, b = COARSE.edges.T
    rows = np.zeros((2 * len(a), len(heights)))
    index = np.arange(len(a))
    rows[index, a], rows[index, b] = 1, -1
    rows[index + len(a), a], rows[index + len(a), b] = -1, 1
    floor = np.nanmax(np.where(np.isfinite(heights), heights, np.nan)) - 0.030
    bounds = [(max(h, floor) if math.isfinite(h) else floor, None) for h in heights]
    lowest = linprog(np.ones(len(heights)), rows, np.full(len(rows), 0.002), bounds=bounds)
    assert lowest.status == 0
    np.testing.assert_allclose(drape(COARSE, heights[None])[0], lowest.x, atol=1e-9)


def test_a_spike_holds_up_a_cone_one_distance_step_an_edge() -> None:
    heights = plane(PAD)
    heights[0] = 0.011
    draped = drape(PAD, heights[None])[0]
    rings = draped[1:].reshape(PAD.rings, PAD.sectors)
    expected = np.maximum(0.011 - 0.002 * np.arange(1, PAD.rings + 1), 0.0)
    np.testing.assert_allclose(rings, expected[:, None] * np.ones(PAD.sectors), atol=1e-15)
    contact = contact_vertices(PAD, draped, heights, everywhere(PAD))
    # Rings 1 to 5 hang at 9, 7, 5, 3, 1 mm; the spike's tip and rings 6 to 13 touch.
    assert contact[0]
    assert (contact[1:].reshape(PAD.rings, PAD.sectors).sum(axis=1) > 0).tolist() == (
        [False] * 5 + [True] * 8
    )


def test_a_step_within_delta_d_seals_and_a_higher_one_does_not() -> None:
    x = PAD.vertices_xy_m[:, 0]
    for step_m, seals in ((0.0019, True), (0.0030, False)):
        heights = np.where(x > 0.0051, 0.0, -step_m)
        result = label(PAD, CONFIG, heights, everywhere(PAD))
        assert (result.pressure > 1 - 1e-9) is seals
        assert bool(result.contact.all()) is seals


def test_a_groove_narrower_than_its_depth_allows_is_bridged() -> None:
    x = PAD.vertices_xy_m[:, 0]
    groove = np.abs(x) < 0.0031
    shallow = label(PAD, CONFIG, np.where(groove, -0.0015, 0.0), everywhere(PAD))
    deep = label(PAD, CONFIG, np.where(groove, -0.02, 0.0), everywhere(PAD))
    assert shallow.contact.all()
    assert not deep.contact[groove].any()
    assert deep.contact[~groove].all()
    assert deep.q < shallow.q


def test_nothing_reaches_deeper_than_the_altitude() -> None:
    heights = np.full(len(PAD.vertices_xy_m), -1.0)
    heights[-1] = 0.0
    draped = drape(PAD, heights[None])[0]
    assert draped.min() == -CONFIG.pad.altitude_m
    assert label(PAD, CONFIG, heights, everywhere(PAD)).contact.sum() == 1


def test_a_pad_over_nothing_has_no_contact() -> None:
    for nothing in (np.nan, -np.inf):
        result = label(PAD, CONFIG, np.full(586, nothing), everywhere(PAD))
        assert result.status is GraspStatus.NO_CONTACT
        assert result.q == 0.0
        assert result.touch_height_m == -math.inf
