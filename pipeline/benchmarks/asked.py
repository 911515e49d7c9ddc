"""Label a scene, or solve QPs, whenever a line asks, with the code of the commit in this folder.

Run as a script by `pipeline.benchmarks.commits`, in a checkout of this commit and of an older one:
what differs between the two is looked up by name. Answers are seconds of this process's processor.
"""

import cProfile
import importlib
import pickle
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

Plain = dict[str, Any]
"""Fields of a dataclass, which each commit makes its own instance of."""

LABELLED = 1000  # kept grasps of the scene a turn: as many as of a scene of run bench
BLOCK = 16  # problems at a time, as labels are made


def this_commit(given: Plain) -> Callable[[Path], object]:
    """Scene to shard as stage grasps does it."""
    names = ("pipeline.world.scene", "pipeline.world.view", "pipeline.world.cameras")
    scene, meshes = instances(given, *names)
    labelling = importlib.import_module("pipeline.labelling.scene")
    benchmark = importlib.import_module("pipeline.benchmarks.labelling")
    config = importlib.import_module("pipeline.config").RunConfig()

    def label(path: Path) -> object:
        surfaces = labelling.scene_surfaces(scene, meshes, config.scenes.table_side_m)
        rng = np.random.default_rng(0)
        batches = labelling.label_scene(scene, surfaces, config, LABELLED, rng)
        return benchmark.write_shard(path, batches)

    return label


def older_commit(given: Plain) -> Callable[[Path], object]:
    """The same by the modules of commit 19217de."""
    names = ("pipeline.clutter.scene", "pipeline.sensing.view", "pipeline.sensing.cameras")
    scene, meshes = instances(given, *names)
    stage = importlib.import_module("stages.grasps")
    artifacts = importlib.import_module("pipeline.artifacts")
    provenance = importlib.import_module("pipeline.benchmarks.storage").PROVENANCE
    config = importlib.import_module("pipeline.config").RunConfig()

    def label(path: Path) -> object:
        surfaces = stage.ray_scene(scene, meshes, config)
        rng = np.random.default_rng(0)
        with artifacts.ArtifactWriter(path, provenance) as artifact:
            for origin, grasps in stage.synthesize(scene, surfaces, config, LABELLED, rng):
                artifact.write("/grasps", stage.grasp_batch(origin, grasps), log_time_ns=0)
        return None

    return label


def instances(
    given: Plain, scene_module: str, view_module: str, camera_module: str
) -> tuple[Any, dict[str, Any]]:
    """The scene and the meshes by name, as instances of this checkout's classes."""
    scenes, views, cameras = map(
        importlib.import_module, (scene_module, view_module, camera_module)
    )
    mesh = importlib.import_module("pipeline.geometry.mesh").Mesh
    seen = [
        views.CameraView(**view | {"camera": cameras.PinholeCamera(**view["camera"])})
        for view in given["views"]
    ]
    placed = tuple(scenes.PlacedObject(**item) for item in given["objects"])
    scene = scenes.ClutterScene(**given["scene"], objects=placed, views=tuple(seen))
    return scene, {name: mesh(*arrays) for name, arrays in given["meshes"].items()}


def solve(problems: Plain) -> None:
    """Every problem once by this checkout's production solver."""
    solver = importlib.import_module("pipeline.gripper.solvers.structured").solve_into
    matrices, counts, forces = problems["matrices"], problems["counts"], problems["forces"]
    weights = np.empty((BLOCK, matrices.shape[2]))
    status, iterations = (np.empty(BLOCK, dtype=np.int64) for _ in range(2))
    for start in range(0, len(counts), BLOCK):
        rows = slice(start, start + BLOCK)
        used = len(counts[rows])
        solver(
            matrices[rows],
            counts[rows],
            forces[rows],
            *problems["setting"],
            weights[:used],
            status[:used],
            iterations[:used],
        )


def answer(given: Plain, older: bool) -> None:
    """Answer each line of standard input with seconds, until it ends.

    Lines are "label", "solve", or "profile" and a file for what a profiler sees of labelling.
    """
    label = (older_commit if older else this_commit)(given)
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "grasps.mcap"
        for line in sys.stdin:
            started = time.process_time()
            question, *words = line.split()
            if question == "label":
                label(path)
            elif question == "profile":
                profiler = cProfile.Profile(time.process_time)
                profiler.runcall(label, path)
                profiler.dump_stats(words[0])
            else:
                solve(given["problems"])
            sys.stdout.write(f"{time.process_time() - started}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    with Path(sys.argv[1]).open("rb") as file:
        given = pickle.load(file)  # noqa: S301 - written by the process that started this one
    answer(given, sys.argv[2] == "older")
