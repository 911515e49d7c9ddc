"""A run killed without warning, stage by stage, goes on and ends with the same bytes."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.execution import RunFolder
from stages.graph import STAGES
from tests.stages.conftest import ROOT, TINY, run_stage, with_convex_parts
from tests.stages.test_pipeline import digests

# What must be there before the kill: the first finished piece where a stage makes pieces.
FIRST_PIECE = {
    "scenes": "scenes/*.mcap",
    "grasps": "grasps/*.mcap",
    "evaluate": ".state/evaluate/*.mcap",
}
CUT_AGAIN = 4  # every fourth object is cut into convex parts once more
MOMENTS_S = {"objects": 2.5, "shards": 1.5, "train": 4.0}


def kill_when(stage: str, folder: RunFolder, moment: Callable[[float], bool]) -> int:
    """Start a stage, kill it and its workers at a moment; its exit code."""
    environment = {k: v for k, v in os.environ.items() if k not in ("MESH_DIR", "RUN", "WORKERS")}
    started = time.monotonic()
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", f"stages.{stage}", "--run", folder.path.name),
            *("--runs-dir", str(folder.path.parent), "--workers", "2"),
        ],
        cwd=ROOT,
        env=environment,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    while process.poll() is None and not moment(time.monotonic() - started):
        time.sleep(0.01)
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    return process.wait()


def test_killed_in_every_stage_and_started_elsewhere_it_ends_with_the_same_bytes(
    run: RunFolder, tmp_path: Path
) -> None:
    """Elsewhere: where another machine sees the folder that all share, under another path."""
    runs = tmp_path / "here"
    folder = RunFolder(runs / "tiny")
    folder.path.mkdir(parents=True)
    folder.config.write_text(TINY)
    with_convex_parts(run, tmp_path)
    for path in sorted((tmp_path / run.cache.name).rglob("*.parts"))[::CUT_AGAIN]:
        path.unlink()
    killed = 0
    for number, stage in enumerate(STAGES):
        piece = FIRST_PIECE.get(stage)

        def moment(
            elapsed_s: float,
            path: Path = folder.path,
            piece: str | None = piece,
            after_s: float = MOMENTS_S.get(stage, 0.0),
        ) -> bool:
            return any(path.glob(piece)) if piece else elapsed_s > after_s

        killed += kill_when(stage, folder, moment) == -signal.SIGKILL
        runs = runs.rename(tmp_path / f"seen_by_machine_{number}")
        folder = RunFolder(runs / "tiny")
        done = run_stage(stage, runs, workers=2)
        assert done.returncode == 0, done.stderr[-3000:]
    assert killed >= 3
    assert digests(folder) == digests(run)
    assert not list(folder.path.rglob(".*.part"))


@pytest.mark.parametrize("stage", ["scenes", "evaluate"])
def test_pieces_of_a_finished_stage_are_gone(run: RunFolder, stage: str) -> None:
    assert not run.state(stage).exists()
