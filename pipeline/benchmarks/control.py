"""One control step: candidates near the aim, their sub clouds, and 52 layers' verdict."""

import time

import numpy as np
from jaxtyping import Float

from pipeline.benchmarks.clock import quantiles_ms
from pipeline.clutter.scene import ClutterScene
from pipeline.config import RunConfig
from pipeline.control.candidates import above_table, sample_near
from pipeline.network.export import OnnxPredictor
from pipeline.sensing.cameras import points_of_depth
from pipeline.sensing.sub_cloud import sub_clouds

SCORE_BATCH = 64
_CLOUD_EVERY = 2


def step_ms(
    scene: ClutterScene,
    depth_m: Float[np.ndarray, "h w"],
    network: OnnxPredictor,
    config: RunConfig,
    steps: int,
) -> dict[str, float]:
    """p50, p95, p99 of a correction on the way down, rendering aside."""
    camera = scene.views[0].camera
    rng = np.random.default_rng(0)
    radius_m = config.gripper.pad.radius_m
    aims = above_table(points_of_depth(depth_m, camera, _CLOUD_EVERY)[0])
    times = []
    for _ in range(steps):
        aim = aims[rng.integers(len(aims))]
        started = time.perf_counter()
        points = above_table(points_of_depth(depth_m, camera, _CLOUD_EVERY)[0])
        near = sample_near(
            points,
            aim,
            camera.world_from_camera[:3, 3],
            config.grasps.normal_radius_m,
            config.evaluate.policy,
            rng,
        )
        if len(near):
            cloud, mask = sub_clouds(depth_m, camera, near, config.sensing, radius_m)
            network.predict(cloud, mask, SCORE_BATCH)
        times.append(time.perf_counter() - started)
    return quantiles_ms(times)
