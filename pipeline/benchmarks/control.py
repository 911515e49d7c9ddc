"""One control step of the local phase: candidates near the aim, their sub clouds, 52 layers."""

import time

import numpy as np

from pipeline.benchmarks import sealing
from pipeline.benchmarks.clock import quantiles_ms
from pipeline.benchmarks.inference import sized_network
from pipeline.config import RunConfig
from pipeline.control.cloud import DepthPicture, merged_cloud
from pipeline.control.local_phase import LocalPhase
from pipeline.control.ranking import NetworkRanking
from pipeline.control.viewpoints import gripper_above
from pipeline.geometry.mesh import Mesh
from pipeline.network.control_inference import ControlPredictor
from pipeline.sensing.depth_by_rays import measure_depth, window_around
from pipeline.simulation.eyes import gripper_from_camera, place_camera
from pipeline.world.cameras import camera_at
from pipeline.world.posed_bodies import PosedBodies
from pipeline.world.scene import ClutterScene

STEPS = 60  # enough for a 95th percentile


def figures(scene: ClutterScene, meshes: dict[str, Mesh], config: RunConfig) -> dict[str, object]:
    """The closed loop's step with the network at its full size, and the referee's seals."""
    _, network = sized_network(config.network, config.sensing.grid_cells)
    found = step_ms(scene, meshes, network, config, STEPS)
    rounded = {
        part: {name: round(value, 2) for name, value in times.items()}
        for part, times in found.items()
    }
    return {
        "control_step_p95_ms": rounded["decision"]["p95"],
        "control_step_ms": rounded["decision"],
        "control_step_with_picture_ms": rounded["with the picture"],
        "control_candidates": config.evaluate.policy.local_candidates,
        "control_layers": config.network.layers,
        **sealing.figures(scene, meshes, config),
    }


def step_ms(
    scene: ClutterScene,
    meshes: dict[str, Mesh],
    network: ControlPredictor,
    config: RunConfig,
    steps: int,
) -> dict[str, dict[str, float]]:
    """p50, p95, p99 of corrections on the way down, with and without making the picture."""
    rng = np.random.default_rng(0)
    surfaces = PosedBodies(
        {p.body_id: meshes[p.object_name] for p in scene.objects}, config.scenes.table_side_m
    ).at({p.body_id: p.world_from_object for p in scene.objects})
    ranking = NetworkRanking(
        network.predict,
        config.sensing,
        config.gripper.pad.radius_m,
        config.evaluate.policy,
    )
    view = scene.views[0]
    policy = config.evaluate.policy
    picture = DepthPicture(view.depth_m, view.camera)
    aims = merged_cloud([picture], policy.voxel_m, policy.above_table_m).points_m
    on_wrist = camera_at("wrist", config.cameras.wrist, np.zeros(3), 1.0, 0.0, 0.0)
    step_m = config.evaluate.policy.speed_m_s / config.evaluate.policy.rate_hz
    seen: list[float] = []
    decided: list[float] = []
    while len(decided) < steps:
        aim = np.eye(4)
        aim[:3, 3] = aims[rng.integers(len(aims))]
        local = LocalPhase(ranking, config.evaluate, config.grasps.normal_radius_m, rng)
        # All the way down, as far as the camera sees.
        for height_m in np.arange(config.evaluate.policy.standoff_m, 0.11, -step_m):
            pose = gripper_above(aim[:3, 3], height_m, np.eye(4))
            camera = place_camera(on_wrist, pose @ gripper_from_camera(config.evaluate.hand))
            times: list[float] = [time.perf_counter()]
            window = window_around(camera, aim[:3, 3], config.evaluate.policy.look_m)
            depth_m, _ = measure_depth(window, surfaces, None, rng)
            picture = DepthPicture(depth_m, window)
            times.append(time.perf_counter())
            found = local.look(picture, aim, config.evaluate.policy.correction_gain)
            local.advance_aim(aim)
            if found is None:
                break  # too steep a place: no network was asked
            times.append(time.perf_counter())
            decided.append(times[2] - times[1])
            seen.append(times[2] - times[0])
    return {"decision": quantiles_ms(decided), "with the picture": quantiles_ms(seen)}
