"""A mesh keeps its arrays from being changed, and gives moved and scaled copies."""

import numpy as np
import pytest

from pipeline.geometry.mesh import Mesh

CORNERS = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def test_a_meshs_arrays_cannot_be_written_to() -> None:
    mesh = Mesh(CORNERS.copy(), FACES.copy())
    for array in (mesh.vertices_m, mesh.faces, mesh.scaled(2.0).vertices_m):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_the_arrays_a_mesh_is_made_from_stay_the_callers_to_write() -> None:
    corners = CORNERS.copy()
    Mesh(corners, FACES)
    corners[0] = 1.0
    assert corners[0].tolist() == [1.0, 1.0, 1.0]


def test_a_mesh_is_scaled_about_its_origin_and_moved_by_a_pose() -> None:
    mesh = Mesh(CORNERS, FACES)
    np.testing.assert_allclose(mesh.extents_m, [0.3, 0.2, 0.1])
    np.testing.assert_allclose(mesh.scaled(2.0).extents_m, [0.6, 0.4, 0.2])
    quarter_turn = np.array([[0, -1, 0, 1.0], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    moved = mesh.transformed(quarter_turn).vertices_m
    expected = np.array([[1.0, 2.0, 3.0], [1.0, 2.3, 3.0], [0.8, 2.0, 3.0], [1.0, 2.0, 3.1]])
    np.testing.assert_allclose(moved, expected)
