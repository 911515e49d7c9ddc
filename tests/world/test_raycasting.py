"""Ray scenes against closed forms, and against another ray caster on a real mesh."""

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.geometry.mesh import Mesh
from pipeline.world.raycasting import RayScene
from tests.checked_shapes import unchecked

DOWN = np.array([0.0, 0.0, -1.0])


def mesh_of(shape: trimesh.Trimesh, offset_m: tuple[float, float, float] = (0, 0, 0)) -> Mesh:
    return Mesh(np.asarray(shape.vertices) + np.array(offset_m), np.asarray(shape.faces))


def test_height_of_a_tilted_plane_is_exact_far_from_the_origin() -> None:
    # Float32 alone would be off by 1e-4 m at 1 km.
    slope_x, slope_y, offset = 0.3, -0.7, np.array([1000.0, -400.0, 25.0])
    xy = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * 0.1
    corners = np.column_stack([xy, xy @ [slope_x, slope_y]]) + offset
    scene = RayScene([Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))])
    grid = np.random.default_rng(1).uniform(-0.09, 0.09, size=(500, 2))
    origins = np.column_stack([grid, np.full(500, 0.5)]) + offset
    hits = scene.cast(origins, DOWN)
    np.testing.assert_allclose(hits.distance_m, 0.5 - grid @ [slope_x, slope_y], rtol=1e-9)
    assert (hits.body == 0).all()


def test_box_is_hit_from_outside_and_missed_beside() -> None:
    scene = RayScene([mesh_of(trimesh.creation.box((0.2, 0.1, 0.06)))])
    origins = np.array([[0.09, 0.04, 1.0], [0.11, 0.0, 1.0], [-1.0, 0.01, 0.02]])
    hits = scene.cast(origins, np.array([[0, 0, -1.0], [0, 0, -1.0], [1.0, 0, 0]]))
    np.testing.assert_allclose(hits.distance_m, [0.97, np.inf, 0.9], rtol=1e-12)
    assert hits.body.tolist() == [0, -1, 0]
    assert hits.triangle[1] == -1
    normals = scene.normals_at(hits)
    np.testing.assert_allclose(normals[[0, 2]], [[0, 0, 1], [-1, 0, 0]], atol=1e-12)
    assert np.isnan(normals[1]).all()


def test_sphere_distance_is_the_closed_form_within_the_chord_error() -> None:
    radius = 0.05
    ball = trimesh.creation.icosphere(subdivisions=5, radius=radius)
    scene = RayScene([mesh_of(ball)])
    rng = np.random.default_rng(2)
    origins = rng.normal(size=(300, 3))
    aims = rng.uniform(-0.02, 0.02, size=(300, 3))
    directions = aims - origins
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    along = -np.sum(origins * unit, axis=1)
    expected = along - np.sqrt(along**2 - np.sum(origins**2, axis=1) + radius**2)
    hits = scene.cast(origins, directions)
    # A facet of edge e lies at most e^2 / (8 r cos(incidence)) under the sphere: about 10 um.
    np.testing.assert_allclose(hits.distance_m, expected, atol=3e-5)
    assert (hits.distance_m >= expected - 1e-12).all()


def test_nearest_of_several_bodies_is_reported_with_its_own_triangle() -> None:
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    bodies = [mesh_of(ball, (0, 0, 0.3)), mesh_of(box), mesh_of(box, (0.5, 0, 0.2))]
    scene = RayScene(bodies)
    origins = np.array([[0.001, 0.002, 1], [0.5, 0.01, 1], [0.049, 0.049, 1.0]])
    hits = scene.cast(origins, DOWN)
    assert hits.body.tolist() == [0, 2, 1]
    for origin, distance, body, face in zip(
        origins, hits.distance_m, hits.body, hits.triangle, strict=True
    ):
        corners = bodies[body].vertices_m[bodies[body].faces[face]][None]
        point = (origin + distance * DOWN)[None]
        barycentric = trimesh.triangles.points_to_barycentric(corners, point)
        assert (barycentric > -1e-5).all()
        np.testing.assert_allclose(
            trimesh.triangles.barycentric_to_points(corners, barycentric), point, atol=1e-12
        )


@given(st.floats(0.01, 100), st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_distance_is_metres_whatever_the_length_of_the_direction(length: float, seed: int) -> None:
    scene = RayScene([mesh_of(trimesh.creation.box((0.1, 0.1, 0.1)))])
    origins = np.random.default_rng(seed).uniform(-0.04, 0.04, size=(8, 3)) + np.array(
        [0.0, 0.0, 1.0]
    )
    longer = scene.cast(origins, length * DOWN)
    np.testing.assert_allclose(longer.distance_m, origins[:, 2] - 0.05, rtol=1e-12)


def test_no_ray_slips_between_the_triangles_of_a_closed_surface() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    scene = RayScene([mesh_of(ball)])
    targets = np.concatenate([ball.vertices, ball.vertices[ball.edges_unique].mean(axis=1)])
    origins = targets * 10
    hits = scene.cast(origins, -targets)
    np.testing.assert_allclose(
        origins - hits.distance_m[:, None] * targets / np.linalg.norm(targets, axis=1)[:, None],
        targets,
        atol=1e-8,
    )


def test_empty_scene_and_bad_rays_are_refused() -> None:
    with pytest.raises(ValueError, match="at least one triangle"):
        RayScene([])
    scene = RayScene([mesh_of(trimesh.creation.box((1, 1, 1)))])
    with pytest.raises(ValueError, match="finite"):
        scene.cast(np.array([[0, 0, np.nan]]), DOWN)
    with pytest.raises(ValueError, match="finite"):
        scene.cast(np.zeros((1, 3)), np.zeros(3))
    with unchecked(), pytest.raises(ValueError, match=r"\(n, 3\)"):
        scene.cast(np.zeros(3), DOWN)
    assert scene.cast(np.zeros((0, 3)), DOWN).distance_m.shape == (0,)


def test_agrees_with_the_native_trimesh_caster_on_a_scanned_mesh() -> None:
    folder = os.environ.get("MESH_DIR")
    if not folder:
        pytest.skip("MESH_DIR is not set: no scanned meshes")
    scan = trimesh.load(sorted(Path(folder).glob("*.ply"))[0], force="mesh")
    centre = scan.bounds.mean(axis=0)
    rng = np.random.default_rng(3)
    origins = centre + rng.normal(size=(60, 3)) * 0.4
    directions = centre + rng.uniform(-0.02, 0.02, size=(60, 3)) - origins
    hits = RayScene([mesh_of(scan)]).cast(origins, directions)
    native = trimesh.ray.ray_triangle.RayMeshIntersector(scan)
    points, ray, _ = native.intersects_location(origins, directions, multiple_hits=False)
    expected = np.full(60, np.inf)
    expected[ray] = np.linalg.norm(points - origins[ray], axis=1)
    np.testing.assert_allclose(hits.distance_m, expected, rtol=1e-7)


def test_hits_name_bodies_by_their_ids_where_a_scene_has_ids() -> None:
    """The nearer and the farther of two boxes, numbered 7 and 3."""
    near = mesh_of(trimesh.creation.box((0.1, 0.1, 0.1)))
    far = Mesh(near.vertices_m - [0.3, 0.0, 0.0], near.faces)
    scene = RayScene([far, near], [3, 7])
    origins = np.array([[0.0, 0.01, 1.0], [-0.3, 0.01, 1.0], [5.0, 0.0, 1.0]])
    hits = scene.cast(origins, np.array([0.0, 0.0, -1.0]))
    assert hits.body.tolist() == [7, 3, -1]
    np.testing.assert_allclose(scene.normals_at(hits)[:2], [[0, 0, 1], [0, 0, 1]], atol=1e-12)
    for ids in ([1], [1, 1], [-1, 2]):
        with pytest.raises(ValueError, match="distinct ids"):
            RayScene([far, near], ids)
