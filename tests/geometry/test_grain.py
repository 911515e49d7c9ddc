"""The grain of a skin: as high as it was drawn, along the normals, and the body stays closed."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.geometry.manifolds import from_manifold
from pipeline.geometry.parametric.solids import Solid
from pipeline.geometry.random_solids import KINDS, random_solid
from pipeline.geometry.random_solids.grain import _SHAPES, Grain, _shaped, draw_grain, grained
from pipeline.geometry.topology import components, is_closed


@pytest.mark.parametrize("shape", _SHAPES)
def test_a_relief_of_any_shape_has_mean_zero_and_variance_one(shape: str) -> None:
    heights = _shaped(np.random.default_rng(0).normal(size=400_000), shape)
    assert abs(heights.mean()) < 0.01
    assert heights.std() == pytest.approx(1.0, abs=0.01)


def test_pits_go_down_and_bumps_go_up() -> None:
    """Both leave most of the skin level, as they stand in places."""
    field = np.random.default_rng(0).normal(size=10_000)
    for shape, sign in (("bumps", 1.0), ("pits", -1.0)):
        heights = sign * _shaped(field, shape)
        assert np.mean(np.isclose(heights, heights.min())) > 0.6
        assert heights.max() > 5 * abs(heights.min())


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 2**32 - 1))
def test_heights_and_slopes_are_bounded(seed: int) -> None:
    grain = draw_grain(np.random.default_rng(seed))
    wavelengths_m = 2 * math.pi / np.linalg.norm(grain.waves_1_m, axis=1)
    assert 0.00002 * 0.99 <= grain.height_m <= 0.0004
    assert wavelengths_m.min() > 0.0024
    assert grain.height_m <= 0.0501 * wavelengths_m.min()


def test_a_grain_is_as_high_as_was_drawn_and_moves_along_the_normals() -> None:
    """On a ball vertices move towards or away from its middle alone."""
    ball = from_manifold(Solid.sphere(0.05, 16).refine_to_length(0.002))
    radius_m = np.linalg.norm(ball.vertices_m, axis=1)
    high_m = []
    for seed in range(20):
        moved = grained(ball, np.random.default_rng(seed))
        along = ball.vertices_m / radius_m[:, None]
        shift = moved.vertices_m - ball.vertices_m
        assert np.array_equal(moved.faces, ball.faces)
        outward_m = np.einsum("nk,nk->n", shift, along)
        # Faces of a ball of 16 segments turn by 22 degrees from one to the next.
        assert (
            np.linalg.norm(shift - outward_m[:, None] * along, axis=1).max()
            < 0.45 * np.abs(outward_m).max()
        )
        high_m.append(outward_m.std())
    assert 0.00001 < np.median(high_m) < 0.0003


def test_one_wave_rises_and_falls_within_its_length() -> None:
    wave = Grain(np.array([[2 * math.pi / 0.004, 0.0, 0.0]]), np.zeros(1), "grain", 0.0001)
    heights_m = wave.heights_m(np.array([[0.0, 0, 0], [0.001, 0, 0], [0.002, 0, 0], [0.004, 1, 1]]))
    assert heights_m == pytest.approx(np.array([1.0, 0.0, -1.0, 1.0]) * math.sqrt(2) * 0.0001)


@pytest.mark.parametrize("kind", KINDS)
def test_a_grained_solid_is_one_closed_body_with_a_finer_mesh(kind: str) -> None:
    rough = random_solid(np.random.default_rng([13, 0]), [kind], 1.0)
    assert is_closed(rough)
    assert len(components(rough.faces)) == 1
    sides = rough.vertices_m[rough.faces] - rough.vertices_m[np.roll(rough.faces, 1, axis=1)]
    assert np.median(np.linalg.norm(sides, axis=2)) < 0.0031  # 3 mm where faces are many


def test_a_share_of_them_has_a_grain() -> None:
    """The number of faces tells: the others keep longer edges."""
    coarse = [
        len(random_solid(np.random.default_rng([14, n]), ["lump"], 0.5).faces) < 16_000
        for n in range(60)
    ]
    assert 15 < sum(coarse) < 45
