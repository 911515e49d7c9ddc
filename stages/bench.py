"""`make bench`: labelling, QP, storage and control, measured in one call on run `bench`.

Ratios hold within this call; rates are this machine's, today.
"""

import json
import os
import resource
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.artifacts import ArtifactWriter, publish_bytes
from pipeline.benchmarks import clutter, control, labelling, solvers, storage
from pipeline.benchmarks import loading as batches
from pipeline.benchmarks.clock import Laps
from pipeline.config import RunConfig, load_run_config
from pipeline.config.grasps import SolverName
from pipeline.execution import RunFolder, generator, run_command, run_in_order
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.shape import ShapeClass
from pipeline.labelling.heights import pad_heights
from pipeline.messages.grasps import GraspOrigin, LabelledGrasps, grasp_batch
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scenes
from pipeline.network.control_inference import ControlPredictor, checked_against
from pipeline.network.export import export_onnx_bytes
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.inference import predict
from pipeline.network.samples import Samples
from pipeline.network.timing import milliseconds_a_grasp
from pipeline.sensing.depth_noise import disturb
from pipeline.sensing.sub_cloud import sub_clouds
from pipeline.world.scene import ClutterScene
from stages.graph import RUNS_DIR
from stages.grasps import (
    ROUND,
    label_rounds,
    pad_of,
    ray_scene,
    synthesize,
    visible_surface,
)

PHASE_GRASPS = 4096
LATENCY_GRASPS = 1000
MESH_GRASPS = 2048
STORED_SAMPLES = 8192
CONTROL_STEPS = 60
NETWORK_THREADS = 2
INFERENCE_SECONDS = 3.0  # a batch size: the machine's own hiccups are shorter
PROBLEMS: dict[SolverName, int] = {"structured": 2000, "piqp-sparse": 200, "piqp-dense": 12}
WORKER_SECONDS = 6.0
PILES = 5


@dataclass(frozen=True)
class WorkerJob:
    """Label scene ``scene`` of the run over and over for ``seconds``."""

    folder: RunFolder
    scene: int
    seconds: float


@dataclass(frozen=True)
class Bench:
    """What all measurements share."""

    folder: RunFolder
    config: RunConfig
    scenes: list[ClutterScene]
    meshes: dict[str, Mesh]
    objects: dict[str, CatalogueObject]


def measure_all() -> None:
    """Measure, print the table, write bench.json."""
    bench = opened(RunFolder(RUNS_DIR / "bench"))
    figures: dict[str, object] = {"cores": len(os.sched_getaffinity(0))}
    for measure in (
        end_to_end,
        phases,
        quadratic_programs,
        scaling,
        storing,
        loading,
        inference,
        control_steps,
        settling,
    ):
        found = measure(bench)
        figures |= found
        sys.stdout.write(json.dumps(found, indent=1) + "\n")
        sys.stdout.flush()
    peak_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    figures["peak_memory_mib"] = round(peak_kib / 1024)
    path = bench.folder.path / "bench.json"
    publish_bytes(path, (json.dumps(figures, indent=1) + "\n").encode())
    sys.stdout.write(f"peak memory {figures['peak_memory_mib']} MiB; all of it in {path}\n")


def opened(folder: RunFolder) -> Bench:
    """The run's scenes and meshes."""
    objects = read_objects(folder.artifact("objects"))
    return Bench(
        folder,
        load_run_config(folder.config),
        list(read_scenes(folder.artifact("scenes"))),
        {name: item.mesh for name, (item, _) in objects.items()},
        {name: item for name, (item, _) in objects.items()},
    )


def labelled_scene(
    bench: Bench, scene: ClutterScene, wanted: int, rng: np.random.Generator
) -> list[tuple[GraspOrigin, LabelledGrasps]]:
    """Scene to grasps, its ray scene included."""
    return synthesize(
        scene, ray_scene(scene, bench.meshes, bench.config), bench.config, wanted, rng
    )


def end_to_end(bench: Bench) -> dict[str, object]:
    """Scene to shard on one core: labelled and kept grasps a second, everything included."""
    config, wanted = bench.config, bench.config.grasps.count // len(bench.scenes)
    provenance = storage.PROVENANCE
    labelled_scene(bench, bench.scenes[0], 32, np.random.default_rng(0))  # compiled
    started, kept = time.perf_counter(), 0
    with tempfile.TemporaryDirectory() as scratch:
        for index, scene in enumerate(bench.scenes):
            rng = generator(config.seed, "bench", scene.scene_id)
            batches = labelled_scene(bench, scene, wanted, rng)
            with ArtifactWriter(Path(scratch) / f"{index}.mcap", provenance) as artifact:
                for origin, grasps in batches:
                    artifact.write("/grasps", grasp_batch(origin, grasps), log_time_ns=0)
                    kept += len(grasps)
    seconds = time.perf_counter() - started
    labelled = len(bench.scenes) * int(np.ceil(wanted * config.grasps.oversampling))
    faces = [len(mesh.faces) for mesh in bench.meshes.values()]
    return {
        "grasps_per_s_per_core": round(labelled / seconds),
        "kept_grasps_per_s_per_core": round(kept / seconds),
        "median_faces_a_mesh": int(np.median(faces)),
    }


def phases(bench: Bench) -> dict[str, object]:
    """Microseconds a grasp by phase, and the latency of one grasp alone."""
    config, pad = bench.config, pad_of(bench.config)
    scene = bench.scenes[-1]
    rays, body_ids = ray_scene(scene, bench.meshes, config)
    view, rng = scene.views[0], np.random.default_rng(0)
    surface = visible_surface(view, rays, body_ids, pad.radius_m)
    candidates, labels = label_rounds(surface, rays, body_ids, config, PHASE_GRASPS, rng)
    frames = candidates.world_from_contact
    order = np.argsort(body_ids)
    body = order[np.searchsorted(body_ids[order], candidates.body_id)]
    common = (pad, config.gripper, rays)
    clearance_m = config.grasps.clearance_m
    seconds = labelling.phase_seconds(*common, frames, body, clearance_m)
    laps = Laps()
    measured = disturb(view, rng)
    sub_clouds(measured, view.camera, frames, config.sensing, pad.radius_m)
    laps.lap("sub cloud")
    batches = labelled_scene(bench, scene, 1024, rng)
    laps.start()
    with (
        tempfile.TemporaryDirectory() as scratch,
        ArtifactWriter(Path(scratch) / "x.mcap", storage.PROVENANCE) as artifact,
    ):
        for origin, grasps in batches:
            artifact.write("/grasps", grasp_batch(origin, grasps), log_time_ns=0)
    laps.lap("writing")
    per_grasp = {name: 1e6 * value / PHASE_GRASPS for name, value in seconds.items()}
    per_grasp["sub cloud"] = 1e6 * laps.seconds["sub cloud"] / PHASE_GRASPS
    per_grasp["writing"] = 1e6 * laps.seconds["writing"] / 1024
    some = slice(0, LATENCY_GRASPS)
    return {
        "us_per_grasp": {name: round(value, 1) for name, value in per_grasp.items()},
        "iterations_max": int(labels.iterations.max()),
        "latency_ms": labelling.latency_ms(*common, frames[some], body[some], clearance_m),
    }


def quadratic_programs(bench: Bench) -> dict[str, object]:
    """The production solver against PIQP, sparse and dense, on the same problems."""
    config, pad = bench.config, pad_of(bench.config)
    heights, targets = [], []
    for scene in bench.scenes[-2:]:
        rays, body_ids = ray_scene(scene, bench.meshes, config)
        surface = visible_surface(scene.views[0], rays, body_ids, pad.radius_m)
        rng = np.random.default_rng(1)
        candidates, _ = label_rounds(surface, rays, body_ids, config, 1200, rng)
        for start in range(0, len(candidates), ROUND):
            rows = slice(start, start + ROUND)
            frames = candidates.world_from_contact[rows]
            found, below = pad_heights(frames, rays, pad, config.grasps.clearance_m)
            heights.append(found)
            targets.append(body_ids[below] == candidates.body_id[rows, None])
    problems = solvers.problems_of(
        pad, config.gripper, np.concatenate(heights), np.concatenate(targets)
    )
    rng = np.random.default_rng(2)
    rng.shuffle(problems)
    times = solvers.milliseconds(problems, PROBLEMS)
    return {
        "qp_ms": {name: round(value, 4) for name, value in times.items()},
        "qp_speedup_vs_dense_piqp": round(times["piqp-dense"] / times["structured"], 1),
        "qp_speedup_vs_sparse_piqp": round(times["piqp-sparse"] / times["structured"], 1),
    }


def scaling(bench: Bench) -> dict[str, object]:
    """Labelled grasps a second over workers and over the size of the mesh."""
    by_workers = {}
    for workers in (1, 2):
        jobs = [WorkerJob(bench.folder, index, WORKER_SECONDS) for index in range(workers)]
        by_workers[workers] = round(sum(run_in_order(worker_rate, jobs, workers)))
    config = bench.config
    by_faces = labelling.by_mesh_size(
        pad_of(config), config.gripper, MESH_GRASPS, config.grasps.clearance_m
    )
    return {
        "grasps_per_s_by_workers": by_workers,
        "grasps_per_s_by_faces": {faces: round(rate) for faces, rate in by_faces.items()},
    }


def worker_rate(job: WorkerJob) -> float:
    """Labelled grasps a second of one worker, rays included, once it is warm."""
    bench = opened(job.folder)
    config, scene = bench.config, bench.scenes[job.scene]
    rays, body_ids = ray_scene(scene, bench.meshes, config)
    surface = visible_surface(scene.views[0], rays, body_ids, config.gripper.pad.radius_m)
    rng = np.random.default_rng(job.scene)
    label_rounds(surface, rays, body_ids, config, ROUND, rng)
    started, labelled = time.perf_counter(), 0
    while time.perf_counter() - started < job.seconds:
        candidates, _ = label_rounds(surface, rays, body_ids, config, 4 * ROUND, rng)
        labelled += len(candidates)
    return labelled / (time.perf_counter() - started)


def storing(bench: Bench) -> dict[str, object]:
    """MCAP against HDF5, Zarr, WebDataset and NumPy on the same samples."""
    with tempfile.TemporaryDirectory() as scratch:
        figures = storage.against_peers(stored_samples(bench), Path(scratch))
    peers = [name for name in figures if name != "mcap"]
    return {
        "storage": {
            name: {key: round(value, 1) for key, value in found.items()}
            for name, found in figures.items()
        },
        **{
            f"mcap_{way}_vs": {
                peer: round(figures["mcap"][f"{way}_mb_s"] / figures[peer][f"{way}_mb_s"], 2)
                for peer in peers
            }
            for way in ("read", "write")
        },
    }


def stored_samples(bench: Bench) -> Samples:
    """Labelled samples of the run's scenes."""
    rng = np.random.default_rng(0)
    wanted = STORED_SAMPLES // len(bench.scenes)
    grasps = [
        part for scene in bench.scenes for _, part in labelled_scene(bench, scene, wanted, rng)
    ]
    cloud = np.concatenate([part.cloud for part in grasps])
    count = len(cloud)
    return Samples(
        cloud=cloud,
        cloud_mask=np.concatenate([part.cloud_mask for part in grasps]),
        quality=np.concatenate([part.quality for part in grasps]),
        object_index=np.zeros(count, dtype=np.int64),
        shape_class=np.zeros(count, dtype=np.int64),
        level=np.ones(count, dtype=np.int64),
        pressure=np.concatenate([part.pressure for part in grasps]),
        proposal_weight=np.ones(count),
        pictures=np.ones(count, dtype=np.int64),
    )


def loading(bench: Bench) -> dict[str, object]:
    """Training's loader against raw memory maps and against other formats."""
    with tempfile.TemporaryDirectory() as scratch:
        rates = batches.rates_mb_s(stored_samples(bench), Path(scratch))
    return {
        "loader_mb_s": {name: round(rate) for name, rate in rates.items()},
        "loader_vs_memory_map": round(rates["epoch"] / rates["memory_map"], 2),
        "loader_vs": {name: round(rates["epoch"] / rates[name], 2) for name in batches.PEERS},
        "first_pass_vs": {
            name: round(rates["first_pass"] / rates[name], 2) for name in batches.PEERS
        },
    }


def inference(bench: Bench) -> dict[str, object]:
    """Milliseconds a grasp at the network's full size, as control asks and as training does."""
    network, exported = sized_network(bench)
    samples = stored_samples(bench)
    cloud, mask = samples.cloud[:512], samples.cloud_mask[:512]
    runtimes = {
        "openvino": exported.predict,
        "pytorch": lambda clouds, masks: predict(
            network, clouds, masks, len(clouds), NETWORK_THREADS, average_symmetries=False
        ),
    }
    times = {
        name: milliseconds_a_grasp(run, cloud, mask, seconds=INFERENCE_SECONDS)
        for name, run in runtimes.items()
    }
    return {
        "inference_ms_a_grasp": {
            name: {size: round(value, 3) for size, value in found.items()}
            for name, found in times.items()
        },
        "inference_layers": bench.config.network.layers,
        "inference_difference": checked_against(
            exported, network, cloud, mask, 64, NETWORK_THREADS
        ),
    }


def sized_network(bench: Bench) -> tuple[GaCnn, ControlPredictor]:
    """The network of the run and its export; its weights are untrained and change no time."""
    network = build_network(bench.config.network, seed=0).eval()
    threads = min(NETWORK_THREADS, os.cpu_count() or 1)
    return network, ControlPredictor(
        export_onnx_bytes(network, bench.config.sensing.grid_cells), threads
    )


def control_steps(bench: Bench) -> dict[str, object]:
    """The closed loop's step with the network at its full size; its weights change no time."""
    _, network = sized_network(bench)
    found = control.step_ms(bench.scenes[-1], bench.meshes, network, bench.config, CONTROL_STEPS)
    rounded = {
        part: {name: round(value, 2) for name, value in times.items()}
        for part, times in found.items()
    }
    return {
        "control_step_p95_ms": rounded["decision"]["p95"],
        "control_step_ms": rounded["decision"],
        "control_step_with_picture_ms": rounded["with the picture"],
        "control_candidates": bench.config.evaluate.policy.local_candidates,
        "control_layers": bench.config.network.layers,
    }


def settling(bench: Bench) -> dict[str, object]:
    """Times real time at which a pile of each class settles."""
    pools = {
        kind: [item for item in bench.objects.values() if item.shape_class == kind]
        for kind in ShapeClass
    }
    speeds = {
        str(kind): round(clutter.settling_speed(pool, bench.config.scenes, PILES, seed=0), 1)
        for kind, pool in pools.items()
    }
    return {"settling_times_real_time": speeds}


if __name__ == "__main__":
    run_command(measure_all)
