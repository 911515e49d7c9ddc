"""What we write is MCAP by the book: readers in other languages agree on all of it."""

from pathlib import Path

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass

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


def test_what_foxglove_would_not_show_is_named(tmp_path: Path, provenance: Provenance) -> None:
    """A list of bytes anywhere in a message, and fields that its schema does not know."""
    lists, unknown = tmp_path / "lists.mcap", tmp_path / "unknown.mcap"
    with ArtifactWriter(lists, provenance) as artifact:
        artifact.write("/any", message_with_a_list_of_bytes(), log_time_ns=0)
    with ArtifactWriter(unknown, provenance) as artifact:
        field_99 = b"\x98\x06\x01"
        artifact.write("/any", CatalogueObject.FromString(field_99), log_time_ns=0)
    said = [found["error"] for found in by_node([lists, unknown])]
    assert "parts is a list of bytes" in said[0]
    assert "CatalogueObject: not all of a message is known" in said[1]


def message_with_a_list_of_bytes() -> Message:
    file = FileDescriptorProto(name="parts.proto", package="made.up", syntax="proto3")
    outer = file.message_type.add(name="Outer")
    outer.nested_type.add(name="Inner").field.add(
        name="parts",
        number=1,
        label=FieldDescriptorProto.LABEL_REPEATED,
        type=FieldDescriptorProto.TYPE_BYTES,
    )
    outer.field.add(
        name="inner",
        number=1,
        label=FieldDescriptorProto.LABEL_OPTIONAL,
        type=FieldDescriptorProto.TYPE_MESSAGE,
        type_name=".made.up.Outer.Inner",
    )
    pool = DescriptorPool()
    pool.Add(file)
    return GetMessageClass(pool.FindMessageTypeByName("made.up.Outer"))()
