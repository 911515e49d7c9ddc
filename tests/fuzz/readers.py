"""The readers that take bytes from outside: whatever they are given, they read it or say why not.

Each takes any bytes and returns; a SoftgripError is an answer, any other exception is a finding.
The first byte says how the rest is taken, so that a checksum does not shield what lies behind it.
"""

import json
import tempfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from google.protobuf.message import Message
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from pipeline.artifacts import ArtifactWriter, Provenance, from_tensor, open_artifact, to_tensor
from pipeline.artifacts.bounds import FOOTER, MAGIC
from pipeline.artifacts.inspection import read_contents, verify_files
from pipeline.config import ObjectsConfig, load_run_config
from pipeline.config.grasps import CELL_SIDE
from pipeline.errors import SoftgripError
from pipeline.geometry.mesh_files import load_mesh_file
from pipeline.geometry.mesh_folders import MESH_SUFFIXES
from pipeline.geometry.urdf_files import load_object_file
from pipeline.labelling.grasps import GraspOrigin, LabelledGrasps
from pipeline.messages.clouds import cloud_batch, clouds_of
from pipeline.messages.grasps import grasp_batch, grasps_of
from pipeline.messages.objects import object_of
from pipeline.messages.samples import sample_batch, samples_of
from pipeline.messages.training import CHECKPOINT, EXPORT
from pipeline.network.checkpoint import _digest, load_checkpoint_bytes
from pipeline.network.control_inference import ControlPredictor
from pipeline.network.samples import Samples
from schemas.softgrip.v1.clouds_pb2 import CloudBatch
from schemas.softgrip.v1.grasps_pb2 import GraspBatch, ShardIndex
from schemas.softgrip.v1.objects_pb2 import CatalogueObject
from schemas.softgrip.v1.samples_pb2 import SampleBatch
from tests.geometry.corpus import corpus_cases, urdf_cases

ROOT = Path(__file__).resolve().parents[2]
PROVENANCE = Provenance("objects", "k", "c", "d", 7, (), "0.1.0")
LARGEST_SEED = 100_000  # bytes: what is larger is read too slowly to be tried often
FEW_FACES = ObjectsConfig(max_faces=10_000)
NOTE = "note.txt"
MESSAGES: tuple[type[Message], ...] = (
    *(CatalogueObject, SampleBatch, GraspBatch, ShardIndex),
    CloudBatch,
)


def read_mesh(data: bytes) -> None:
    """A mesh file; the first byte chooses its suffix."""
    suffix = MESH_SUFFIXES[data[0] % len(MESH_SUFFIXES)] if data else MESH_SUFFIXES[0]
    with _folder() as folder:
        path = folder / f"mesh{suffix}"
        path.write_bytes(data[1:])
        load_mesh_file(path, folder, "mesh", FEW_FACES)


def read_urdf(data: bytes) -> None:
    """A URDF beside a mesh that it may place."""
    with _folder() as folder:
        for name, held in urdf_cases.MESH.items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(held)
        path = folder / "thing.urdf"
        path.write_bytes(data)
        load_object_file(path, folder, "thing", FEW_FACES)


def read_toml(data: bytes) -> None:
    """A run.toml."""
    with _folder() as folder:
        path = folder / "run.toml"
        path.write_bytes(data)
        load_run_config(path)


def read_mcap(data: bytes) -> None:
    """An artifact as it is, with its index's checksum made right, or the bytes of one message."""
    way, data = (data[0] % (2 + len(MESSAGES)), data[1:]) if data else (0, data)
    with _folder() as folder:
        path = folder / "any.mcap"
        if way >= 2:
            write_raw_message(path, MESSAGES[way - 2], data)
        else:
            path.write_bytes(with_index_checksum(data) if way == 1 else data)
            list(verify_files(path, None))
            read_contents(path)
        with open_artifact(path) as artifact:
            for _, message in artifact.messages(CatalogueObject):
                object_of(message)
            for _, samples in artifact.messages(SampleBatch):
                samples_of(samples)
            for _, grasps in artifact.messages(GraspBatch):
                grasps_of(grasps)
            for _, clouds in artifact.messages(CloudBatch):
                clouds_of(clouds)
            for _, index in artifact.messages(ShardIndex):
                from_tensor(index.quality_histogram)
            if NOTE in artifact.attachment_sizes():
                artifact.attachment(NOTE)


def read_checkpoint(data: bytes) -> None:
    """A checkpoint as it is, one with its digest made right, or an exported network."""
    way, data = (data[0] % 3, data[1:]) if data else (0, data)
    if way == 2:
        ControlPredictor(data, threads=1)
    else:
        load_checkpoint_bytes(with_payload_digest(data) if way == 1 else data)


def mesh_seeds() -> Iterator[bytes]:
    """Every way of writing a mesh that the corpus has, in one file each."""
    for case in corpus_cases():
        suffix = Path(case.name).suffix.lower()
        small = len(case.data) <= LARGEST_SEED and not case.beside
        if case.solid is not None and small and suffix in MESH_SUFFIXES:
            yield bytes([MESH_SUFFIXES.index(suffix)]) + case.data


def urdf_seeds() -> Iterator[bytes]:
    """The URDF files of the corpus that are read wherever they lie."""
    for case in urdf_cases.cases():
        if case.solid is not None and b"{folder}" not in case.data:
            yield case.data


def toml_seeds() -> Iterator[bytes]:
    """The runs there are."""
    for path in sorted(ROOT.glob("runs/*/run.toml")):
        yield path.read_bytes()


def mcap_seeds() -> Iterator[bytes]:
    """A small artifact of every compression, and a message of every kind."""
    rng = np.random.default_rng(0)
    item = CatalogueObject(
        name="o", nsvr=2.2, shape_class="basic", unit_origin="declared", material="opaque"
    )
    item.mesh.vertices_m.CopyFrom(to_tensor(rng.normal(size=(4, 3))))
    item.mesh.faces.CopyFrom(to_tensor(np.array([[0, 1, 2]], dtype=np.uint32)))
    item.inertia_kg_m2.CopyFrom(to_tensor(np.eye(3)))
    index = ShardIndex(quality_histogram=to_tensor(np.arange(10)))
    batches = (item, sample_batch(_samples(rng), ("a",)), _grasps(rng), index, _clouds(rng))
    for way in (0, 1):
        for compression in ("zstd", "lz4", "none"):
            with _folder() as folder:
                path = folder / "a.mcap"
                with ArtifactWriter(path, PROVENANCE, compression) as artifact:
                    artifact.write("/any", item, log_time_ns=0)
                    artifact.attach(NOTE, "text/plain", b"hello")
                yield bytes([way]) + path.read_bytes()
    for way, message in enumerate(batches, start=2):
        yield bytes([way]) + message.SerializeToString()


def checkpoint_seeds() -> Iterator[bytes]:
    """A small network, as a checkpoint and exported."""
    with open_artifact(ROOT / "tests/artifacts/released/v1-0.1.0/train.mcap") as artifact:
        data, exported = artifact.attachment(CHECKPOINT), artifact.attachment(EXPORT)
    yield from (b"\0" + data, b"\1" + data, b"\2" + exported)


def with_index_checksum(data: bytes) -> bytes:
    """The file with the checksum of its index made right: what an attacker would do."""
    footer_at = len(data) - FOOTER.size - len(MAGIC)
    if footer_at < 0:
        return data
    opcode, length, start, offsets, _ = FOOTER.unpack_from(data, footer_at)
    end = footer_at + FOOTER.size - 4
    crc = zlib.crc32(data[start:end])
    return data[:footer_at] + FOOTER.pack(opcode, length, start, offsets, crc) + MAGIC


def with_payload_digest(data: bytes) -> bytes:
    """A checkpoint with its SHA-256 made right."""
    try:
        length = int.from_bytes(data[:8], "little")
        entries, payload = json.loads(data[8 : 8 + length]), data[8 + length :]
        marks = entries["__metadata__"]
        marks.pop("sha256", None)
        marks["sha256"] = _digest(entries, payload)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return data
    header = json.dumps(entries).encode()
    return len(header).to_bytes(8, "little") + header + payload


def write_raw_message(path: Path, kind: type[Message], data: bytes) -> None:
    """An artifact, whole by every checksum, of one message of any bytes."""
    with path.open("wb") as file:
        writer = Writer(file, enable_data_crcs=True)
        writer.start()
        writer.add_metadata("provenance", PROVENANCE.to_metadata())
        channel = writer.register_channel("/any", "protobuf", register_schema(writer, kind))
        writer.add_message(channel, log_time=0, data=data, publish_time=0)
        writer.finish()


@contextmanager
def _folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="fuzz") as scratch:
        yield Path(scratch)


def _samples(rng: np.random.Generator) -> Samples:
    return Samples(
        cloud=rng.normal(size=(2, 3, 3, 3)),
        cloud_mask=np.ones((2, 3, 3), dtype=bool),
        quality=rng.random(2),
        object_index=np.zeros(2, dtype=np.int64),
        shape_class=np.zeros(2, dtype=np.int64),
        level=np.ones(2, dtype=np.int64),
        pressure=rng.random(2),
        proposal_weight=rng.random(2),
        pictures=np.ones(2, dtype=np.int64),
    )


def _clouds(rng: np.random.Generator) -> CloudBatch:
    """One cloud in steps."""
    middles = (np.arange(3) - 1) * CELL_SIDE
    cloud = np.stack([*np.meshgrid(middles, middles), rng.normal(size=(3, 3))], axis=-1)[None]
    return cloud_batch(cloud, np.ones((1, 3, 3), dtype=bool), rounded=True)


def _grasps(rng: np.random.Generator) -> GraspBatch:
    whole, real = np.zeros(2, dtype=np.int64), rng.random(2)
    origin = GraspOrigin("s", "static_0", 1, "train", ("a",), ("Fx",), ("solved",), ("n",))
    grasps = LabelledGrasps(
        object_index=whole,
        body_id=whole,
        world_from_gripper=rng.random((2, 4, 4)),
        quality=real,
        pressure=real,
        wrench=rng.random((2, 4)),
        limit_slack=rng.random((2, 8)),
        weight_summary=rng.random((2, 3)),
        contact_mask=np.ones((2, 9), dtype=bool),
        status=whole.astype(np.uint8),
        iterations=whole,
        tilt_rad=real,
        proposal=whole,
        keep_probability=real,
        cloud=rng.random((2, 3, 3, 3)),
        cloud_mask=np.ones((2, 3, 3), dtype=bool),
        touch_height_m=real,
        pictures=np.ones(2, dtype=np.int64),
    )
    return grasp_batch(origin, grasps)


def read_any(data: bytes) -> None:
    """By the first byte, one of the others: all of them searched by one process."""
    if data:
        read, _ = KINDS[data[0] % len(KINDS)]
        read(data[1:])


def any_seeds() -> Iterator[bytes]:
    """All of the others'."""
    for number, (_, seeds) in enumerate(KINDS):
        yield from (bytes([number]) + data for data in seeds())


def answered(read: Callable[[bytes], None], data: bytes) -> str:
    """What a reader says of some bytes: its error in words, or that it read them."""
    try:
        read(data)
    except SoftgripError as error:
        return str(error)
    return "read"


Reader = tuple[Callable[[bytes], None], Callable[[], Iterator[bytes]]]
READERS: dict[str, Reader] = {
    "mesh": (read_mesh, mesh_seeds),
    "toml": (read_toml, toml_seeds),
    "mcap": (read_mcap, mcap_seeds),
    "checkpoint": (read_checkpoint, checkpoint_seeds),
    "urdf": (read_urdf, urdf_seeds),
}
KINDS = tuple(READERS.values())
READERS["any"] = (read_any, any_seeds)
