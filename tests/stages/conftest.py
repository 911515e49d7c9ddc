"""A run small enough for a test, through all six stages."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from filelock import FileLock

from pipeline.execution import RunFolder
from stages.graph import STAGES

ROOT = Path(__file__).resolve().parents[2]

TINY = """
seed = 4
[objects]
limit = 12
[objects.convex]
input_faces = 500
[scenes]
levels = [1]
objects_per_clutter = 3
[scenes.clutters_per_level]
train = 2
val = 1
test = 1
[grasps]
count = 240
[network]
layers = 18
channels = [8, 8, 16, 16]
[train]
epochs = 2
batch_size = 32
timed_batches = [1]  # how a larger one is timed is in tests/network/test_timing
[evaluate]
attempts_per_clutter = 2
policies = ["closed-loop", "open-loop", "geometric"]
[evaluate.imperfection]
curve = [1.0]  # what the contest tries anyhow; another scale is in test_larger_gripper
[evaluate.policy]
candidates = 24
"""


def run_stage(stage: str, runs: Path, workers: int) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if k not in ("MESH_DIR", "RUN", "WORKERS")}
    return subprocess.run(
        [
            *(sys.executable, "-m", f"stages.{stage}", "--run", "tiny"),
            *("--runs-dir", str(runs), "--workers", str(workers)),
        ],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def make_run(runs: Path, workers: int) -> RunFolder:
    folder = RunFolder(runs / "tiny")
    folder.path.mkdir(parents=True)
    folder.config.write_text(TINY)
    for stage in STAGES:
        done = run_stage(stage, runs, workers)
        assert done.returncode == 0, done.stderr[-3000:]
    return folder


def with_convex_parts(run: RunFolder, runs: Path) -> None:
    """The cache beside all runs, for tests of other things than how objects are cut."""
    shutil.copytree(run.cache, runs / run.cache.name, dirs_exist_ok=True)


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> RunFolder:
    """Made once, though several processes test side by side."""
    base = tmp_path_factory.getbasetemp()
    shared = base if worker_id == "master" else base.parent
    with FileLock(shared / "run.lock"):
        folder = RunFolder(shared / "one" / "runs" / "tiny")
        if not folder.path.exists():
            make_run(folder.path.parent, workers=1)
    return folder
