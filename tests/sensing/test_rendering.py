"""Depth is metric, normals are those of the surface, and both renderers agree."""

import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from pipeline.config import CamerasConfig, ScenesConfig
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.sensing.ray_rendering import RayRenderer
from pipeline.sensing.rendering import Renderer, new_renderer, render_views
from pipeline.world.cameras import points_of_depth
from pipeline.world.scene_cameras import camera_names, scene_cameras
from pipeline.world.view import CameraView, normals_of
from tests.sensing.scenes import CAMERAS, CUBE_AND_BALL


@pytest.mark.parametrize("renderer", ["embree", "sapien"])
def test_depth_puts_every_pixel_on_its_surface(
    renderer: str, view: CameraView, request: pytest.FixtureRequest
) -> None:
    """Plane, box and sphere as formulas; every pixel of Embree's, 99.9 % inside of SAPIEN's."""
    if renderer == "sapien":
        driver: Renderer = request.getfixturevalue("sapien_renderer")
        objects = request.getfixturevalue("objects")
        view = render_views(CUBE_AND_BALL, objects, CAMERAS, driver).views[0]
        inner = interior(view)
        view = replace(view, depth_m=np.where(inner, view.depth_m, 0.0))
    points, rows, columns = points_of_depth(view.depth_m, view.camera, 1)
    body = view.segmentation[rows, columns]
    assert (body == 0).any()
    np.testing.assert_allclose(points[body == 0, 2], 0.0, atol=1e-4)
    outside_cube = np.abs(points[body == 1] - [-0.1, 0, 0.05]).max(axis=1) - 0.05
    np.testing.assert_allclose(outside_cube, 0.0, atol=1e-4)
    radius = np.linalg.norm(points[body == 2] - [0.1, 0, 0.05], axis=1)
    np.testing.assert_allclose(radius, 0.05, atol=1e-4)


def interior(view: CameraView) -> np.ndarray:
    """Pixels whose eight neighbours lie on the same body, with no step in depth."""
    high = ndimage.maximum_filter(view.depth_m, 3) - ndimage.minimum_filter(view.depth_m, 3)
    one = ndimage.maximum_filter(view.segmentation, 3) == ndimage.minimum_filter(
        view.segmentation, 3
    )
    return np.asarray(one & (high < 0.02) & (view.depth_m > 0))


def test_sapien_and_rays_agree(
    sapien_renderer: Renderer, objects: Mapping[str, CatalogueObject]
) -> None:
    """On depth, segmentation and normals, from the static camera and from both wrist's."""
    cameras = scene_cameras(
        CamerasConfig(), np.array([[-0.1, 0, 0.05], [0.1, 0, 0.05]]), np.random.default_rng(2)
    )
    assert [camera.name for camera in cameras] == ["static_0", "wrist_0", "wrist_1"]
    assert camera_names(CamerasConfig()) == [camera.name for camera in cameras]
    by_rays = render_views(CUBE_AND_BALL, objects, cameras, RayRenderer(ScenesConfig())).views
    by_sapien = render_views(CUBE_AND_BALL, objects, cameras, sapien_renderer).views
    again = render_views(CUBE_AND_BALL, objects, cameras, sapien_renderer).views
    for one, two, rays in zip(by_sapien, again, by_rays, strict=True):
        assert one.depth_m.tobytes() == two.depth_m.tobytes()
        assert one.colour.tobytes() == two.colour.tobytes()
        # Lit: no pixel of the ball or the table is black.
        assert one.colour.max(axis=2)[one.depth_m > 0].min() > 20
        inner = interior(rays)
        assert inner.sum() > 0.98 * (rays.depth_m > 0).sum()
        assert (one.segmentation == rays.segmentation)[inner].mean() > 0.999
        assert (np.abs(one.depth_m - rays.depth_m)[inner] < 1e-4).mean() > 0.999
        cosine = (normals_of(one) * normals_of(rays)).sum(axis=2)[inner]
        assert (cosine > np.cos(np.radians(2.0))).mean() > 0.999


def test_normals_are_those_of_the_surface(view: CameraView) -> None:
    points, rows, columns = points_of_depth(view.depth_m, view.camera, 1)
    in_world = normals_of(view)[rows, columns] @ view.camera.world_from_camera[:3, :3].T
    body = view.segmentation[rows, columns]
    np.testing.assert_allclose(
        in_world[body == 0], [[0.0, 0.0, 1.0]] * (body == 0).sum(), atol=0.01
    )
    outward = (points[body == 2] - [0.1, 0, 0.05]) / 0.05
    assert ((in_world[body == 2] * outward).sum(axis=1) > np.cos(np.radians(1.5))).mean() > 0.99


def test_the_renderer_asked_for_is_the_one(sapien_renderer: Renderer) -> None:
    assert new_renderer("embree", ScenesConfig()).name == "embree"
    assert new_renderer("auto", ScenesConfig()).name == sapien_renderer.name == "sapien"


def test_pictures_are_lit_where_convex_parts_are_computed_too() -> None:
    """CoACD and SAPIEN share a process; the order in which they load must not turn it dark."""
    script = (
        "import coacd\n"
        "from pipeline.config import ScenesConfig, StaticCameraConfig\n"
        "from pipeline.errors import MachineError\n"
        "from pipeline.world.scene_cameras import static_cameras\n"
        "from pipeline.sensing.sapien_rendering import render_table\n"
        "try:\n"
        "    render_table(ScenesConfig(), static_cameras(StaticCameraConfig())[0])\n"
        "except MachineError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert "coacd" in done.stdout
