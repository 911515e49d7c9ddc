"""A published folder: read by the libraries that people use, without a network, and checked."""

import json
import runpy
import shutil
import socket
import subprocess
from pathlib import Path

import mlcroissant
import numpy as np
import pytest
import torch
from rerun.chunk import RrdReader

from pipeline.artifacts.checksums import SUMS, verify_folder
from pipeline.errors import ArtifactError, MachineError
from pipeline.execution import RunFolder
from pipeline.interchange.hub import check_room
from pipeline.messages.samples import read_split
from stages.publish import publish, publish_run


@pytest.fixture(autouse=True)
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever connects to another machine fails."""

    def refuse(*_: object) -> None:
        raise OSError("there is no network here")

    monkeypatch.setattr(socket, "getaddrinfo", refuse)
    monkeypatch.setattr(socket.socket, "connect", refuse)


@pytest.fixture(scope="module")
def published(run: RunFolder, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run's folder, moved away from the run."""
    folder = tmp_path_factory.mktemp("published")
    publish(run.path.name, folder / "here", run.path.parent)
    (folder / "here").rename(folder / "elsewhere")
    return folder / "elsewhere"


@pytest.fixture
def own(published: Path, tmp_path: Path) -> Path:
    """A copy to damage."""
    shutil.copytree(published, tmp_path / "own")
    return tmp_path / "own"


def test_pytorch_loads_all_samples(published: Path, capsys: pytest.CaptureFixture[str]) -> None:
    loaded = runpy.run_path(str(published / "load_pytorch.py"))
    train = read_split(published / "shards.mcap", "train")
    assert torch.equal(loaded["q"], torch.tensor(train.quality))
    assert len(loaded["cloud"]) == len(train)


def test_hugging_face_datasets_loads_the_preview(
    published: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    monkeypatch.setenv("HF_DATASETS_CACHE", str(tmp_path))
    preview = runpy.run_path(str(published / "load_datasets.py"))["preview"]
    train = read_split(published / "shards.mcap", "train")
    assert set(preview) == {"train", "val", "test"}
    assert len(preview["train"]) == min(len(train), 1000)
    first = preview["train"][0]
    assert first["quality"] == pytest.approx(float(train.quality[0]))
    np.testing.assert_allclose(first["cloud"], train.cloud[0].ravel().astype(float))


def test_rerun_loads_the_recording(published: Path) -> None:
    runpy.run_path(str(published / "load_rerun.py"))
    assert any(True for _ in RrdReader(published / "shards.rrd").stream())


def test_every_example_has_five_lines_of_code(published: Path) -> None:
    for path in published.glob("load_*.py"):
        code = [line for line in path.read_text().splitlines() if not line.startswith('"""')]
        assert len(code) <= 6
        assert path.read_text() in (published / "README.md").read_text()


def test_croissant_is_valid_and_reads_the_samples(published: Path) -> None:
    dataset = mlcroissant.Dataset(jsonld=str(published / "croissant.json"))
    assert not dataset.metadata.ctx.issues.errors
    record = next(iter(dataset.records("samples_val")))
    val = read_split(published / "shards.mcap", "val")
    assert record["samples_val/quality"] == pytest.approx(float(val.quality[0]))


def test_the_card_tells_licence_size_and_splits(published: Path) -> None:
    card = (published / "README.md").read_text()
    assert card.startswith("---\n")
    assert "Apache-2.0, with softgrip" in card
    assert "path: preview/test.parquet" in card
    assert "Apache-2.0" in (published / "LICENSE").read_text()
    assert json.loads((published / "croissant.json").read_text())["license"]


def test_checksums_are_those_of_sha256sum(published: Path) -> None:
    done = subprocess.run(
        ["sha256sum", "--quiet", "--check", SUMS], cwd=published, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stdout
    assert not [found for found in verify_folder(published) if found.problem]


def test_verify_names_the_first_file_that_differs(own: Path) -> None:
    with (own / "objects.mcap").open("r+b") as file:
        file.seek(100)
        file.write(b"\0\0\0\0")
    (own / "LICENSE").unlink()
    (own / "stray").touch()
    problems = [found for found in verify_folder(own) if found.problem]
    assert [found.path.name for found in problems] == ["LICENSE", "objects.mcap", "stray"]
    assert problems[0].problem.startswith("missing")
    assert problems[1].problem.startswith("changed")


@pytest.mark.parametrize("text", ["nonsense", "0" * 64 + "  ../../etc/passwd", "0" * 63 + "  a"])
def test_a_damaged_list_is_told(own: Path, text: str) -> None:
    (own / SUMS).write_text(text + "\n")
    with pytest.raises(ArtifactError, match="SHA256SUMS is damaged"):
        list(verify_folder(own))


def test_a_folder_that_is_not_published_is_told(tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match="has no SHA256SUMS"):
        list(verify_folder(tmp_path))


def test_a_disk_too_small_is_told_before_anything_is_written(
    run: RunFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda place: usage._replace(free=1000))
    with pytest.raises(MachineError, match="MB free, and publishing takes"):
        publish_run(run, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_run_made_anew_replaces_what_was_published(run: RunFolder, own: Path) -> None:
    with (own / "objects.mcap").open("r+b") as file:  # of the same size, and another content
        file.seek(100)
        file.write(b"\0\0\0\0")
    former = own / "shards" / "train" / "00007-of-00008.mcap"
    former.write_bytes(b"of another making")
    publish_run(run, own)
    assert (own / "objects.mcap").read_bytes() == run.artifact("objects").read_bytes()
    assert not former.exists()
    assert not [found for found in verify_folder(own) if found.problem]


def test_enough_room_is_no_error(tmp_path: Path) -> None:
    check_room(tmp_path / "not" / "there", 1)


def test_a_run_without_a_dataset_is_told(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    with pytest.raises(ArtifactError, match=r"objects.mcap is missing.*make dataset RUN=one"):
        publish("one", None, tmp_path)
