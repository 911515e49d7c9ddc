"""What we write is MCAP by the book: readers in other languages agree on all of it."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.artifacts import ArtifactWriter, Provenance, to_tensor
from pipeline.artifacts.writing import Compression
from schemas.softgrip.v1.objects_pb2 import CatalogueObject, RefusedMesh
from tests.artifacts.readers import by_node, by_us


def write(path: Path, provenance: Provenance, compression: Compression) -> None:
    rng = np.random.default_rng(0)
    with ArtifactWriter(path, provenance, compression) as artifact:
        for i in range(40):
            message = CatalogueObject(name=f"o{i}", nsvr=2.2, repairs=["holes", "normals"])
            message.mesh.vertices_m.CopyFrom(to_tensor(rng.normal(size=(3000, 3))))
            artifact.write("/objects", message, log_time_ns=i)
        artifact.write("/refused", RefusedMesh(source="a", reason="two bodies"), log_time_ns=40)
        artifact.attach("weights.bin", "application/octet-stream", rng.bytes(5000))


@pytest.mark.parametrize("compression", ["zstd", "lz4", "none"])
def test_typescript_agrees(
    tmp_path: Path, provenance: Provenance, compression: Compression
) -> None:
    path = tmp_path / "objects.mcap"
    write(path, provenance, compression)
    assert by_node([path]) == [by_us(path)]


def test_typescript_refuses_what_we_refuse(tmp_path: Path, provenance: Provenance) -> None:
    """So that its agreement above means something."""
    path = tmp_path / "objects.mcap"
    write(path, provenance, "zstd")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    (found,) = by_node([path])
    assert "error" in found
