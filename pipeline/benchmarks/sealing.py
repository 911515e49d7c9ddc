"""What the referee takes for one seal: surface under the pad by rays, contact, leak and pump."""

import time

import numpy as np
from jaxtyping import Float

from pipeline.benchmarks.clock import quantiles_ms
from pipeline.config import RunConfig
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import frame_from_z
from pipeline.referee.judging import placed, sealed
from pipeline.world.scene import ClutterScene

SEALS = 300  # enough for a 95th percentile


def figures(scene: ClutterScene, meshes: dict[str, Mesh], config: RunConfig) -> dict[str, object]:
    """Processor time of seals, one after the other, at points drawn over the objects.

    Parameters
    ----------
    scene
        Where the objects lie.
    meshes
        Name → mesh of the object.
    config
        Sections referee, gripper, scenes and grasps.

    Returns
    -------
    Quantiles [ms] by their name in bench.json.
    """
    there = placed(
        [meshes[one.object_name] for one in scene.objects],
        [one.world_from_object for one in scene.objects],
        config.scenes.table_side_m,
        config.grasps.clearance_m,
    )
    rng, radius_m, took_s = np.random.default_rng(0), config.gripper.pad.radius_m, []
    for _ in range(SEALS + 1):
        body = int(rng.integers(len(scene.objects)))
        one = scene.objects[body]
        pose = one.world_from_object @ pose_on(meshes[one.object_name], rng)
        started = time.process_time()
        sealed(config.referee, radius_m, there, pose, body)
        took_s.append(time.process_time() - started)
    return {"referee_seal_ms": quantiles_ms(took_s[1:])}  # the first one compiles


def pose_on(mesh: Mesh, rng: np.random.Generator) -> Float[np.ndarray, "4 4"]:
    """A pad on the middle of a face drawn by area, +z along the normal; object_from_gripper."""
    corners = mesh.vertices_m[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    face = rng.choice(len(areas), p=areas / areas.sum())
    return frame_from_z(corners[face].mean(axis=0), normals[face])
