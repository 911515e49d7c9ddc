"""Meshes as shown: bounded, and still the shape they stand for."""

import numpy as np
import pytest
import trimesh

from pipeline.geometry.mesh import Mesh
from pipeline.geometry.parametric import parametric_source
from pipeline.recording.shapes import SHOWN_FACES, _shaded, vertex_normals


def solid(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)


@pytest.mark.parametrize("name", ["puzzle_cube", "golf_ball", "spray_bottle"])
def test_a_simplified_mesh_keeps_its_shape(name: str) -> None:
    """In metres the simplifier tears the cube."""
    mesh = parametric_source(name).mesh
    assert len(mesh.faces) > SHOWN_FACES
    shown = _shaded(mesh)
    assert len(shown.faces) <= 1.1 * SHOWN_FACES
    np.testing.assert_allclose(shown.extents_m, mesh.extents_m, rtol=0.03)
    assert solid(shown).volume == pytest.approx(solid(mesh).volume, rel=0.05)


def test_edges_stay_sharp_and_curves_smooth() -> None:
    box = trimesh.creation.box()
    shown = _shaded(Mesh(np.array(box.vertices), np.array(box.faces)))
    normals = vertex_normals(shown)
    assert len(normals) == 24
    np.testing.assert_allclose(np.abs(normals).max(axis=1), 1.0)
    ball = trimesh.creation.icosphere(subdivisions=3)
    shown = _shaded(Mesh(np.array(ball.vertices), np.array(ball.faces)))
    assert len(shown.vertices_m) == len(ball.vertices)
