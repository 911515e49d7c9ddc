"""Grasps are tried where the camera measures: neither nearer than its sensor can, nor farther."""

import numpy as np
import pytest

from pipeline.config import RunConfig
from pipeline.errors import SceneError
from pipeline.geometry.transforms import invert, transform_points
from pipeline.labelling.scene import label_scene
from tests.labelling.ball import scene_of_a_ball

CONFIG = RunConfig.model_validate({"grasps": {"merged_share": 0.0, "oversampling": 1.0}})
RADIUS_M = CONFIG.gripper.pad.radius_m


def contact_depths_m(near_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Depth of each contact of a scene [m], and how many cells of its cloud hold a point."""
    scene, surfaces = scene_of_a_ball("test", near_m)
    ((_, grasps),) = label_scene(scene, surfaces, CONFIG, 60, np.random.default_rng(0))
    frames = grasps.world_from_gripper
    contacts = frames[:, :3, 3] - grasps.touch_height_m[:, None] * frames[:, :3, 2]
    (view,) = scene.views
    depths_m = transform_points(invert(view.camera.world_from_camera), contacts)[:, 2]
    return depths_m, np.count_nonzero(grasps.cloud_mask, axis=(1, 2))


def test_no_grasp_is_tried_nearer_than_the_camera_measures() -> None:
    depths_m, _ = contact_depths_m(near_m=0.25)
    near_m = float(np.median(depths_m)) - RADIUS_M
    kept_m, seen = contact_depths_m(near_m)
    assert depths_m.min() < near_m + RADIUS_M  # so some were left out
    assert kept_m.min() >= near_m + RADIUS_M - 1e-9
    assert seen.min() > 100


def test_a_scene_that_is_too_near_for_every_camera_is_refused() -> None:
    scene, surfaces = scene_of_a_ball("test", near_m=0.7)
    with pytest.raises(SceneError, match="neither nearer nor farther than it measures"):
        label_scene(scene, surfaces, CONFIG, 60, np.random.default_rng(0))
