"""Pictures drawn triangle by triangle show what rays through the pixels hit."""

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import look_at
from pipeline.world.cameras import PinholeCamera, pixel_rays
from pipeline.world.drawn_pixels import first_faces
from pipeline.world.raycasting import RayHits, RayScene
from pipeline.world.table import table_mesh
from tests.world.test_posed_bodies import some_pose

SEEDS = st.integers(0, 2**32 - 1)
EYE = np.array([0.5, -0.4, 0.7])


def camera(eye_m: np.ndarray = EYE, target_m: tuple[float, ...] = (0, 0, 0.1)) -> PinholeCamera:
    intrinsics = np.array([[90.0, 0, 40.3], [0, 95.0, 29.8], [0, 0, 1]])
    pose = look_at(eye_m, np.asarray(target_m, dtype=float))
    return PinholeCamera("c", 80, 60, intrinsics, pose, "ideal", 0.1, 3.0)


def both_ways(scene: RayScene, of: PinholeCamera, shown: np.ndarray) -> tuple[RayHits, RayHits]:
    origin, rays = pixel_rays(of, shown)
    return scene.first_seen(of, shown, rays), scene.cast(np.tile(origin, (len(rays), 1)), rays)


def assert_same_picture(scene: RayScene, of: PinholeCamera, shown: np.ndarray) -> None:
    drawn, cast = both_ways(scene, of, shown)
    same = (drawn.body == cast.body) & (drawn.triangle == cast.triangle)
    np.testing.assert_array_equal(drawn.distance_m[same], cast.distance_m[same])
    # Embree works in single precision: at an edge it may name the neighbour, at an outline what
    # lies behind it.
    assert same.mean() > 0.995
    edge = ~same & (drawn.body == cast.body)
    np.testing.assert_allclose(drawn.distance_m[edge], cast.distance_m[edge], atol=1e-5)


@settings(max_examples=30, deadline=None)
@given(SEEDS)
def test_a_clutter_is_drawn_as_rays_see_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shapes = [
        trimesh.creation.icosphere(3, 0.08),
        trimesh.creation.box((0.1, 0.2, 0.05)),
        trimesh.creation.torus(0.06, 0.02),
    ]
    bodies = [
        Mesh(np.asarray(s.vertices), np.asarray(s.faces)).transformed(some_pose(rng))
        for s in shapes
    ]
    scene = RayScene([*bodies, table_mesh(1.2)], [3, 5, 1, 0])
    assert_same_picture(scene, camera(), rng.random((60, 80)) < 0.8)


def test_no_pixel_falls_between_triangles_whose_corners_and_sides_it_meets() -> None:
    of = camera()
    _, rays = pixel_rays(of, np.ones((60, 80), bool))
    # A bumpy sheet with a corner on the ray of every second pixel; the others lie on its sides.
    far = np.random.default_rng(3).uniform(0.6, 0.9, (30, 40))
    corners = EYE + rays.reshape(60, 80, 3)[::2, ::2] * far[..., None]
    index = np.arange(30 * 40).reshape(30, 40)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack(f, -1).reshape(-1, 3) for f in ((a, b, c), (c, d, a))])
    shown = np.zeros((60, 80), bool)
    shown[1:58, 1:78] = True
    hits = RayScene([Mesh(corners.reshape(-1, 3), faces)]).first_seen(
        of, shown, pixel_rays(of, shown)[1]
    )
    assert (hits.body == 0).all()
    at_corner = np.zeros((60, 80), bool)
    at_corner[::2, ::2] = True
    expected = far[1:29, 1:39].ravel()
    np.testing.assert_allclose(hits.distance_m[at_corner[shown]], expected, rtol=1e-9)


def test_a_floor_that_reaches_behind_the_camera_is_seen_as_far_as_it_goes() -> None:
    of = camera(np.array([0.0, 0.0, 0.5]), (1.0, 0.0, 0.2))
    scene, shown = RayScene([table_mesh(20.0)]), np.ones((60, 80), bool)
    drawn, _ = both_ways(scene, of, shown)
    _, rays = pixel_rays(of, shown)
    down = rays[:, 2] < -0.06  # it ends ten metres ahead
    np.testing.assert_allclose(drawn.distance_m[down], -0.5 / rays[down, 2], rtol=1e-12)
    assert (drawn.body[rays[:, 2] >= 0] == -1).all()
    assert_same_picture(scene, of, shown)


def test_what_lies_behind_the_camera_is_not_seen() -> None:
    of, shown = camera(), np.ones((60, 80), bool)
    behind = trimesh.creation.icosphere(2, 0.1)
    behind.apply_translation(2 * EYE)
    corners, faces = np.asarray(behind.vertices), np.asarray(behind.faces)
    assert (first_faces(corners, faces, of, shown, pixel_rays(of, shown)[1]) == -1).all()


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_the_order_of_faces_moves_no_surface(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape, of, shown = trimesh.creation.torus(0.2, 0.08), camera(), np.ones((60, 80), bool)
    corners, faces = np.asarray(shape.vertices), np.asarray(shape.faces)
    order = rng.permutation(len(faces))
    rays = pixel_rays(of, shown)[1]
    one = RayScene([Mesh(corners, faces)]).first_seen(of, shown, rays)
    other = RayScene([Mesh(corners, faces[order])]).first_seen(of, shown, rays)
    np.testing.assert_allclose(one.distance_m, other.distance_m, rtol=1e-9)
    again = np.where(other.triangle >= 0, order[other.triangle], -1)
    assert (again == one.triangle).mean() > 0.999


def test_a_picture_that_shows_nothing_has_no_hits() -> None:
    of, nothing = camera(), np.zeros((60, 80), bool)
    hits = RayScene([table_mesh(1.0)]).first_seen(of, nothing, np.empty((0, 3)))
    assert len(hits.distance_m) == 0


def test_scans_are_drawn_as_rays_see_them() -> None:
    folder = os.environ.get("MESH_DIR")
    if not folder:
        pytest.skip("MESH_DIR is not set: no scanned meshes")
    for number, file in enumerate(sorted(Path(folder).glob("*.ply"))[:6]):
        scan = trimesh.load(file, force="mesh")
        corners = np.asarray(scan.vertices) - scan.bounds.mean(axis=0)
        corners *= 0.3 / np.ptp(corners, axis=0).max()
        scene = RayScene([Mesh(corners, np.asarray(scan.faces)), table_mesh(1.2)], [1, 0])
        turned = camera(np.array([np.cos(number), np.sin(number), 0.8]))
        assert_same_picture(scene, turned, np.ones((60, 80), bool))
