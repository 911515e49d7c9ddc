"""Grasps a second, by phase and by mesh size: S-1.07 - S-1.12 as production runs them."""

import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float, Int

from pipeline.artifacts import ArtifactWriter
from pipeline.benchmarks.clock import Laps, quantiles_ms
from pipeline.benchmarks.storage import BATCH, PROVENANCE
from pipeline.config import RunConfig
from pipeline.config.grasps import GripperConfig
from pipeline.geometry.mesh import Mesh
from pipeline.gripper.batch import BLOCK, assemble_into, empty_batch
from pipeline.gripper.draping import drape_into
from pipeline.gripper.limits import wrench_limit_ratios
from pipeline.gripper.pad import Pad
from pipeline.gripper.quality import target_wrench
from pipeline.gripper.solvers.structured import solve_into
from pipeline.labelling.grasps import GraspOrigin, LabelledGrasps
from pipeline.labelling.heights import pad_heights
from pipeline.labelling.poses import ROUND, label_poses
from pipeline.labelling.sampling import Candidates, contact_frames
from pipeline.messages.grasps import write_grasps
from pipeline.sensing.depth_noise import disturb
from pipeline.sensing.sub_cloud import sub_clouds
from pipeline.world.raycasting import RayScene
from pipeline.world.scene import ClutterScene
from pipeline.world.view import CameraView

LATENCY_GRASPS = 1000  # enough for a 95th percentile
_BUMPS = 8  # a surface neither flat nor hopeless


Labelled = list[tuple[GraspOrigin, LabelledGrasps]]


def end_to_end(
    scenes: Sequence[ClutterScene], label: Callable[[ClutterScene], Labelled], labelled: int
) -> dict[str, object]:
    """Scene to shard on one core: labelled and kept grasps a second, everything included.

    Parameters
    ----------
    scenes
        Labelled one after the other, each written to a shard of its own.
    label
        A scene's kept grasps, warm already.
    labelled
        Grasps that ``label`` tries on all scenes together.

    Returns
    -------
    Rates by their names in bench.json.
    """
    started, kept = time.perf_counter(), 0
    with tempfile.TemporaryDirectory() as scratch:
        for index, scene in enumerate(scenes):
            kept += write_shard(Path(scratch) / f"{index}.mcap", label(scene))
    seconds = time.perf_counter() - started
    return {
        "grasps_per_s_per_core": round(labelled / seconds),
        "kept_grasps_per_s_per_core": round(kept / seconds),
    }


def write_shard(path: Path, batches: Labelled) -> int:
    """A shard as stage grasps writes it; how many grasps."""
    with ArtifactWriter(path, PROVENANCE) as artifact:
        return write_grasps(artifact, batches, BATCH, rounded=True)


def phases(
    pad: Pad,
    config: RunConfig,
    view: CameraView,
    surfaces: RayScene,
    candidates: Candidates,
    written: Labelled,
) -> dict[str, object]:
    """Microseconds a grasp by phase, and the latency of one grasp alone.

    Parameters
    ----------
    pad
        The pad in GCS.
    config
        The run.
    view
        The picture that sub clouds are cut from.
    surfaces
        The scene's true surfaces.
    candidates
        What is labelled, phase by phase.
    written
        Kept grasps, for the time of writing.

    Returns
    -------
    Figures by their names in bench.json.
    """
    frames, body = candidates.world_from_contact, candidates.body_id
    clearance_m = config.grasps.clearance_m
    seconds = phase_seconds(pad, config.gripper, surfaces, frames, body, clearance_m)
    per_grasp = {name: 1e6 * value / len(frames) for name, value in seconds.items()}
    laps = Laps()
    measured = disturb(view, np.random.default_rng(0))
    sub_clouds(measured, view.camera, frames, config.sensing, pad.radius_m)
    laps.lap("sub cloud")
    per_grasp["sub cloud"] = 1e6 * laps.seconds["sub cloud"] / len(frames)
    with tempfile.TemporaryDirectory() as scratch:
        laps.start()
        count = write_shard(Path(scratch) / "x.mcap", written)
        laps.lap("writing")
    per_grasp["writing"] = 1e6 * laps.seconds["writing"] / count
    some = slice(0, LATENCY_GRASPS)
    return {
        "us_per_grasp": {name: round(value, 1) for name, value in per_grasp.items()},
        "latency_ms": latency_ms(config.gripper, surfaces, frames[some], body[some], clearance_m),
    }


def labelling_rate(label: Callable[[], int], seconds: float) -> float:
    """Grasps a second of ``label``, called again and again for ``seconds``; it returns how many."""
    started, labelled = time.perf_counter(), 0
    while time.perf_counter() - started < seconds:
        labelled += label()
    return labelled / (time.perf_counter() - started)


def phase_seconds(
    pad: Pad,
    config: GripperConfig,
    rays: RayScene,
    world_from_contact: Float[np.ndarray, "n 4 4"],
    body: Int[np.ndarray, " n"],
    clearance_m: float,
) -> dict[str, float]:
    """Seconds that rays, draping, wrench and QP take on these grasps, block by block.

    Parameters
    ----------
    pad
        The pad in GCS.
    config
        Contact physics and the QP.
    rays
        The true surfaces.
    world_from_contact
        Where the grasps are, shape (n, 4, 4).
    body
        Each grasp's own body, as ``rays`` numbers it, shape (n,).
    clearance_m
        Height of the rays' origins above the contact [m].

    Returns
    -------
    Phase → seconds for all grasps.
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
        one = slice(row, row + 1)
        label_poses(world_from_contact[one], body[one], rays, config, clearance_m)
        times.append(time.perf_counter() - started)
    return quantiles_ms(times)


def by_mesh_size(config: GripperConfig, grasps: int, clearance_m: float) -> dict[int, float]:
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
        label_poses(frames, np.zeros(grasps, dtype=np.int64), rays, config, clearance_m)
        rates[len(mesh.faces)] = grasps / (time.perf_counter() - started)
    return rates


def bumpy(ball: trimesh.Trimesh) -> Mesh:
    """A ball of 50 mm radius with bumps of 1 mm."""
    x, y, z = np.asarray(ball.vertices).T
    radius = 0.05 + 0.001 * np.sin(_BUMPS * x) * np.sin(_BUMPS * y) * np.sin(_BUMPS * z)
    return Mesh(np.asarray(ball.vertices) * radius[:, None], np.asarray(ball.faces))
