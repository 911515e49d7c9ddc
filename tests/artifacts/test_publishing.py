"""Scratch files: one a writer, hidden, short enough, and removed once their writer has ended."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pipeline.artifacts import publishing
from pipeline.artifacts.publishing import (
    ABANDONED_AFTER_S,
    publish_bytes,
    published,
    remove_abandoned_scratch,
    scratch_beside,
)

WRITE_AND_DIE = """
import os, signal, sys
from pathlib import Path
from pipeline.artifacts.publishing import published
with published(Path(sys.argv[1])) as scratch:
    scratch.write_bytes(b"half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_two_writers_of_one_file_share_no_scratch(tmp_path: Path) -> None:
    path = tmp_path / "x.bin"
    with published(path) as first:
        first.write_bytes(b"first")
        with published(path) as second:
            second.write_bytes(b"second")
            assert first.read_bytes() == b"first"
        assert path.read_bytes() == b"second"
    assert path.read_bytes() == b"first"
    assert [file.name for file in tmp_path.iterdir()] == ["x.bin"]


def test_a_scratch_is_hidden_and_its_name_fits_whatever_the_files(tmp_path: Path) -> None:
    for name in ("x.bin", "x" * 250 + ".mcap", "ü" * 125 + ".obj"):
        scratch = scratch_beside(tmp_path / name)
        scratch.touch()
        assert scratch.name.startswith(".")
        publish_bytes(tmp_path / name, b"whole")


def test_what_is_being_written_stays(tmp_path: Path) -> None:
    with published(tmp_path / "x.bin") as scratch:
        scratch.write_bytes(b"some")
        os.utime(scratch, (1, 1))  # however long ago: its writer lives
        assert remove_abandoned_scratch(tmp_path) == []
    assert (tmp_path / "x.bin").read_bytes() == b"some"


def test_what_a_killed_writer_left_goes_and_what_stood_there_stays(tmp_path: Path) -> None:
    path = tmp_path / "shards" / "x.bin"
    publish_bytes(path, b"before")
    killed = subprocess.run([sys.executable, "-c", WRITE_AND_DIE, path], check=False)
    assert killed.returncode < 0
    (left,) = path.parent.glob(".*.part")
    assert left.read_bytes() == b"half"
    assert remove_abandoned_scratch(tmp_path) == [left]
    assert [file.name for file in path.parent.iterdir()] == ["x.bin"]
    assert path.read_bytes() == b"before"


def test_a_number_that_another_process_has_now_does_not_keep_it(tmp_path: Path) -> None:
    mine = scratch_beside(tmp_path / "x.bin")
    machine, pid, start, token = mine.name.removesuffix(".part").rpartition(".")[2].split("-")
    earlier = tmp_path / f".x.bin.{machine}-{pid}-{int(start) - 1}-{token}.part"
    for file in (mine, earlier):
        file.touch()
    assert remove_abandoned_scratch(tmp_path) == [earlier]


def test_another_machines_goes_only_when_nobody_wrote_to_it_for_a_day(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(publishing, "_machine", lambda: "0123abcd")
        busy, left = scratch_beside(tmp_path / "busy"), scratch_beside(tmp_path / "left")
    nameless = tmp_path / ".old.part"  # as earlier versions named them
    for file in (busy, left, nameless):
        file.touch()
    long_ago = time.time() - ABANDONED_AFTER_S - 60
    os.utime(left, (long_ago, long_ago))
    assert remove_abandoned_scratch(tmp_path) == [left]
    assert busy.exists()
    assert nameless.exists()


def test_an_abandoned_scratch_folder_goes_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = scratch_beside(tmp_path / "train")
    left.mkdir()
    (left / "cloud.npy").write_bytes(b"half")
    monkeypatch.setattr(publishing, "_start_of", lambda pid: 0)
    assert remove_abandoned_scratch(tmp_path) == [left]
    assert not left.exists()
