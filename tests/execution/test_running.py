"""A stage's command: runs when stale, says why it failed, leaves nothing half, lets one at it."""

import json
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from pipeline.execution import RunFolder
from pipeline.execution.sealing import seal

ROOT = Path(__file__).resolve().parents[2]
FAILURE, INTERRUPTED = 1, 130


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of a run named ``tiny``."""
    folder = tmp_path / "tiny"
    folder.mkdir()
    (folder / "run.toml").write_text("seed = 1\n")
    return folder


def command(folder: Path, *more: str) -> list[str]:
    module = "tests.execution.counting_stage"
    return [
        sys.executable,
        "-m",
        module,
        "--run",
        folder.name,
        "--runs-dir",
        str(folder.parent),
        *more,
    ]


def run(folder: Path, *more: str, mood: str = "") -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "MOOD": mood}
    return subprocess.run(
        command(folder, *more),
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def times_run(folder: Path) -> int:
    return len((folder / "runs.txt").read_text())


def test_a_second_run_does_nothing_and_says_so(folder: Path) -> None:
    assert run(folder).returncode == 0
    again = run(folder)
    assert again.returncode == 0
    assert "counting: up to date, nothing to do" in again.stderr
    assert times_run(folder) == 1
    assert run(folder, "--force").returncode == 0
    assert times_run(folder) == 2


def test_what_a_check_costs_is_told_as_a_share_of_the_whole_process(folder: Path) -> None:
    before = os.times()
    assert run(folder).returncode == 0
    after = os.times()
    spent_s = after.children_user + after.children_system
    spent_s -= before.children_user + before.children_system
    told = json.loads((folder / "counting.summary.json").read_text())
    assert told["expectations_s"] > 0.0
    # Less than all, for a process that has told its shares still ends; a stage alone is a tenth.
    assert 0.3 < told["expectations_s"] / told["expectations_share"] / spent_s < 1.2


def test_a_stage_of_a_sealed_run_stays_as_it_is_though_everything_changed(folder: Path) -> None:
    """Make calls it where the run came without its bookkeeping; by force it says why not."""
    artifact = folder / "counting.mcap"
    artifact.write_bytes(b"made elsewhere, by another version")
    seal(RunFolder(folder))
    (folder / "run.toml").write_text("seed = 2\n")
    before = artifact.stat()
    left = run(folder, mood="explained")
    assert left.returncode == 0, left.stderr
    assert "counting: " in left.stderr
    assert "is sealed, and stays as it is" in left.stderr
    forced = run(folder, "--force")
    assert forced.returncode == FAILURE
    assert "make unseal RUN=tiny" in forced.stderr
    assert artifact.stat().st_mtime_ns == before.st_mtime_ns
    assert not (folder / "runs.txt").exists()


def test_only_configuration_it_reads_makes_it_stale(folder: Path) -> None:
    run(folder)
    (folder / "run.toml").write_text("# new words\nseed = 1\n[scenes]\nlevels = [3]\n")
    run(folder)
    assert times_run(folder) == 1
    (folder / "run.toml").write_text("seed = 1\n[train]\nepochs = 3\n")
    run(folder)
    assert times_run(folder) == 2


def test_a_damaged_artifact_is_made_again(folder: Path) -> None:
    run(folder)
    artifact = folder / "counting.mcap"
    whole = artifact.read_bytes()
    artifact.write_bytes(whole[:50])
    run(folder)
    assert artifact.read_bytes() == whole


def test_the_summary_tells_time_and_figures(folder: Path) -> None:
    run(folder)
    summary = json.loads((folder / "counting.summary.json").read_text())
    assert summary["count"] == 1
    assert summary["wall_time_s"] >= 0


def test_an_explained_failure_is_one_sentence(folder: Path) -> None:
    failed = run(folder, mood="explained")
    assert failed.returncode == FAILURE
    assert failed.stderr.splitlines()[-1] == "counting: The cup is empty. Fill it"
    assert not (folder / "counting.mcap").exists()


def test_a_surprise_is_one_sentence_with_its_trace_in_the_log(folder: Path) -> None:
    failed = run(folder, mood="surprised")
    assert failed.returncode == FAILURE
    assert "unexpected ZeroDivisionError: by zero" in failed.stderr
    assert "Traceback" not in failed.stderr
    assert "Traceback" in (folder / "logs" / "counting.log").read_text()


def test_a_typo_in_run_toml_is_one_sentence(folder: Path) -> None:
    (folder / "run.toml").write_text("sede = 1\n")
    failed = run(folder)
    assert failed.returncode == FAILURE
    assert "unknown key 'sede'. Did you mean 'seed'?" in failed.stderr


def test_an_absent_run_is_one_sentence(folder: Path) -> None:
    failed = run(folder.with_name("none"))
    assert failed.returncode == FAILURE
    assert "does not exist" in failed.stderr
    assert not folder.with_name("none").exists()


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_two_at_once_and_an_interrupt(folder: Path, stop: signal.Signals) -> None:
    first = subprocess.Popen(
        command(folder),
        cwd=ROOT,
        env={**os.environ, "MOOD": "slow"},
        stderr=subprocess.PIPE,
        text=True,
        # A shell starts what it puts in the background deaf to SIGINT.
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 120  # far more than a start takes
    while not (folder / ".state" / "slow").exists():
        assert time.monotonic() < deadline
        assert first.poll() is None
        time.sleep(0.05)
    second = run(folder)
    assert second.returncode == FAILURE
    assert f"is in use by process {first.pid} (stage counting)" in second.stderr
    first.send_signal(stop)
    _, said = first.communicate(timeout=120)
    assert first.returncode == INTERRUPTED
    assert "interrupted. What is finished is kept" in said
    assert not (folder / "counting.mcap").exists()
    assert run(folder).returncode == 0
