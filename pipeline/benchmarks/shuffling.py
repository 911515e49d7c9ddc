"""What stage shards and its check cost over the number of samples, on grasps of random numbers."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.artifacts import ArtifactWriter
from pipeline.artifacts.sharding import shard_entry, shard_path, write_index
from pipeline.asking.cache import QUERY_CACHE, arrow_table
from pipeline.benchmarks.storage import BATCH, PROVENANCE
from pipeline.clutter.levels import LEVELS
from pipeline.config.grasps import CELL_SIDE
from pipeline.execution.stage import RunFolder
from pipeline.labelling.balancing import TENTHS
from pipeline.labelling.grasps import GraspOrigin, LabelledGrasps
from pipeline.labelling.sampling import Proposal
from pipeline.messages.grasps import write_grasps

SAMPLES = (100_000, 1_000_000)  # one that fits memory easily, and ten times as many
SCENE = 2048  # samples of a scene
CELLS = 24  # a side, as sensing.grid_cells
VERTICES = 573  # of the pad of Supplement II
SEEN = 0.6  # share of cells that hold a point, as in run paper
# Linux counts what the caller held to the peak of what it starts, and a benchmark holds more than
# the stage: so a small process starts it, and prints its peak and that of its workers [KiB].
WATCHED = """
import resource, subprocess, sys
code = subprocess.call(sys.argv[1:])
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
sys.exit(code)
"""
# Of ten scenes eight are trained on, as [split] has it.
SPLIT_OF = ("train", "train", "val", "train", "train", "test", "train", "train", "train", "train")
DISTINCT_SCENES = 10  # one for each entry of the above
OBJECTS = 10  # in a scene
LIMITS = 8  # of Eq. (8)-(11)


def shuffle_costs() -> dict[str, object]:
    """Peak memory of stage shards [MiB], and its check's share of its time, by samples."""
    found = {str(samples): shuffle_cost(samples) for samples in SAMPLES}
    return {
        "shuffle_peak_mib": {samples: round(peak_mib) for samples, (peak_mib, _) in found.items()},
        "shards_check_share": {samples: share for samples, (_, share) in found.items()},
    }


def shuffle_cost(samples: int, settings: str = "", workers: int = 1) -> tuple[float, float]:
    """Peak memory of the largest process of stage shards, and what its check costs.

    Parameters
    ----------
    samples
        How many it shuffles.
    settings
        The run's configuration, as run.toml.
    workers
        Its worker processes.

    Returns
    -------
    The peak, recording included [MiB], and the check's share of the stage's processor time [1].

    Raises
    ------
    RuntimeError
        The stage failed.
    """
    with tempfile.TemporaryDirectory(dir=os.environ.get("TMPDIR")) as scratch:
        folder = Path(scratch) / "shuffle"
        grasps = write_synthetic_grasps(folder, samples)
        arrow_table("grasps", grasps, RunFolder(folder).state(QUERY_CACHE))  # as stage grasps does
        (folder / "run.toml").write_text(settings)
        command = [sys.executable, "-m", "stages.shards", "--run", folder.name]
        command += ["--runs-dir", scratch, "--workers", str(workers)]
        watched = [sys.executable, "-c", WATCHED, *command]
        done = subprocess.run(watched, stdout=subprocess.PIPE, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"stage shards ended with {done.returncode}")
        share = json.loads(RunFolder(folder).summary("shards").read_text())["expectations_share"]
    return int(done.stdout.splitlines()[-1]) / 1024, float(share)


def write_synthetic_grasps(
    run: Path, samples: int, scene: int = SCENE, distinct: int = DISTINCT_SCENES
) -> Path:
    """Write grasps of random numbers as stage grasps would, each cloud within its cells.

    Parameters
    ----------
    run
        Folder that gets the index and its shards.
    samples
        How many.
    scene
        Samples of a scene, which is a shard.
    distinct
        Scenes that are written; the others are links to them, so that writing costs little. A
        multiple of ten.

    Returns
    -------
    The index.
    """
    index, entries = run / "grasps.mcap", []
    count = -(-samples // scene)
    for number in range(count):
        path = shard_path(run / "grasps", number, count)
        rows = min(scene, samples - number * scene)
        split = SPLIT_OF[number % len(SPLIT_OF)]
        if distinct <= number and rows == scene:
            path.hardlink_to(shard_path(run / "grasps", number % distinct, count))
        else:
            write_scene(path, number, split, rows)
        entries.append(shard_entry(path, run, rows, split))
    write_index(index, PROVENANCE, entries, np.zeros(TENTHS))
    return index


def write_scene(path: Path, number: int, split: str, rows: int) -> None:
    """Write the shard of one scene of random numbers."""
    rng, origin = np.random.default_rng(number), synthetic_origin(number, split)
    sizes = [min(BATCH, rows - at) for at in range(0, rows, BATCH)]
    with ArtifactWriter(path, PROVENANCE) as artifact:
        batches = [(origin, synthetic_grasps(size, rng)) for size in sizes]
        write_grasps(artifact, batches, BATCH, rounded=True)


def synthetic_origin(scene: int, split: str) -> GraspOrigin:
    """Where the grasps of a scene of no objects are from."""
    level = LEVELS[scene % len(LEVELS)]
    names = tuple(f"{split}{(scene + number) % (2 * OBJECTS):02d}" for number in range(OBJECTS))
    proposals = tuple(proposal.name for proposal in Proposal)
    limits = tuple(f"limit {number}" for number in range(LIMITS))
    return GraspOrigin(
        f"{split}-{scene}", "static0", level, split, names, limits, ("solved",), proposals
    )


def synthetic_grasps(count: int, rng: np.random.Generator) -> LabelledGrasps:
    """Grasps of random numbers, within the bounds of what stage grasps writes."""
    seen = rng.random((count, CELLS, CELLS)) < SEEN
    middle = (np.arange(CELLS) + 0.5 - CELLS / 2) * CELL_SIDE
    off = (rng.random((count, CELLS, CELLS, 3)) - 0.5) * CELL_SIDE
    cloud = off + np.stack([*np.meshgrid(middle, middle), np.zeros((CELLS, CELLS))], axis=-1)
    cloud[~seen] = 0
    world_from_gripper = np.tile(np.eye(4), (count, 1, 1))
    world_from_gripper[:, :3, :3] = Rotation.random(count, random_state=rng).as_matrix()
    return LabelledGrasps(
        object_index=rng.integers(0, OBJECTS, count),
        body_id=np.zeros(count, dtype=np.int64),
        world_from_gripper=world_from_gripper,
        quality=rng.random(count),
        pressure=rng.random(count),
        wrench=rng.random((count, 4)),
        limit_slack=rng.random((count, LIMITS)),
        weight_summary=rng.random((count, 3)),
        contact_mask=rng.random((count, VERTICES)) < SEEN,
        status=np.zeros(count, dtype=np.int64),
        iterations=np.zeros(count, dtype=np.int64),
        tilt_rad=rng.random(count),
        proposal=rng.integers(0, len(Proposal), count),
        keep_probability=0.1 + 0.9 * rng.random(count),
        cloud=cloud,
        cloud_mask=seen,
        touch_height_m=rng.random(count),
        pictures=np.ones(count, dtype=np.int64),
    )
