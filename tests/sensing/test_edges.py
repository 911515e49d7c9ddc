"""Edges of a measured cloud: flat, a step, a roof, a hole; and what noise does not make."""

import numpy as np
import pytest

from pipeline.sensing.edges import edge_distance

CELLS, SIDE = 24, 0.1
X = (np.arange(CELLS) - (CELLS - 1) / 2) * SIDE


def distance(height: np.ndarray, mask: np.ndarray | None = None) -> float:
    cloud = np.zeros((1, CELLS, CELLS, 3))
    cloud[..., 0], cloud[..., 1], cloud[..., 2] = X[None, :], X[:, None], height
    seen = np.ones((CELLS, CELLS), dtype=bool) if mask is None else mask
    return float(edge_distance(cloud, seen[None])[0])


def test_a_plane_has_no_edge_flat_or_tilted() -> None:
    assert np.isinf(distance(np.zeros((CELLS, CELLS))))
    assert np.isinf(distance(0.4 * np.broadcast_to(X, (CELLS, CELLS))))


@pytest.mark.parametrize("turned", [False, True])
def test_a_step_is_as_far_away_as_it_lies(turned: bool) -> None:
    height = np.where(X > 0.6, -0.5, 0.0)[None, :].repeat(CELLS, axis=0)
    found = distance(height.T if turned else height)
    assert found == pytest.approx(0.6, abs=2 * SIDE)


def test_a_roof_has_a_crease_at_its_ridge_and_a_cylinder_has_none() -> None:
    roof = -0.5 * np.abs(X - 0.4)[None, :].repeat(CELLS, axis=0)
    assert distance(roof) == pytest.approx(0.4, abs=3 * SIDE)
    radius = 3.0
    cylinder = (np.sqrt(radius**2 - X**2) - radius)[None, :].repeat(CELLS, axis=0)
    assert np.isinf(distance(cylinder))


def test_what_was_not_measured_begins_at_an_edge() -> None:
    mask = np.ones((CELLS, CELLS), dtype=bool)
    mask[:, X > 0.8] = False
    assert distance(np.zeros((CELLS, CELLS)), mask) == pytest.approx(0.8, abs=SIDE)
    assert np.isinf(distance(np.zeros((CELLS, CELLS)), np.zeros((CELLS, CELLS), dtype=bool)))


def test_noise_and_single_lost_cells_make_hardly_an_edge() -> None:
    """Heights that stray by 1.5 mm, and a twentieth of the cells lost."""
    rng = np.random.default_rng(0)
    found = [
        distance(rng.normal(0.0, 0.06, (CELLS, CELLS)), rng.random((CELLS, CELLS)) > 0.05)
        for _ in range(40)
    ]
    assert np.mean(np.array(found) > 0.8) > 0.8
