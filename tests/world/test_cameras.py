"""Pixels to points and back, the compiled twin of rays, and the camera of a thinned picture."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.config.cameras import StaticCameraConfig, WristCameraConfig
from pipeline.geometry.transforms import invert, look_at, transform_points
from pipeline.world.cameras import (
    PinholeCamera,
    camera_at,
    in_picture,
    picture_rays,
    pixel_rays,
    points_of_depth,
    project,
    project_local,
    shown_whole,
    thinned,
)
from pipeline.world.scene_cameras import static_cameras

SEEDS = st.integers(0, 2**32 - 1)


def some_camera(rng: np.random.Generator, width_px: int = 37, height_px: int = 23) -> PinholeCamera:
    """Unequal focal lengths and a centre off the middle, somewhere over the table."""
    intrinsics = np.diag([*rng.uniform(20, 40, 2), 1.0])
    intrinsics[:2, 2] = rng.uniform(5, 20, 2)
    eye = rng.uniform([-1.0, -1.0, 1.0], [1.0, 1.0, 3.0])
    return replace(
        camera_at("c", WristCameraConfig(), np.zeros(3), 1.0, 0.5, 0.0),
        width_px=width_px,
        height_px=height_px,
        intrinsics=intrinsics,
        world_from_camera=look_at(eye, rng.uniform(-0.1, 0.1, 3)),
    )


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_a_point_of_a_pixel_projects_to_its_centre_at_its_depth(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = some_camera(rng)
    depth = rng.uniform(0.2, 3.0, (23, 37))
    depth[rng.random(depth.shape) < 0.3] = rng.choice([0.0, np.nan, np.inf, -1.0])
    points, rows, columns = points_of_depth(depth, camera, every=1)
    assert set(zip(rows, columns, strict=True)) == {
        (i, j) for i, j in np.ndindex(depth.shape) if 0 < depth[i, j] < np.inf
    }
    pixels, found = project(camera, points)
    np.testing.assert_allclose(pixels, np.stack([columns, rows], axis=1) + 0.5, atol=1e-9)
    np.testing.assert_allclose(found, depth[rows, columns], atol=1e-12)
    assert in_picture(camera, pixels).all()


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_points_of_depth_is_its_formula_by_the_inverse_matrix(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = some_camera(rng)
    depth = rng.uniform(0.2, 3.0, (23, 37))
    points, rows, columns = points_of_depth(depth, camera, every=3, above_m=0.1)
    pixel = np.stack(np.meshgrid(np.arange(0, 37, 3), np.arange(0, 23, 3)), axis=-1).reshape(-1, 2)
    homogeneous = np.column_stack([pixel + 0.5, np.ones(len(pixel))])
    local = homogeneous @ np.linalg.inv(camera.intrinsics).T * depth[pixel[:, 1], pixel[:, 0], None]
    expected = transform_points(camera.world_from_camera, local)
    high = expected[:, 2] > 0.1
    np.testing.assert_allclose(points, expected[high], atol=1e-12)
    np.testing.assert_array_equal(np.stack([columns, rows], axis=1), pixel[high])


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_rays_of_the_whole_picture_are_those_of_its_pixels(seed: int) -> None:
    """The plain function is the oracle of the compiled one."""
    camera = some_camera(np.random.default_rng(seed))
    _, expected = pixel_rays(camera, np.ones((23, 37), dtype=bool))
    np.testing.assert_allclose(picture_rays(camera), expected, atol=1e-14)


def test_what_is_behind_or_beside_the_camera_has_no_pixel() -> None:
    camera = some_camera(np.random.default_rng(1))
    local = np.array([[0.1, 0.1, -1.0], [0.1, 0.1, 0.0], [100.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
    pixels = project_local(camera.intrinsics, local)
    assert np.isnan(pixels[:2]).all()
    assert np.isfinite(pixels[2:]).all()
    assert in_picture(camera, pixels).tolist() == [False, False, False, True]


def test_the_edges_of_the_picture_are_its_first_pixels_not_those_after_its_last() -> None:
    camera = some_camera(np.random.default_rng(2))
    pixels = np.array([[0.0, 0.0], [36.999, 22.999], [37.0, 5.0], [5.0, 23.0], [-1e-9, 5.0]])
    assert in_picture(camera, pixels).tolist() == [True, True, False, False, False]


@settings(max_examples=10, deadline=None)
@given(SEEDS, st.integers(1, 5))
def test_a_thinned_picture_shows_the_same_points(seed: int, every: int) -> None:
    rng = np.random.default_rng(seed)
    camera = some_camera(rng)
    depth = rng.uniform(0.2, 3.0, (23, 37))
    small = thinned(camera, every)
    assert (small.height_px, small.width_px) == depth[::every, ::every].shape
    expected, _, _ = points_of_depth(depth, camera, every)
    points, _, _ = points_of_depth(depth[::every, ::every], small, every=1)
    np.testing.assert_allclose(points, expected, atol=1e-12)


def test_pose_and_intrinsics_cannot_be_written_to() -> None:
    camera = some_camera(np.random.default_rng(0))
    for array in (camera.intrinsics, camera.world_from_camera):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 2.0


@pytest.mark.parametrize(("near_m", "far_m"), [(0.5, 4.5), (0.85, 4.5), (0.5, 0.9)])
def test_shown_whole_is_a_ball_whose_every_point_is_measured(near_m: float, far_m: float) -> None:
    """Against the picture's own projection of points all over each ball, and their depths."""
    rng = np.random.default_rng(3)
    centres, radius = rng.uniform(-0.7, 0.7, (400, 3)) * [1, 1, 0.2], 0.04
    shell = rng.normal(size=(3000, 3))
    shell *= radius / np.linalg.norm(shell, axis=1, keepdims=True)
    (camera,) = static_cameras(StaticCameraConfig())
    camera = replace(camera, near_m=near_m, far_m=far_m)
    world = centres[:, None] + shell
    local = transform_points(invert(camera.world_from_camera), world.reshape(-1, 3))
    pixels = local @ camera.intrinsics.T
    column, row = (pixels[:, i] / pixels[:, 2] for i in (0, 1))
    inside = (column >= 0) & (column <= camera.width_px) & (row >= 0) & (row <= camera.height_px)
    inside &= (local[:, 2] >= near_m) & (local[:, 2] <= far_m)
    whole = inside.reshape(len(centres), -1).all(axis=1)
    found = shown_whole(camera, centres, radius)
    assert 0.1 < whole.mean() < 0.9
    assert not (found & ~whole).any()
    # 3000 points do not touch a face that cuts less than a hair off the ball.
    assert (shown_whole(camera, centres, 0.97 * radius) >= whole).all()
