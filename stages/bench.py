"""`make bench`: labelling, QP, storage and control, measured in one call on run `bench`.

Ratios hold within this call; rates are this machine's, today.
"""

import json
import os
import resource
import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pipeline.artifacts import publish_bytes
from pipeline.benchmarks import clutter, control, inference, labelling, loading, solvers, storage
from pipeline.benchmarks.commits import against_older
from pipeline.benchmarks.cutting import cutting_time
from pipeline.benchmarks.driver import driver_share
from pipeline.benchmarks.shuffling import shuffle_costs
from pipeline.config import RunConfig, load_run_config
from pipeline.execution import RunFolder, generator, run_command, run_in_order
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.mesh import Mesh
from pipeline.gripper import pad_of
from pipeline.labelling.poses import ROUND
from pipeline.labelling.rounds import label_rounds
from pipeline.labelling.scene import label_scene, scene_surfaces, visible_surface
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scenes
from pipeline.network.samples import Samples
from pipeline.world.raycasting import RayScene
from pipeline.world.scene import ClutterScene
from stages.graph import RUNS_DIR

PHASE_GRASPS = 4096  # enough for rates known to a percent
PROBLEM_GRASPS = 1200  # of one scene: problems of all kinds
MESH_GRASPS = 2048  # a mesh size: enough for rates known to a percent
STORED_SAMPLES = 8192  # more than any cache of a disk hides
WORKER_SECONDS = 6.0  # a number of workers is timed for so long

Measure = Callable[[], dict[str, object]]


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
    bench = open_bench(RunFolder(RUNS_DIR / "bench"))
    samples = stored_samples(bench)
    figures: dict[str, object] = {"cores": len(os.sched_getaffinity(0))}
    measures: tuple[Measure, ...] = (
        lambda: end_to_end(bench),
        lambda: phases(bench),
        lambda: quadratic_programs(bench),
        lambda: scaling(bench),
        lambda: storage.figures(samples),
        lambda: loading.figures(samples),
        shuffle_costs,
        lambda: driver_share(bench.folder),
        lambda: inference.figures(bench.config.network, samples),
        lambda: control.figures(bench.scenes[-1], bench.meshes, bench.config),
        lambda: clutter.figures(bench.objects.values(), bench.config.scenes),
        lambda: cutting_time(bench.objects.values(), bench.config.objects.convex),
    )
    for measure in measures:
        figures |= (found := measure())
        sys.stdout.write(json.dumps(found, indent=1) + "\n")
        sys.stdout.flush()
    figures["peak_memory_mib"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    path = bench.folder.path / "bench.json"
    publish_bytes(path, (json.dumps(figures, indent=1) + "\n").encode())
    sys.stdout.write(f"peak memory {figures['peak_memory_mib']} MiB; all of it in {path}\n")


def open_bench(folder: RunFolder) -> Bench:
    """Read the run's scenes and meshes."""
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
) -> labelling.Labelled:
    """Label a scene, including the time to build its surfaces for rays."""
    return label_scene(scene, surfaces_of(bench, scene), bench.config, wanted, rng)


def surfaces_of(bench: Bench, scene: ClutterScene) -> RayScene:
    """The true surfaces of a scene."""
    return scene_surfaces(scene, bench.meshes, bench.config.scenes.table_side_m)


def end_to_end(bench: Bench) -> dict[str, object]:
    """Scene to shard on one core: labelled and kept grasps a second, everything included."""
    config, wanted = bench.config, bench.config.grasps.count // len(bench.scenes)
    labelled_scene(bench, bench.scenes[0], 32, np.random.default_rng(0))  # compiled

    def label(scene: ClutterScene) -> labelling.Labelled:
        return labelled_scene(bench, scene, wanted, generator(config.seed, "bench", scene.scene_id))

    labelled = len(bench.scenes) * int(np.ceil(wanted * config.grasps.oversampling))
    return {
        **labelling.end_to_end(bench.scenes, label, labelled),
        "median_faces_a_mesh": int(np.median([len(m.faces) for m in bench.meshes.values()])),
    }


def phases(bench: Bench) -> dict[str, object]:
    """Microseconds a grasp by phase, and the latency of one grasp alone."""
    config, pad = bench.config, pad_of(bench.config.gripper.pad)
    scene, rng = bench.scenes[-1], np.random.default_rng(0)
    surfaces = surfaces_of(bench, scene)
    surface = visible_surface(scene.views[0], surfaces, pad.radius_m)
    candidates, labels = label_rounds(surface, surfaces, config, PHASE_GRASPS, rng)
    written = labelled_scene(bench, scene, 1024, rng)
    return {
        **labelling.phases(pad, config, scene.views[0], surfaces, candidates, written),
        "iterations_max": int(labels.iterations.max()),
    }


def quadratic_programs(bench: Bench) -> dict[str, object]:
    """The production solver against PIQP, sparse and dense, on the same problems."""
    config, pad = bench.config, pad_of(bench.config.gripper.pad)
    problems = []
    for scene in bench.scenes[-2:]:
        surfaces = surfaces_of(bench, scene)
        surface = visible_surface(scene.views[0], surfaces, pad.radius_m)
        rng = np.random.default_rng(1)
        candidates, _ = label_rounds(surface, surfaces, config, PROBLEM_GRASPS, rng)
        problems += solvers.problems_under(
            pad, config.gripper, surfaces, candidates, config.grasps.clearance_m
        )
    return solvers.figures(problems) | against_older(scene, bench.meshes, problems)


def scaling(bench: Bench) -> dict[str, object]:
    """Labelled grasps a second over workers and over the size of the mesh."""
    by_workers = {}
    for workers in (1, 2):
        jobs = [WorkerJob(bench.folder, index, WORKER_SECONDS) for index in range(workers)]
        by_workers[workers] = round(sum(run_in_order(worker_rate, jobs, workers)))
    config = bench.config
    by_faces = labelling.by_mesh_size(config.gripper, MESH_GRASPS, config.grasps.clearance_m)
    return {
        "grasps_per_s_by_workers": by_workers,
        "grasps_per_s_by_faces": {faces: round(rate) for faces, rate in by_faces.items()},
    }


def worker_rate(job: WorkerJob) -> float:
    """Labelled grasps a second of one worker, rays included, once it is warm."""
    bench = open_bench(job.folder)
    config, scene = bench.config, bench.scenes[job.scene]
    surfaces = surfaces_of(bench, scene)
    surface = visible_surface(scene.views[0], surfaces, config.gripper.pad.radius_m)
    rng = np.random.default_rng(job.scene)
    label_rounds(surface, surfaces, config, ROUND, rng)

    def label() -> int:
        return len(label_rounds(surface, surfaces, config, 4 * ROUND, rng)[0])

    return labelling.labelling_rate(label, job.seconds)


def stored_samples(bench: Bench) -> Samples:
    """Labelled samples of the run's scenes."""
    rng, wanted = np.random.default_rng(0), STORED_SAMPLES // len(bench.scenes)
    return storage.samples_of_grasps(
        [part for scene in bench.scenes for _, part in labelled_scene(bench, scene, wanted, rng)]
    )


if __name__ == "__main__":
    run_command(measure_all)
