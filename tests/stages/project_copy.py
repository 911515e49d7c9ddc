"""The project copied elsewhere, so that `make` can be run there as a person would."""

import os
import shutil
import sys
from pathlib import Path

from tests.stages.conftest import ROOT

NOT_COPIED = (".git", ".venv", ".cache", "*_cache", ".hypothesis", "node_modules")
SET_FOR_OTHER_RUNS = (
    *("MESH_DIR", "RUN", "STAGE", "FORMAT", "WORKERS", "EXECUTOR"),
    *("MAKEFLAGS", "MAKELEVEL", "MFLAGS"),
)


def copied_project(copy: Path) -> Path:
    """Everything but the runs, with the environment that runs the tests.

    What is compiled comes along: numba takes nine seconds of processor to make the labels alone.
    """
    ignored = shutil.ignore_patterns(*NOT_COPIED, "runs")
    shutil.copytree(ROOT, copy, ignore=ignored, copy_function=copied_unless_gone)
    (copy / "runs").mkdir()
    _give_environment(copy)
    return copy


def copied_unless_gone(source: str, target: str) -> str:
    """Copy a file; a compiled one may vanish, as other processes rename theirs when it is whole."""
    try:
        return shutil.copy2(source, target)
    except FileNotFoundError:
        if Path(source).parent.name != "__pycache__":
            raise
        return target


def quiet_environment() -> dict[str, str]:
    """Without what a person or CI has set for other runs."""
    return {name: value for name, value in os.environ.items() if name not in SET_FOR_OTHER_RUNS}


def _give_environment(copy: Path) -> None:
    """The environment under the copy's own name: `make` finds it ready."""
    venv = copy / ".venv"
    venv.mkdir()
    for part in Path(sys.prefix).iterdir():
        if part.name != ".ready":
            (venv / part.name).symlink_to(part)
    (venv / ".ready").touch()
