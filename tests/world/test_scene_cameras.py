"""Where the cameras of a scene stand and what they look at."""

import numpy as np

from pipeline.config import WristCameraConfig
from pipeline.world.scene_cameras import wrist_cameras


def test_the_wrist_looks_at_an_object_from_its_distance() -> None:
    config = WristCameraConfig(viewpoints=5)
    centres = np.array([[0.1, 0.2, 0.03], [-0.2, 0.0, 0.05]])
    cameras = wrist_cameras(config, centres, np.random.default_rng(4))
    again = wrist_cameras(config, centres, np.random.default_rng(4))
    looked_at = []
    for camera, same in zip(cameras, again, strict=True):
        np.testing.assert_array_equal(camera.world_from_camera, same.world_from_camera)
        at_m = camera.world_from_camera @ [0.0, 0.0, config.distance_m, 1.0]
        looked_at.append(int(np.argmin(np.linalg.norm(centres - at_m[:3], axis=1))))
        np.testing.assert_allclose(at_m[:3], centres[looked_at[-1]], atol=1e-9)
        height = camera.world_from_camera[2, 3] - at_m[2]
        elevation = np.arcsin(height / config.distance_m)
        assert config.elevation_min_rad <= elevation <= config.elevation_max_rad
    assert sorted(looked_at) in ([0, 0, 0, 1, 1], [0, 0, 1, 1, 1])
    assert wrist_cameras(config, np.empty((0, 3)), np.random.default_rng(4)) == ()
