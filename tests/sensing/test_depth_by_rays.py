"""The closed loop's camera: planes of known depth, windows cut from the whole picture."""

from dataclasses import replace

import numpy as np
import trimesh

from pipeline.config.cameras import WristCameraConfig
from pipeline.geometry.mesh import Mesh
from pipeline.sensing.depth_by_rays import measure_depth, window_around
from pipeline.world.cameras import PinholeCamera, camera_at
from pipeline.world.posed_bodies import PosedBodies, PosedScene


def box_on_table() -> PosedScene:
    shape = trimesh.creation.box((0.1, 0.1, 0.1))
    pose = np.eye(4)
    pose[2, 3] = 0.05
    return PosedBodies({1: Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))}, 1.2).at(
        {1: pose}
    )


def from_above() -> PinholeCamera:
    camera = camera_at("above", WristCameraConfig(), np.zeros(3), 0.6, np.pi / 2 - 1e-6, 0.0)
    return replace(camera, width_px=160, height_px=120, intrinsics=camera.intrinsics / 4)


def test_depth_of_a_box_and_the_table() -> None:
    camera = from_above()
    depth, _ = measure_depth(camera, box_on_table(), None, None)
    np.testing.assert_allclose(depth[60, 80], 0.5, atol=1e-5)
    np.testing.assert_allclose(depth[5, 5], 0.6, atol=1e-4)


def test_a_window_shows_what_the_picture_shows_there() -> None:
    camera, scene = from_above(), box_on_table()
    whole, _ = measure_depth(camera, scene, None, None)
    window = window_around(camera, np.array([0.04, 0.02, 0.1]), 0.03)
    part, _ = measure_depth(window, scene, None, None)
    left, top = (camera.intrinsics - window.intrinsics)[:2, 2].round().astype(int)
    assert part.size < 0.2 * whole.size
    np.testing.assert_allclose(
        part, whole[top : top + part.shape[0], left : left + part.shape[1]], atol=1e-6
    )


def test_behind_a_transparent_box_the_table_is_measured() -> None:
    camera = replace(from_above(), sensor="ideal")
    nothing = PosedBodies({}, 1.2).at({})
    rng = np.random.default_rng(0)
    depth, _ = measure_depth(camera, box_on_table(), nothing, rng)
    np.testing.assert_allclose(depth[60, 80], 0.6, atol=1e-4)
