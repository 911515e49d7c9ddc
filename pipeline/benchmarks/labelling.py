"""Grasps a second, by phase and by mesh size: S-1.07 - S-1.12 as production runs them."""

import time

import numpy as np
import trimesh
from jaxtyping import Float, Int

from pipeline.benchmarks.clock import Laps, quantiles_ms
from pipeline.config.grasps import GripperConfig
from pipeline.geometry.mesh import Mesh
from pipeline.gripper.batch import BLOCK, assemble_into, empty_batch, label_batch
from pipeline.gripper.draping import drape_into
from pipeline.gripper.limits import wrench_limit_ratios
from pipeline.gripper.pad import Pad
from pipeline.gripper.quality import target_wrench
from pipeline.gripper.solvers.structured import solve_into
from pipeline.labelling.heights import pad_heights
from pipeline.labelling.sampling import contact_frames
from pipeline.world.raycasting import RayScene

ROUND = 512
_BUMPS = 8


def phase_seconds(
    pad: Pad,
    config: GripperConfig,
    rays: RayScene,
    world_from_contact: Float[np.ndarray, "n 4 4"],
    body: Int[np.ndarray, " n"],
    clearance_m: float,
) -> dict[str, float]:
    """Seconds that rays, draping, wrench and QP take on these grasps, block by block.

    body : index of each grasp's own body in ``rays``.
    """
    laps = Laps()
    lower, upper = wrench_limit_ratios(config.friction)
    vertices, triangles = len(pad.vertices_xy_m), len(pad.triangles)
    draped = np.empty((BLOCK, vertices))
    matrices = np.empty((BLOCK, 4, triangles))
    weights = np.empty((BLOCK, triangles))
    counts, forces = np.empty(BLOCK, dtype=np.int64), np.empty(BLOCK)
    batch = empty_batch(BLOCK, vertices)
    for first in range(0, len(world_from_contact), ROUND):
        laps.start()
        heights, below = pad_heights(
            world_from_contact[first : first + ROUND], rays, pad, clearance_m
        )
        on_target = below == body[first : first + ROUND, None]
        laps.lap("rays")
        for start in range(0, len(heights) - BLOCK + 1, BLOCK):
            part = slice(start, start + BLOCK)
            laps.start()
            drape_into(
                heights[part],
                pad.edges,
                pad.config.distance_step_m,
                pad.config.altitude_m,
                draped,
            )
            laps.lap("draping")
            assemble_into(
                heights[part],
                on_target[part],
                draped,
                pad.vertices_xy_m,
                pad.triangles,
                pad.areas_m2,
                pad.in_seal_region,
                pad.seal_area_m2,
                pad.area_m2,
                pad.radius_m,
                pad.config.contact_tolerance_m,
                config.friction,
                batch.contact,
                batch.touch_height_m,
                batch.pressure,
                matrices,
                counts,
                forces,
            )
            laps.lap("wrench")
            solve_into(
                matrices,
                counts,
                forces,
                lower,
                upper,
                target_wrench(),
                config.quality_scale,
                config.weight_spread,
                config.max_iterations,
                weights,
                batch.status,
                batch.iterations,
            )
            laps.lap("QP")
    return dict(laps.seconds)


def latency_ms(
    pad: Pad,
    config: GripperConfig,
    rays: RayScene,
    world_from_contact: Float[np.ndarray, "n 4 4"],
    body: Int[np.ndarray, " n"],
    clearance_m: float,
) -> dict[str, float]:
    """p50, p95, p99 of one grasp labelled alone, rays included."""
    times = []
    for row in range(len(world_from_contact)):
        started = time.perf_counter()
        heights, below = pad_heights(world_from_contact[row : row + 1], rays, pad, clearance_m)
        label_batch(pad, config, heights, below == body[row])
        times.append(time.perf_counter() - started)
    return quantiles_ms(times)


def by_mesh_size(
    pad: Pad, config: GripperConfig, grasps: int, clearance_m: float
) -> dict[int, float]:
    """Faces → grasps a second on one core, rays included, on a bumpy ball of 50 mm radius."""
    rates = {}
    for subdivisions in (3, 4, 5, 6, 7):
        ball = trimesh.creation.icosphere(subdivisions=subdivisions)
        mesh = bumpy(ball)
        rays = RayScene([mesh])
        rng = np.random.default_rng(0)
        chosen = rng.integers(len(mesh.vertices_m), size=grasps)
        frames = contact_frames(
            mesh.vertices_m[chosen], ball.vertices[chosen], rng.uniform(0, 2 * np.pi, grasps)
        )
        rays.cast(frames[:1, :3, 3] + frames[:1, :3, 2], -frames[:1, :3, 2])
        started = time.perf_counter()
        for first in range(0, grasps, ROUND):
            heights, below = pad_heights(frames[first : first + ROUND], rays, pad, clearance_m)
            label_batch(pad, config, heights, below == 0)
        rates[len(mesh.faces)] = grasps / (time.perf_counter() - started)
    return rates


def bumpy(ball: trimesh.Trimesh) -> Mesh:
    """A ball of 50 mm radius with bumps of 1 mm."""
    x, y, z = np.asarray(ball.vertices).T
    radius = 0.05 + 0.001 * np.sin(_BUMPS * x) * np.sin(_BUMPS * y) * np.sin(_BUMPS * z)
    return Mesh(np.asarray(ball.vertices) * radius[:, None], np.asarray(ball.faces))
