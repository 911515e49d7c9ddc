"""An artifact is whole, checked and deterministic, or it is refused in words."""

import errno
from pathlib import Path

import numpy as np
import pytest

from pipeline.artifacts import (
    ArtifactWriter,
    Provenance,
    open_artifact,
    publish_bytes,
    published,
    read_provenance,
    to_tensor,
)
from pipeline.errors import ArtifactError
from schemas.softgrip.v1.objects_pb2 import CatalogueObject, RefusedMesh


def write_objects(path: Path, provenance: Provenance, count: int = 3) -> None:
    rng = np.random.default_rng(0)
    with ArtifactWriter(path, provenance) as artifact:
        for i in range(count):
            message = CatalogueObject(name=f"o{i}", nsvr=2.2)
            message.mesh.vertices_m.CopyFrom(to_tensor(rng.normal(size=(500, 3))))
            artifact.write("/objects", message, log_time_ns=i)
        artifact.attach("note.txt", "text/plain", b"hello")


def read_names(path: Path) -> list[str]:
    with open_artifact(path) as artifact:
        return [message.name for _, message in artifact.messages(CatalogueObject)]


def test_what_was_written_is_read(tmp_path: Path, provenance: Provenance) -> None:
    path = tmp_path / "objects.mcap"
    write_objects(path, provenance)
    assert read_names(path) == ["o0", "o1", "o2"]
    with open_artifact(path) as artifact:
        assert artifact.provenance == provenance
        assert artifact.attachment("note.txt") == b"hello"
        assert artifact.counts() == {"/objects": ("softgrip.v1.CatalogueObject", 3)}


def test_equal_content_is_equal_bytes(tmp_path: Path, provenance: Provenance) -> None:
    write_objects(tmp_path / "a.mcap", provenance)
    write_objects(tmp_path / "b.mcap", provenance)
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_a_failing_writer_leaves_what_stood_there(tmp_path: Path, provenance: Provenance) -> None:
    path = tmp_path / "objects.mcap"
    write_objects(path, provenance)
    before = path.read_bytes()

    def broken() -> None:
        with ArtifactWriter(path, provenance) as artifact:
            artifact.write("/objects", CatalogueObject(name="half"), log_time_ns=0)
            raise RuntimeError("power cut")

    with pytest.raises(RuntimeError, match="power cut"):
        broken()
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_topic_keeps_its_type(tmp_path: Path, provenance: Provenance) -> None:
    with ArtifactWriter(tmp_path / "x.mcap", provenance) as artifact:
        artifact.write("/objects", CatalogueObject(), log_time_ns=0)
        with pytest.raises(ArtifactError, match=r"carries softgrip.v1.Catalogue.*RefusedMesh"):
            artifact.write("/objects", RefusedMesh(), log_time_ns=1)


@pytest.mark.parametrize("kept", [0.0, 0.1, 0.5, 0.9, 0.99])
def test_a_cut_file_is_named(tmp_path: Path, provenance: Provenance, kept: float) -> None:
    path = tmp_path / "objects.mcap"
    write_objects(path, provenance)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * kept)])
    with pytest.raises(ArtifactError, match=r"objects\.mcap is damaged"):
        read_names(path)


def test_a_flipped_bit_in_the_data_is_named(tmp_path: Path, provenance: Provenance) -> None:
    path = tmp_path / "objects.mcap"
    write_objects(path, provenance)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(bytes(data))
    with pytest.raises(ArtifactError, match=r"objects\.mcap is damaged"):
        read_names(path)


def test_another_schema_version_is_refused_naming_both(
    tmp_path: Path, provenance: Provenance
) -> None:
    import dataclasses

    path = tmp_path / "objects.mcap"
    write_objects(path, dataclasses.replace(provenance, schema_version="softgrip.v9"))
    with pytest.raises(ArtifactError, match=r"softgrip\.v9.*reads softgrip\.v1"):
        read_provenance(path)


def test_absent_and_foreign_files_say_so(tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match=r"no\.mcap does not exist"):
        read_provenance(tmp_path / "no.mcap")
    foreign = tmp_path / "page.mcap"
    foreign.write_text("<html>not found</html>")
    with pytest.raises(ArtifactError, match=r"page\.mcap is damaged"):
        read_provenance(foreign)


def test_a_full_disk_is_named_and_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "x.bin"

    def fill() -> None:
        with published(path) as scratch:
            scratch.write_bytes(b"some")
            raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(ArtifactError, match="the disk is full"):
        fill()
    assert list(tmp_path.iterdir()) == []


def test_publishing_replaces_whole(tmp_path: Path) -> None:
    path = tmp_path / "sub" / "x.bin"
    publish_bytes(path, b"one")
    publish_bytes(path, b"two")
    assert path.read_bytes() == b"two"
    assert [p.name for p in path.parent.iterdir()] == ["x.bin"]
