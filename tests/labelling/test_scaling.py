"""A scene, its cameras and their noise enlarged with the gripper: same q, same network input."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from pipeline.config import RunConfig
from pipeline.geometry.transforms import frame_from_z, look_at
from pipeline.labelling.grasps import LabelledGrasps
from pipeline.labelling.scene import label_scene, scene_surfaces
from pipeline.network.canonical import network_input
from pipeline.network.input_channels import CHANNELS
from pipeline.world.cameras import PinholeCamera, pixel_rays
from pipeline.world.posed_bodies import TABLE
from pipeline.world.scene import ClutterScene, PlacedObject
from pipeline.world.view import CameraView
from tests.bodies import mesh_of

TIMES = 3.0
R_G_M = 0.025
SHAPES = {
    "ball": trimesh.creation.icosphere(subdivisions=3, radius=0.045),
    "box": trimesh.creation.box(extents=(0.09, 0.07, 0.05)),
}
PLACES = {"ball": (0.05, 0.04, 0.045), "box": (-0.05, -0.03, 0.025)}
WIDTH_PX, HEIGHT_PX = 256, 192


def labelled(times: float) -> LabelledGrasps:
    """Grasps of a ball and a box, everything so many times as large."""
    config = RunConfig.model_validate(
        {
            "gripper": {"pad": {"radius_m": R_G_M * times}},
            "sensing": {"disturbed": False},
            "grasps": {"merged_share": 0.0},
        }
    )
    meshes = {name: mesh_of(shape.copy().apply_scale(times)) for name, shape in SHAPES.items()}
    placed = tuple(
        PlacedObject(
            name, number, frame_from_z(times * np.array(PLACES[name]), np.array([0, 0, 1.0]))
        )
        for number, name in enumerate(SHAPES, start=1)
    )
    scene = ClutterScene("scaled", 1, "train", 0, placed, np.full(2, np.inf), (), 0.0, ())
    surfaces = scene_surfaces(scene, meshes, config.scenes.table_side_m)
    k = np.array([[260.0, 0, WIDTH_PX / 2], [0, 260.0, HEIGHT_PX / 2], [0, 0, 1.0]])
    pose = look_at(times * np.array([0.05, -0.1, 0.5]), np.zeros(3))
    camera = PinholeCamera("one", WIDTH_PX, HEIGHT_PX, k, pose, "ideal", 0.0, np.inf)
    origin, rays = pixel_rays(camera, np.ones((HEIGHT_PX, WIDTH_PX), dtype=bool))
    hits = surfaces.cast(np.broadcast_to(origin, rays.shape), rays)
    depth_m = (hits.distance_m * (rays @ pose[:3, 2])).reshape(HEIGHT_PX, WIDTH_PX)
    noise = np.random.default_rng(7).normal(0.0, 0.002 * times, depth_m.shape)
    body = np.maximum(hits.body, TABLE).reshape(HEIGHT_PX, WIDTH_PX).astype(np.uint16)
    empty = np.zeros((HEIGHT_PX, WIDTH_PX, 3), dtype=np.uint8)
    view = CameraView(camera, depth_m + noise, empty, body, empty)
    seen = replace(scene, views=(view,))
    ((_, grasps),) = label_scene(seen, surfaces, config, 60, np.random.default_rng(0))
    return grasps


def test_a_scene_three_times_as_large_is_the_same_to_a_gripper_three_times_as_large() -> None:
    small, large = labelled(1.0), labelled(TIMES)
    places = small.world_from_gripper[:, :3, 3]
    np.testing.assert_allclose(
        large.world_from_gripper[:, :3, 3], TIMES * places, atol=1e-6, rtol=1e-6
    )
    assert np.ptp(small.quality) > 0.5
    np.testing.assert_allclose(large.quality, small.quality, atol=1e-4)
    # A point at a cell's border may fall on either side of it, by the last bit.
    same = (large.cloud_mask == small.cloud_mask).mean()
    assert same > 0.999
    both = large.cloud_mask & small.cloud_mask
    differs = np.abs(large.cloud[both] - small.cloud[both]).max(axis=1) > 1e-3
    assert differs.mean() < 0.002


def test_the_networks_input_is_the_same() -> None:
    torch = pytest.importorskip("torch")
    inputs = [
        network_input(torch.from_numpy(g.cloud), torch.from_numpy(g.cloud_mask), CHANNELS).numpy()
        for g in (labelled(1.0), labelled(TIMES))
    ]
    assert (np.abs(inputs[0] - inputs[1]) > 1e-2).mean() < 0.005
