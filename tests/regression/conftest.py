"""Run `ci` as `make regress` has it: made once, in the run's own folder, and kept."""

import os
import subprocess
from pathlib import Path

import pytest
from filelock import FileLock

from pipeline.execution import RunFolder

ROOT = Path(__file__).resolve().parents[2]


def quiet_environment() -> dict[str, str]:
    """Without what a person or CI has set for other runs."""
    ours = ("MESH_DIR", "RUN", "WORKERS", "EXECUTOR", "MAKEFLAGS", "MAKELEVEL", "MFLAGS")
    return {name: value for name, value in os.environ.items() if name not in ours}


@pytest.fixture(scope="session")
def ci_run(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> RunFolder:
    """The finished run; where nothing changed since it was made, this does nothing.

    Of several processes that test side by side one makes it, the others wait.
    """
    base = tmp_path_factory.getbasetemp()
    shared = base if worker_id == "master" else base.parent
    with FileLock(shared / "ci_run.lock"):
        done = subprocess.run(
            ["make", "runs/ci/evaluate.mcap", "RUN=ci", "MESH_DIR=", "WORKERS=2"],
            cwd=ROOT,
            env=quiet_environment(),
            capture_output=True,
            text=True,
            check=False,
        )
    assert done.returncode == 0, done.stderr[-3000:]
    return RunFolder(ROOT / "runs" / "ci")
