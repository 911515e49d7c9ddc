"""Every stage's file is opened by readers in other languages than ours, and by what people use."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.execution import RunFolder
from tests.artifacts.readers import TIMEOUT_S, by_node, by_us


@pytest.fixture(scope="module")
def stage_files(run: RunFolder) -> list[Path]:
    """Every artifact of the run, shards included."""
    return sorted(run.path.rglob("*.mcap"))


def test_every_stage_reads_alike_in_typescript(stage_files: list[Path]) -> None:
    assert by_node(stage_files) == [by_us(path) for path in stage_files]


def test_rust_finds_nothing_wrong(stage_files: list[Path]) -> None:
    """Rerun's own check of structure, and its conversion: what its viewer does to open a file."""
    rerun = Path(sys.executable).with_name("rerun")
    for path in stage_files:
        checked = subprocess.run(
            [rerun, "mcap", "check", path],
            capture_output=True,
            text=True,
            check=False,
            timeout=TIMEOUT_S,
        )
        assert checked.returncode == 0, f"{path.name}: {checked.stdout}{checked.stderr}"


def test_go_doctor_finds_nothing_wrong(stage_files: list[Path]) -> None:
    mcap = shutil.which("mcap")
    if mcap is None:
        pytest.skip("the mcap command line is not installed: see 'make doctor'")
    for path in stage_files:
        said = subprocess.run(
            [mcap, "doctor", path], capture_output=True, text=True, check=False, timeout=TIMEOUT_S
        )
        assert said.returncode == 0, said.stderr
