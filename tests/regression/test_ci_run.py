"""Run `ci`: as its reference has it, and the same bytes however often it was killed."""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np

from pipeline.execution import RunFolder
from stages.graph import STAGES
from tests.regression.conftest import ROOT, quiet_environment

KILLS = 5
SEED = 8
# Even a stage that has nothing left to do is not done sooner.
SOONEST_END_S = 1.0


def digests(run: RunFolder) -> dict[str, str]:
    """SHA-256 of every artifact that the run's stages hand over."""
    files = [run.artifact(stage) for stage in STAGES]
    for stage in STAGES:
        files += sorted(path for path in run.shards(stage).rglob("*") if path.is_file())
    return {
        path.relative_to(run.path).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in files
    }


def test_its_figures_are_those_of_the_reference(ci_run: RunFolder) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "stages.regress"],
        cwd=ROOT,
        env=quiet_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_killed_at_five_moments_one_worker_ends_with_the_bytes_of_two(
    ci_run: RunFolder, tmp_path: Path
) -> None:
    """Moments are drawn over the time each stage took; what is unspent falls on the last one."""
    run = RunFolder(tmp_path / "ci")
    run.path.mkdir()
    shutil.copy(ci_run.config, run.config)
    # Convex parts are a cache beside all runs, no artifact; they are cold in the first run.
    shutil.copytree(ci_run.path.parent / ".cache", tmp_path / ".cache")
    rng = np.random.default_rng(SEED)
    left = KILLS
    for number, stage in enumerate(STAGES):
        took_s = json.loads(ci_run.summary(stage).read_text())["wall_time_s"]
        last = number == len(STAGES) - 1
        wanted = left if last else int(rng.binomial(left, 1.5 / (len(STAGES) - number)))
        for _ in range(wanted):
            # The last stage must not be done before its kills are spent.
            share = rng.random() * (0.2 if last else 1.0)
            left -= killed(run, stage, SOONEST_END_S + share * took_s)
        done = subprocess.run(
            command(run, stage),
            cwd=ROOT,
            env=quiet_environment(),
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr[-3000:]
    assert left == 0
    assert digests(run) == digests(ci_run)
    assert not list(run.path.rglob(".*.part"))


def command(run: RunFolder, stage: str) -> list[str]:
    return [
        *(sys.executable, "-m", f"stages.{stage}", "--run", run.path.name),
        *("--runs-dir", str(run.path.parent), "--workers", "1"),
    ]


def killed(run: RunFolder, stage: str, after_s: float) -> bool:
    """Start a stage and kill it and what it started; whether it was still at it."""
    process = subprocess.Popen(
        command(run, stage),
        cwd=ROOT,
        env=quiet_environment(),
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        process.wait(timeout=after_s)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
    return process.wait() == -signal.SIGKILL
