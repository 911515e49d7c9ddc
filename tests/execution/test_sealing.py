"""A sealed run is known by its files' digests, and nothing is made in it."""

from pathlib import Path

import pytest

from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from pipeline.execution.sealing import (
    broken_files,
    is_sealed,
    read_seal,
    refuse_sealed,
    seal,
    seal_path,
    unseal,
)


@pytest.fixture
def folder(tmp_path: Path) -> RunFolder:
    folder = RunFolder(tmp_path / "one")
    folder.shards("grasps").mkdir(parents=True)
    folder.config.write_text("seed = 1\n")
    folder.artifact("objects").write_bytes(b"objects")
    (folder.shards("grasps") / "0.mcap").write_bytes(b"grasps")
    folder.state("").mkdir()
    folder.state("lock").touch()
    return folder


def test_a_seal_lists_results_and_no_bookkeeping(folder: RunFolder) -> None:
    seal(folder)
    assert is_sealed(folder)
    assert set(read_seal(folder).files) == {"run.toml", "objects.mcap", "grasps/0.mcap"}
    assert broken_files(folder) == []


def test_what_differs_from_the_seal_is_named(folder: RunFolder) -> None:
    seal(folder)
    (folder.shards("grasps") / "0.mcap").write_bytes(b"others")
    folder.artifact("objects").unlink()
    changed, missing = broken_files(folder)
    assert "0.mcap: changed: SHA-256 was" in changed
    assert missing.endswith("objects.mcap: missing")


def test_nothing_is_made_in_a_sealed_run_nor_in_a_run_within_it(folder: RunFolder) -> None:
    refuse_sealed(folder)
    seal(folder)
    for place in (folder, RunFolder(folder.path / "holdout")):
        with pytest.raises(ArtifactError, match=r"one is sealed.*make unseal RUN=one"):
            refuse_sealed(place)
    unseal(folder)
    refuse_sealed(folder)


def test_an_empty_run_cannot_be_sealed(tmp_path: Path) -> None:
    (tmp_path / "none").mkdir()
    with pytest.raises(ArtifactError, match="holds no artifact"):
        seal(RunFolder(tmp_path / "none"))


def test_a_run_without_a_seal_says_how_to_get_one(folder: RunFolder) -> None:
    with pytest.raises(ArtifactError, match=r"is not sealed\. make seal RUN=one"):
        unseal(folder)


@pytest.mark.parametrize("text", ["{cut", "{}", '{"softgrip": "1", "files": {"a": 1}}', "[]"])
def test_a_damaged_seal_is_told(folder: RunFolder, text: str) -> None:
    seal_path(folder).write_text(text)
    with pytest.raises(ArtifactError, match="is damaged"):
        read_seal(folder)
