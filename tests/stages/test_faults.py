"""What goes wrong around a stage: no half file, a sentence with file and remedy, the same bytes.

Each fault is real: a disk of a few hundred KiB, a file system mounted read-only, signals, files
taken away. Where mounting is not allowed the tests that need it are skipped.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

import pytest

from pipeline.artifacts import open_artifact
from pipeline.execution import RunFolder
from stages.graph import STAGES
from tests.stages.conftest import ROOT, run_stage, with_convex_parts
from tests.stages.test_pipeline import digests

FAILURE, INTERRUPTED = 1, 130
# Room for what a stage reads and a little more, not for what it writes.
LITTLE_BYTES = 40 << 10
PAGE_BYTES = 4096
# Stages that go on after a full disk in these tests; the others cost more and do the same.
RESUMED = ("grasps", "shards")


@contextmanager
def mounted(folder: Path, size_bytes: int) -> Iterator[Path]:
    """A file system of its own in memory, of this size."""
    folder.mkdir()
    made = mount("-t", "tmpfs", "-o", f"size={size_bytes}", "tmpfs", str(folder))
    if made.returncode != 0:
        pytest.skip(f"mounting is not allowed here: {made.stderr.strip()}")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", folder], check=True)


def mount(*words: str) -> subprocess.CompletedProcess[str]:
    if shutil.which("mount") is None:
        pytest.skip("there is no mount command")
    return subprocess.run(["mount", *words], capture_output=True, text=True, check=False)


def before(run: RunFolder, stage: str, runs: Path) -> RunFolder:
    """The run as it was when a stage was about to start."""
    folder = RunFolder(runs / run.path.name)
    folder.path.mkdir(parents=True)
    shutil.copy(run.config, folder.config)
    for name in STAGES[stage].upstream:
        shutil.copy(run.artifact(name), folder.artifact(name))
        if STAGES[name].sharded:
            shutil.copytree(run.shards(name), folder.shards(name))
    return folder


def size_of(folder: Path) -> int:
    """What the files take where each begins on a page of its own."""
    sizes = [path.stat().st_size for path in folder.rglob("*") if path.is_file()]
    return sum(-(-size // PAGE_BYTES) * PAGE_BYTES for size in sizes)


def of_stage(run: RunFolder, stage: str) -> dict[str, str]:
    """SHA-256 of what one stage made."""
    return {
        name: digest
        for name, digest in digests(run).items()
        if name == f"{stage}.mcap" or name.startswith(f"{stage}/")
    }


def assert_nothing_half(folder: RunFolder, stage: str) -> None:
    assert not folder.artifact(stage).exists()
    assert not list(folder.path.rglob(".*.part"))
    for path in folder.path.rglob("*.mcap"):
        with open_artifact(path) as artifact:
            artifact.check()


def assert_explained(done: subprocess.CompletedProcess[str], *words: str) -> None:
    assert done.returncode == FAILURE, done.stderr[-3000:]
    assert "Traceback" not in done.stderr, done.stderr[-3000:]
    lines = done.stderr.splitlines()  # a progress bar or Rerun may have the last word
    assert any(all(word in line for word in words) for line in lines), done.stderr[-3000:]


@pytest.mark.parametrize("stage", STAGES)
def test_a_full_disk(run: RunFolder, tmp_path: Path, stage: str) -> None:
    """It is named, nothing half is published, and with room the same command goes on."""
    small, ready = tmp_path / "small", tmp_path / "ready"
    before(run, stage, ready)
    with_convex_parts(run, ready)
    size = size_of(ready) + LITTLE_BYTES
    with mounted(small, size):
        shutil.copytree(ready, small, dirs_exist_ok=True)
        folder = RunFolder(small / run.path.name)
        assert_explained(run_stage(stage, small, workers=1), "the disk is full", "Free some space")
        assert_nothing_half(folder, stage)
        if stage not in RESUMED:
            return
        assert mount("-o", f"remount,size={size + (1 << 30)}", str(small)).returncode == 0
        done = run_stage(stage, small, workers=1)
        assert done.returncode == 0, done.stderr[-3000:]
        assert of_stage(folder, stage) == of_stage(run, stage)


def test_a_folder_that_cannot_be_written(run: RunFolder, tmp_path: Path) -> None:
    """Mounted read-only, which stops root as well."""
    place = tmp_path / "place"
    with mounted(place, 1 << 30):
        before(run, "shards", place)
        assert mount("-o", "remount,ro", str(place)).returncode == 0
        done = run_stage("shards", place, workers=1)
        assert_explained(done, str(place), "Read-only file system", "writable")
        assert mount("-o", "remount,rw", str(place)).returncode == 0
        assert run_stage("shards", place, workers=1).returncode == 0


def test_a_missing_shard_is_named_and_then_made_alone(run: RunFolder, tmp_path: Path) -> None:
    folder = before(run, "shards", tmp_path)
    shutil.copy(run.artifact("objects"), folder.artifact("objects"))
    shutil.copy(run.artifact("scenes"), folder.artifact("scenes"))
    shutil.copytree(run.shards("scenes"), folder.shards("scenes"))
    shards = sorted(folder.shards("grasps").glob("*.mcap"))
    kept = shards[0].stat().st_mtime_ns
    shards[1].unlink()
    done = run_stage("shards", tmp_path, workers=1)
    assert_explained(done, f"{shards[1].name} is missing", "Run the stage that makes it again")
    assert run_stage("grasps", tmp_path, workers=1).returncode == 0
    assert of_stage(folder, "grasps") == of_stage(run, "grasps")
    assert shards[0].stat().st_mtime_ns == kept
    assert run_stage("shards", tmp_path, workers=1).returncode == 0


def test_a_damaged_input_is_named(run: RunFolder, tmp_path: Path) -> None:
    folder = before(run, "grasps", tmp_path)
    scene = min(folder.shards("scenes").glob("*.mcap"))
    data = bytearray(scene.read_bytes())
    data[len(data) // 2] ^= 4
    scene.write_bytes(data)
    done = run_stage("grasps", tmp_path, workers=1)
    assert_explained(done, f"{scene} is damaged", "Delete it")
    assert_nothing_half_of_grasps(folder)


def assert_nothing_half_of_grasps(folder: RunFolder) -> None:
    assert not folder.artifact("grasps").exists()
    assert not list(folder.path.rglob(".*.part"))


def started(stage: str, runs: Path, workers: int) -> subprocess.Popen[str]:
    hidden = ("MESH_DIR", "RUN", "WORKERS")
    return subprocess.Popen(
        [
            *(sys.executable, "-m", f"stages.{stage}", "--run", "tiny"),
            *("--runs-dir", str(runs), "--workers", str(workers)),
        ],
        cwd=ROOT,
        env={name: value for name, value in os.environ.items() if name not in hidden},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # A shell starts what it puts in the background deaf to SIGINT.
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
    )


def wait_until(process: subprocess.Popen[str], there: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 300
    while not there():
        assert process.poll() is None, process.stderr.read() if process.stderr else ""
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.mark.parametrize("stage", STAGES)
def test_interrupted_as_from_a_keyboard(run: RunFolder, tmp_path: Path, stage: str) -> None:
    """The whole group gets SIGINT, as from a terminal, while the stage holds its run."""
    folder = before(run, stage, tmp_path)
    process = started(stage, tmp_path, workers=2)
    wait_until(process, folder.state("owner").exists)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=120)
    # Python ends by the signal itself where it was executing a string, as checks of shapes do when
    # a function is first called; its user sees 130 either way.
    assert process.returncode in (INTERRUPTED, -signal.SIGINT), said[-3000:]
    assert "interrupted. What is finished is kept: run the same command to go on" in said
    assert "Traceback" not in said
    assert_nothing_half(folder, stage)


def test_a_second_process_is_told_who_holds_the_run(run: RunFolder, tmp_path: Path) -> None:
    """The first is paused meanwhile: it might else be done before the second has looked."""
    folder = before(run, "train", tmp_path)
    first = started("train", tmp_path, workers=1)
    wait_until(first, folder.state("owner").exists)
    os.killpg(first.pid, signal.SIGSTOP)
    second = run_stage("train", tmp_path, workers=1)
    os.killpg(first.pid, signal.SIGCONT)
    assert_explained(
        second, f"in use by process {first.pid} (stage train)", "Wait until it is done"
    )
    os.killpg(first.pid, signal.SIGINT)
    first.communicate(timeout=120)


@pytest.mark.parametrize("stage", ["grasps", "evaluate"])
def test_a_worker_killed_for_its_memory(run: RunFolder, tmp_path: Path, stage: str) -> None:
    """SIGKILL to one worker is what the kernel's out-of-memory killer does."""
    folder = before(run, stage, tmp_path)
    process = started(stage, tmp_path, workers=2)
    # Both are there: concurrent.futures trips over a worker that starts while another dies.
    wait_until(process, lambda: len(workers_of(process.pid)) == 2)
    os.kill(workers_of(process.pid)[0], signal.SIGKILL)
    _, said = process.communicate(timeout=300)
    done = subprocess.CompletedProcess(process.args, process.returncode, "", said)
    assert_explained(done, "A worker process died", "WORKERS=1")
    assert not folder.artifact(stage).exists()
    assert not list(folder.path.rglob(".*.part"))


def workers_of(pid: int) -> list[int]:
    """Spawned worker processes, resource trackers left out.

    A process may end between two looks at /proc; one that did is no worker any more.
    """
    found = []
    with suppress(FileNotFoundError, ProcessLookupError):
        for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            with suppress(FileNotFoundError, ProcessLookupError):
                if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes():
                    found.append(int(child))
    return found
