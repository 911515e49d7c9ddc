"""Meshes as shown: bounded, and still the shape they stand for."""

import numpy as np
import pytest
import trimesh

from pipeline.geometry.mesh import Mesh
from pipeline.geometry.parametric import parametric_source
from pipeline.recording.shapes import MOST_FACES, TOLERANCE_M, Shaded, shaded


def solid(mesh: Mesh | Shaded) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)


@pytest.mark.parametrize("name", ["puzzle_cube", "golf_ball", "comb"])
def test_a_simplified_mesh_lies_where_the_mesh_lies(name: str) -> None:
    mesh = parametric_source(name).mesh
    shown = shaded(mesh)
    assert len(shown.faces) < 0.7 * len(mesh.faces)
    for points, surface in ((shown.vertices_m, mesh), (mesh.vertices_m, shown)):
        _, distance_m, _ = trimesh.proximity.closest_point(solid(surface), points[::10])
        assert distance_m.max() <= 2 * TOLERANCE_M
    assert solid(shown).volume == pytest.approx(solid(mesh).volume, rel=0.1)


def test_a_rough_mesh_is_bounded_all_the_same() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.1)
    rough = np.array(ball.vertices) * np.random.default_rng(0).uniform(0.98, 1, (10242, 1))
    shown = shaded(Mesh(rough, np.array(ball.faces)))
    assert 100 < len(shown.faces) <= MOST_FACES


def test_edges_stay_sharp_and_curves_smooth() -> None:
    box = trimesh.creation.box()
    shown = shaded(Mesh(np.array(box.vertices), np.array(box.faces)))
    normals = shown.normals
    assert len(normals) == 24
    np.testing.assert_allclose(np.abs(normals).max(axis=1), 1.0)
    ball = trimesh.creation.icosphere(subdivisions=3)
    shown = shaded(Mesh(np.array(ball.vertices), np.array(ball.faces)))
    assert len(shown.vertices_m) == len(ball.vertices)
    outward = ball.vertices / np.linalg.norm(ball.vertices, axis=1, keepdims=True)
    order = trimesh.proximity.ProximityQuery(ball).vertex(shown.vertices_m)[1]
    assert np.einsum("ij,ij->i", shown.normals, outward[order]).min() > 0.99
