"""Memory and processor time of a run's dataset, stage by stage: of drivers and of their workers.

python -m pipeline.benchmarks.watching RUN watched.jsonl
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer

from pipeline.execution import run_command

DATASET = ("objects", "scenes", "grasps", "shards")
KIB = 1024  # bytes in what the kernel writes as kB
MIB = 2**20  # bytes, as the prefix says


@dataclass(frozen=True)
class Sample:
    """What a stage held at one time.

    Attributes
    ----------
    stage
        Its name.
    t_s
        Since the first stage began [s].
    driver_mib
        Resident memory of the stage's own process [MiB].
    largest_worker_mib
        Of the largest process among those it started [MiB]; 0: there is none.
    all_mib
        Of all of them; pages that two share are counted twice [MiB].
    processes
        How many there are.
    """

    stage: str
    t_s: float
    driver_mib: float
    largest_worker_mib: float
    all_mib: float
    processes: int


@dataclass(frozen=True)
class Spent:
    """What a finished stage took.

    Attributes
    ----------
    stage
        Its name.
    wall_s
        By the clock [s].
    processor_s
        Of its process and of all that it waited for [s].
    peak_process_mib
        Of the largest process, as the kernel kept it [MiB].
    """

    stage: str
    wall_s: float
    processor_s: float
    peak_process_mib: float


def watch(
    run: Annotated[str, typer.Argument(help="name of the run")],
    into: Annotated[Path, typer.Argument(help="file that gets a line a sample, JSON")],
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = Path("runs"),
    interval_s: Annotated[float, typer.Option(min=0.05, help="between samples [s]")] = 2.0,
) -> None:
    """Make a run's dataset stage by stage, and write down what each holds and takes."""
    began = time.monotonic()
    with into.open("w") as lines:
        for stage in DATASET:
            command = [sys.executable, "-m", f"stages.{stage}"]
            command += ["--run", run, "--runs-dir", str(runs_dir)]
            for found in watched(stage, command, began, interval_s):
                lines.write(json.dumps(asdict(found)) + "\n")
                lines.flush()


def watched(
    stage: str, command: list[str], began: float, interval_s: float
) -> Iterator[Sample | Spent]:
    """Run one command and look at its processes again and again.

    Parameters
    ----------
    stage
        Name under which samples are told.
    command
        What to run.
    began
        Time that samples are counted from, of the monotonic clock [s].
    interval_s
        Between two looks [s].

    Yields
    ------
    Sample | Spent
        Each look, and at the end what it took.

    Raises
    ------
    SystemExit
        The command failed.
    """
    started = time.monotonic()
    process = subprocess.Popen(command)
    while True:
        ended, status, used = os.wait4(process.pid, os.WNOHANG)
        if ended:
            break
        held = {pid: resident_mib(pid) for pid in family(process.pid)}
        driver = held.pop(process.pid, 0.0)
        yield Sample(
            stage,
            round(time.monotonic() - began, 1),
            round(driver, 1),
            round(max(held.values(), default=0.0), 1),
            round(driver + sum(held.values()), 1),
            1 + len(held),
        )
        time.sleep(interval_s)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(process.returncode)
    yield Spent(
        stage,
        round(time.monotonic() - started, 1),
        round(used.ru_utime + used.ru_stime, 1),
        round(used.ru_maxrss * KIB / MIB, 1),
    )


def family(root: int) -> set[int]:
    """Numbers of a process and of all that it started, and those started in turn."""
    parents: dict[int, int] = {}
    for entry in os.scandir("/proc"):
        if entry.name.isdigit():
            try:
                text = Path(entry.path, "stat").read_text()
            except (FileNotFoundError, ProcessLookupError):
                continue  # it ended meanwhile
            # The name before the last bracket may hold spaces and brackets itself.
            parents[int(entry.name)] = int(text.rpartition(")")[2].split()[1])
    found, added = {root}, {root}
    while added:
        added = {pid for pid, parent in parents.items() if parent in added} - found
        found |= added
    return found


def resident_mib(pid: int) -> float:
    """Resident memory of a process [MiB]; 0 where it has ended."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / MIB


if __name__ == "__main__":
    run_command(watch)
