"""What a command and its workers hold is seen while they run, and drawn."""

import json
import sys
import time
from dataclasses import asdict
from pathlib import Path

import pytest

from pipeline.benchmarks.memory_picture import (
    POINTS,
    highest_of_each,
    memory_picture,
    read_watched,
    table,
)
from pipeline.benchmarks.watching import Sample, Spent, watched

HELD_MIB = 64
# A driver that holds little, and a worker of its own that holds more until it has been seen.
WORKER = f"held = b'x' * ({HELD_MIB} << 20); print('held', flush=True); input()"
DRIVER = f"""
import pathlib, subprocess, sys, time
worker = subprocess.Popen(
    [sys.executable, "-c", {WORKER!r}], stdin=subprocess.PIPE, stdout=subprocess.PIPE
)
worker.stdout.readline()
while not pathlib.Path(sys.argv[1]).exists():
    time.sleep(0.01)
worker.communicate(b"\\n")
"""


def test_a_worker_s_memory_and_time_are_its_stage_s(tmp_path: Path) -> None:
    seen, looks = tmp_path / "seen", list[Sample]()
    command = [sys.executable, "-c", DRIVER, str(seen)]
    for found in watched("held", command, time.monotonic(), 0.05):
        if isinstance(found, Spent):
            spent = found
            break
        looks.append(found)
        if found.largest_worker_mib > HELD_MIB:
            seen.touch()
    assert max(sample.largest_worker_mib for sample in looks) > HELD_MIB
    assert 0 < max(sample.driver_mib for sample in looks) < HELD_MIB
    assert max(sample.processes for sample in looks) == 2
    assert spent.peak_process_mib > HELD_MIB
    assert spent.processor_s > 0


def test_a_command_that_fails_ends_the_watching() -> None:
    with pytest.raises(SystemExit, match="3"):
        list(watched("fails", [sys.executable, "-c", "raise SystemExit(3)"], 0.0, 0.05))


def test_the_picture_keeps_peaks_and_the_table_says_them(tmp_path: Path) -> None:
    looks = [Sample("grasps", float(t), 100.0, 200.0, 300.0, 2) for t in range(3 * POINTS)]
    looks[7] = Sample("grasps", 7.0, 100.0, 900.0, 1000.0, 2)
    shown = highest_of_each(looks)
    assert len(shown) == POINTS
    assert max(sample.largest_worker_mib for sample in shown) == 900.0
    written = tmp_path / "watched.jsonl"
    spent = Spent("grasps", 12.0, 20.0, 900.0)
    written.write_text(
        "".join(json.dumps(row) + "\n" for row in [*map(asdict, looks), asdict(spent)])
    )
    assert read_watched(written) == (looks, [spent])
    assert "| grasps | 12 | 20 | 100, 900 |" in table(looks, [spent])
    assert "</svg>" in memory_picture(looks)
