"""Nothing damaged or hostile is ever read as if it were whole."""

import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact, to_tensor
from pipeline.artifacts.bounds import CHUNK_HEAD, FOOTER, MAGIC
from pipeline.artifacts.writing import Compression
from pipeline.errors import ArtifactError
from schemas.softgrip.v1.objects_pb2 import CatalogueObject
from tests.refusals import assert_refused_cheaply

BLOCK = 4096
TERABYTE = 1 << 40


def write_objects(
    path: Path, provenance: Provenance, vertices: int, compression: Compression = "zstd"
) -> None:
    rng = np.random.default_rng(0)
    with ArtifactWriter(path, provenance, compression) as artifact:
        for i in range(2):
            message = CatalogueObject(name=f"o{i}", nsvr=2.2)
            message.mesh.vertices_m.CopyFrom(to_tensor(rng.normal(size=(vertices, 3))))
            artifact.write("/objects", message, log_time_ns=i)
        artifact.attach("note.txt", "text/plain", b"hello")


def everything_in(path: Path) -> tuple[object, ...]:
    """All that a stage could ever take from the file."""
    with open_artifact(path) as artifact:
        messages = [(at, m.SerializeToString()) for at, m in artifact.messages(CatalogueObject)]
        return artifact.provenance, artifact.counts(), messages, artifact.attachment("note.txt")


def checked(path: Path) -> None:
    with open_artifact(path) as artifact:
        artifact.check()


@pytest.mark.parametrize("compression", ["zstd", "lz4", "none"])
def test_a_flipped_bit_anywhere_is_refused_or_without_effect(
    tmp_path: Path, provenance: Provenance, compression: Compression
) -> None:
    """Data, index, metadata, schema, attachment, header, footer: every part of the file."""
    path = tmp_path / "objects.mcap"
    write_objects(path, provenance, 3, compression)
    whole, data = everything_in(path), path.read_bytes()
    for at in range(0, len(data), 3 if compression == "zstd" else 7):
        flipped = bytearray(data)
        flipped[at] ^= 1 << (at % 8)
        path.write_bytes(flipped)
        try:
            assert everything_in(path) == whole, f"byte {at} of {len(data)}"
        except ArtifactError as error:
            assert "objects.mcap" in error.what  # noqa: PT017 - either outcome is right
        with pytest.raises(ArtifactError, match=r"objects\.mcap"):
            checked(path)


def test_a_file_cut_at_any_block_is_refused(tmp_path: Path, provenance: Provenance) -> None:
    path = tmp_path / "objects.mcap"
    write_objects(path, provenance, 10_000)
    data = path.read_bytes()
    assert len(data) > 50 * BLOCK
    for length in range(0, len(data), BLOCK):
        path.write_bytes(data[:length])
        with pytest.raises(ArtifactError, match=r"objects\.mcap is damaged"):
            everything_in(path)


def with_index_checksum(data: bytes) -> bytes:
    """The file with the checksum of its index made right: what an attacker would do."""
    footer_at = len(data) - FOOTER.size - len(MAGIC)
    opcode, length, start, offsets, _ = FOOTER.unpack_from(data, footer_at)
    end = footer_at + FOOTER.size - 4
    crc = zlib.crc32(data[start:end])
    return data[:footer_at] + FOOTER.pack(opcode, length, start, offsets, crc) + MAGIC


def chunk_at(data: bytes) -> int:
    """Offset of the first chunk record."""
    at = len(MAGIC)
    while data[at] != 0x06:
        (length,) = struct.unpack_from("<Q", data, at + 1)
        at += 9 + length
    return at


def declared_by_a_chunk(data: bytes) -> bytes:
    at = chunk_at(data)
    fields = list(CHUNK_HEAD.unpack_from(data, at))
    fields[4] = TERABYTE
    return data[:at] + CHUNK_HEAD.pack(*fields) + data[at + CHUNK_HEAD.size :]


def declared_by_a_chunk_record(data: bytes) -> bytes:
    at = chunk_at(data)
    return data[: at + 1] + struct.pack("<Q", TERABYTE) + data[at + 9 :]


def declared_by_a_frame(data: bytes) -> bytes:
    """A zstd frame whose own header says 1 TB."""
    at = data.index(b"\x28\xb5\x2f\xfd")
    frame = b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", TERABYTE)
    return data[:at] + frame + data[at + len(frame) :]


def declared_by_the_metadata(data: bytes) -> bytes:
    """The string lengths of the provenance record."""
    at = data.index(b"provenance") - 4
    return data[:at] + struct.pack("<I", 0xFFFFFFFF) + data[at + 4 :]


def declared_by_an_attachment(data: bytes) -> bytes:
    at = data.index(b"text/plain") + len("text/plain")
    return data[:at] + struct.pack("<Q", TERABYTE) + data[at + 8 :]


def declared_by_the_index(data: bytes) -> bytes:
    """Every record length of the index, the first one a terabyte."""
    footer_at = len(data) - FOOTER.size - len(MAGIC)
    start = FOOTER.unpack_from(data, footer_at)[2]
    return data[: start + 1] + struct.pack("<Q", TERABYTE) + data[start + 9 :]


def declared_by_the_footer(data: bytes) -> bytes:
    footer_at = len(data) - FOOTER.size - len(MAGIC)
    return data[: footer_at + 9] + struct.pack("<Q", TERABYTE) + data[footer_at + 17 :]


LIES = (
    declared_by_a_chunk,
    declared_by_a_chunk_record,
    declared_by_a_frame,
    declared_by_the_metadata,
    declared_by_an_attachment,
    declared_by_the_index,
    declared_by_the_footer,
)


def test_a_small_file_that_declares_a_terabyte_costs_nothing(
    tmp_path: Path, provenance: Provenance
) -> None:
    path = tmp_path / "honest.mcap"
    write_objects(path, provenance, 3)
    data = path.read_bytes()
    hostile = []
    for lie in LIES:
        hostile.append(tmp_path / f"{lie.__name__}.mcap")
        hostile[-1].write_bytes(with_index_checksum(lie(data)))
    assert_refused_cheaply(everything_in, [path], hostile)


def test_a_file_without_an_index_is_not_read_unchecked(
    tmp_path: Path, provenance: Provenance
) -> None:
    """The library reads such a file from front to back and checks no checksum on its way."""
    path = tmp_path / "foreign.mcap"
    writers: list[Callable[[Path], Writer]] = [
        lambda p: Writer(str(p), use_summary_offsets=False, use_statistics=False),
        lambda p: Writer(str(p), compression=CompressionType.NONE, use_chunking=False),
        lambda p: Writer(str(p), enable_crcs=False),
    ]
    for made in writers:
        writer = made(path)
        writer.start()
        schema = writer.register_schema("softgrip.v1.CatalogueObject", "protobuf", b"")
        channel = writer.register_channel("/objects", "protobuf", schema)
        writer.add_metadata("provenance", provenance.to_metadata())
        writer.add_message(channel, 0, CatalogueObject(name="x").SerializeToString(), 0)
        writer.finish()
        with pytest.raises(ArtifactError, match=r"foreign\.mcap is damaged"):
            everything_in(path)


def test_a_message_that_readers_would_refuse_is_not_written(
    tmp_path: Path, provenance: Provenance, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.artifacts.writing.MOST_CHUNK_BYTES", 2 << 20)
    path = tmp_path / "objects.mcap"
    message = CatalogueObject()
    message.mesh.vertices_m.CopyFrom(to_tensor(np.zeros((1 << 17, 3))))
    said = r"objects\.mcap: a softgrip\.v1.*more than a reader"
    with ArtifactWriter(path, provenance) as artifact, pytest.raises(ArtifactError, match=said):
        artifact.write("/objects", message, log_time_ns=0)
