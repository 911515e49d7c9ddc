"""A descriptor knows a shape again at any size, place and turn, however it is triangulated."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pipeline.geometry.descriptor import describe, shape_distance, surface_points
from pipeline.geometry.mesh import Mesh
from tests.bodies import mesh_of

WEDGE = trimesh.convex.convex_hull(
    [[0, 0, 0], [0.1, 0, 0], [0, 0.05, 0], [0.08, 0.05, 0], [0, 0, 0.03], [0.02, 0.04, 0.05]]
)


@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), scale=st.floats(1e-3, 1e3), mirrored=st.booleans())
def test_size_place_turn_and_mirroring_change_nothing(
    seed: int, scale: float, mirrored: bool
) -> None:
    rng = np.random.default_rng(seed)
    mesh = mesh_of(WEDGE)
    vertices = mesh.vertices_m @ Rotation.random(rng=rng).as_matrix().T
    faces = mesh.faces
    if mirrored:
        vertices, faces = vertices * [1, 1, -1], faces[:, ::-1]
    moved = Mesh(scale * (vertices + rng.normal(size=3)), faces)
    assert shape_distance(describe(mesh), describe(moved)) < 5e-3


def test_triangulation_changes_little() -> None:
    fine = WEDGE.subdivide_to_size(0.004)
    assert shape_distance(describe(mesh_of(WEDGE)), describe(mesh_of(fine))) < 0.01


def test_a_ball_has_the_numbers_of_a_ball() -> None:
    ball = describe(mesh_of(trimesh.creation.icosphere(subdivisions=5, radius=0.04)))
    radius = np.cbrt(3 / (4 * np.pi))  # of the ball of volume 1
    np.testing.assert_allclose(ball.radii, radius, rtol=2e-3)
    np.testing.assert_allclose(ball.moments, radius / np.sqrt(5), rtol=2e-3)
    # Chords of a sphere: their distribution function is (l / 2r) squared.
    shares = (np.arange(len(ball.chords)) + 0.5) / len(ball.chords)
    np.testing.assert_allclose(ball.chords, 2 * radius * np.sqrt(shares), rtol=0.02, atol=0.015)
    assert ball.nsvr == pytest.approx(2.1991, abs=2e-3)


def test_balls_are_alike_and_cubes_are_not_balls() -> None:
    ball = describe(mesh_of(trimesh.creation.icosphere(subdivisions=4)))
    lump = describe(mesh_of(trimesh.creation.icosphere(subdivisions=2)))
    cube = describe(mesh_of(trimesh.creation.box()))
    assert shape_distance(ball, lump) < 0.03
    assert shape_distance(ball, cube) > 0.08


def test_points_are_spread_over_the_surface_by_area() -> None:
    points = surface_points(mesh_of(trimesh.creation.box((1.0, 1.0, 0.01))), 2000)
    assert np.isclose(np.abs(points[:, 2]), 0.005).mean() == pytest.approx(2 / 2.04, abs=0.01)
    np.testing.assert_allclose(points.mean(axis=0), 0.0, atol=0.02)
