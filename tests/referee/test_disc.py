"""The disc's elements: areas, angles, symmetry, and the Laplacian of known functions."""

import numpy as np
import pytest

from pipeline.referee.disc import build_disc, laplacian

DISC = build_disc(0.025, 0.025 / 16)


def test_the_disc_is_a_polygon_of_96_sides() -> None:
    assert len(DISC.areas_m2) == 1 + 3 * 16 * 17
    polygon = 0.5 * 96 * np.sin(2 * np.pi / 96) * 0.025**2
    assert DISC.area_m2 == pytest.approx(polygon)
    assert DISC.triangle_areas_m2.min() > 0.0


def test_no_angle_is_obtuse() -> None:
    corners = DISC.vertices_xy_m[DISC.triangles]
    for k in range(3):
        a, b = (corners[:, (k + j) % 3] - corners[:, k] for j in (1, 2))
        assert (np.einsum("ij,ij->i", a, b) > -1e-15).all()


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_sixth_of_a_turn_and_a_mirror_map_it_onto_itself(mirrored: bool) -> None:
    turn = np.exp(1j * np.pi / 3)
    points = DISC.vertices_xy_m @ [1, 1j]
    moved = np.conj(points) if mirrored else points * turn
    away = np.abs(moved[:, None] - points[None])
    assert away.min(axis=1).max() < 1e-15
    image = away.argmin(axis=1)
    edges = {(i, int(j)) for i in range(len(points)) for j in _neighbours(i)}
    assert {(int(image[i]), int(image[j])) for i, j in edges} == edges


def test_linear_elements_are_exact_for_linear_functions() -> None:
    """uᵀ L u = ∫ |∇u|²."""
    matrix = laplacian(DISC, DISC.weights)
    u = 3.0 * DISC.vertices_xy_m[:, 0] - 2.0 * DISC.vertices_xy_m[:, 1]
    assert u @ (matrix @ u) == pytest.approx(13.0 * DISC.area_m2)
    assert np.abs(matrix @ np.ones(len(u))).max() < 1e-12


def test_patches_are_about_a_sixth_of_the_radius_wide() -> None:
    sizes = np.bincount(DISC.patch, DISC.areas_m2)
    assert len(sizes) == 61
    assert sizes.min() > 0.3 * DISC.area_m2 / 61


def _neighbours(vertex: int) -> np.ndarray:
    return DISC.neighbours[DISC.starts[vertex] : DISC.starts[vertex + 1]]
