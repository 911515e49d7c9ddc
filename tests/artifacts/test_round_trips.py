"""Every message type, with anything in its fields, comes back from a file as it went in."""

import importlib
from dataclasses import fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf.descriptor import Descriptor, FieldDescriptor
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.spatial.transform import Rotation

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact, to_tensor
from pipeline.artifacts.sharding import shard_entry
from pipeline.artifacts.tensors import DTYPES
from pipeline.errors import ArtifactError
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.shape import ShapeClass
from pipeline.messages.clouds import cloud_batch
from pipeline.messages.objects import object_message, object_of, read_objects
from pipeline.messages.samples import STORED_AS, sample_batch, samples_of
from pipeline.messages.scenes import (
    read_record,
    read_scene,
    read_unseen_scenes,
    scene_places,
    write_scene,
    write_scene_index,
)
from pipeline.network.samples import Samples
from pipeline.world.cameras import PinholeCamera
from pipeline.world.scene import ClutterScene, PlacedObject
from pipeline.world.view import CameraView
from schemas.compatibility import ROOT, versions
from schemas.softgrip.v1 import objects_pb2, samples_pb2
from schemas.softgrip.v1.clouds_pb2 import CloudBatch

# One file a draw: a few draws a type are many in all.
few = settings(
    max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
Drawn = dict[int, st.SearchStrategy[Any]]

SCALARS: Drawn = {
    FieldDescriptor.TYPE_DOUBLE: st.floats(),
    FieldDescriptor.TYPE_FLOAT: st.floats(width=32),
    FieldDescriptor.TYPE_UINT32: st.integers(0, 2**32 - 1),
    FieldDescriptor.TYPE_UINT64: st.integers(0, 2**64 - 1),
    FieldDescriptor.TYPE_INT32: st.integers(-(2**31), 2**31 - 1),
    FieldDescriptor.TYPE_INT64: st.integers(-(2**63), 2**63 - 1),
    FieldDescriptor.TYPE_BOOL: st.booleans(),
    FieldDescriptor.TYPE_STRING: st.text(max_size=20),
    FieldDescriptor.TYPE_BYTES: st.binary(max_size=40),
}


def message_types() -> list[type[Message]]:
    """Every top-level message of every version."""
    found = []
    for version in versions():
        for source in sorted(version.glob("*.proto")):
            name = ".".join([*version.relative_to(ROOT).parts, f"{source.stem}_pb2"])
            module = importlib.import_module(name)
            found += [GetMessageClass(m) for m in module.DESCRIPTOR.message_types_by_name.values()]
    return found


def tensors() -> st.SearchStrategy[Message]:
    shapes = hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3)
    return st.builds(
        to_tensor, st.sampled_from(DTYPES).flatmap(lambda d: hnp.arrays(np.dtype(d), shapes))
    )


@cache
def messages(descriptor: Descriptor) -> st.SearchStrategy[Message]:
    """Any message of a type: each field left out or filled."""
    if descriptor.full_name.endswith(".Tensor"):
        return tensors()
    kind = GetMessageClass(descriptor)
    optional = {field.name: values_of(field) for field in descriptor.fields}
    return st.fixed_dictionaries({}, optional=optional).map(lambda drawn: kind(**drawn))


def values_of(field: FieldDescriptor) -> st.SearchStrategy[Any]:
    """Any value of a field."""
    nested = field.message_type
    if nested is not None and nested.GetOptions().map_entry:
        keys, values = (values_of(nested.fields_by_name[name]) for name in ("key", "value"))
        return st.dictionaries(keys, values, max_size=3)
    one = SCALARS[field.type] if nested is None else messages(nested)
    return st.lists(one, max_size=3) if field.is_repeated else one


@pytest.mark.parametrize("kind", message_types(), ids=lambda kind: kind.DESCRIPTOR.name)
@few
@given(data=st.data())
def test_every_message_round_trips(
    tmp_path: Path, provenance: Provenance, kind: type[Message], data: st.DataObject
) -> None:
    sent = data.draw(st.lists(messages(kind.DESCRIPTOR), min_size=1, max_size=3))
    path = tmp_path / "any.mcap"
    with ArtifactWriter(path, provenance) as artifact:
        for index, message in enumerate(sent):
            artifact.write("/any", message, log_time_ns=index)
    with open_artifact(path) as artifact:
        back = list(artifact.messages(kind))
    assert [at for at, _ in back] == list(range(len(sent)))
    for (_, now), then in zip(back, sent, strict=True):
        # As bytes, since a NaN equals nothing.
        assert now.SerializeToString(deterministic=True) == then.SerializeToString(
            deterministic=True
        )


def same(now: Any, then: Any) -> None:
    """Two values of the product's dataclasses hold the same, bit for bit."""
    if is_dataclass(then):
        for field in fields(then):
            same(getattr(now, field.name), getattr(then, field.name))
    elif isinstance(then, np.ndarray):
        np.testing.assert_array_equal(now, then)
    elif isinstance(then, tuple):
        assert len(now) == len(then)
        for a, b in zip(now, then, strict=True):
            same(a, b)
    else:
        assert now == then


def meshes(rng: np.random.Generator, vertices: int) -> Mesh:
    return Mesh(rng.normal(size=(vertices, 3)), rng.integers(0, vertices, (2 * vertices, 3)))


@few
@given(seed=st.integers(0, 2**32 - 1), parts=st.integers(0, 3), vertices=st.integers(1, 30))
def test_catalogue_objects_round_trip(
    tmp_path: Path, provenance: Provenance, seed: int, parts: int, vertices: int
) -> None:
    rng = np.random.default_rng(seed)
    item = CatalogueObject(
        name=f"o{seed}",
        source="a.ply",
        source_sha256="00",
        unit="mm",
        unit_known_by="detected",
        repairs=("holes",) * parts,
        scale=rng.random(),
        stretch=rng.random(3) if parts else np.ones(3),
        target_extent_m=rng.random(),
        area_m2=rng.random(),
        volume_m3=rng.random(),
        nsvr=rng.random(),
        shape_class=ShapeClass.TYPICAL,
        mass_kg=rng.random(),
        centre_of_mass_m=np.zeros(3),
        inertia_kg_m2=rng.random((3, 3)),
        mesh=meshes(rng, vertices),
        convex_parts=tuple(meshes(rng, vertices) for _ in range(parts)),
        material="opaque",
    )
    wire = object_message(item, "test").SerializeToString()
    same(object_of(objects_pb2.CatalogueObject.FromString(wire)), item)
    with ArtifactWriter(tmp_path / "o.mcap", provenance) as artifact:
        artifact.write("/objects", object_message(item, "test"), log_time_ns=0)
    back, split = read_objects(tmp_path / "o.mcap")[item.name]
    same(back, item)
    assert split == "test"


@few
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 9), side=st.integers(1, 5))
def test_samples_round_trip_in_any_number(seed: int, count: int, side: int) -> None:
    rng = np.random.default_rng(seed)
    samples = Samples(
        cloud=rng.normal(size=(count, side, side, 3)).astype(np.float16),
        cloud_mask=rng.random((count, side, side)) < 0.5,
        quality=rng.random(count).astype(np.float32),
        object_index=rng.integers(0, 2**16, count),
        shape_class=rng.integers(0, 3, count),
        level=rng.integers(1, 10, count),
        pressure=rng.random(count).astype(np.float32),
        proposal_weight=rng.random(count).astype(np.float32),
        pictures=rng.integers(1, 4, count),
    )
    wire = sample_batch(samples, ("a", "b")).SerializeToString()
    clouds = cloud_batch(samples.cloud, samples.cloud_mask, rounded=False).SerializeToString()
    message, beside = samples_pb2.SampleBatch.FromString(wire), CloudBatch.FromString(clouds)
    same(samples_of(message, beside), samples)
    assert set(STORED_AS) == {field.name for field in fields(Samples)}


def rigid(rng: np.random.Generator) -> np.ndarray:
    """A pose in SE(3)."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(rng=rng).as_matrix()
    pose[:3, 3] = rng.normal(size=3)
    return pose


def a_view(rng: np.random.Generator, number: int, behind: bool) -> CameraView:
    height, width = (int(n) for n in rng.integers(1, 9, 2))
    depth = rng.random((height, width)).astype(np.float32)
    return CameraView(
        camera=PinholeCamera(
            name=f"static_{number}",
            width_px=width,
            height_px=height,
            intrinsics=rng.random((3, 3)),
            world_from_camera=np.eye(4),
            sensor="lidar",
            near_m=0.25,
            far_m=9.0,
        ),
        depth_m=depth,
        colour=rng.integers(0, 256, (height, width, 3)).astype(np.uint8),
        segmentation=rng.integers(0, 9, (height, width)).astype(np.uint16),
        normals=rng.integers(0, 256, (height, width, 3)).astype(np.uint8),
        behind_m=depth + 1 if behind else None,
    )


@few
@given(
    seed=st.integers(0, 2**32 - 1),
    objects=st.integers(1, 4),
    views=st.integers(0, 3),
    behind=st.booleans(),
)
def test_scenes_round_trip_with_their_images(
    tmp_path: Path, provenance: Provenance, seed: int, objects: int, views: int, behind: bool
) -> None:
    rng = np.random.default_rng(seed)
    scenes = [
        ClutterScene(
            scene_id=f"s{number}",
            level=3,
            split="test",
            seed=seed,
            objects=tuple(PlacedObject(f"o{i}", i + 1, rigid(rng)) for i in range(objects)),
            gaps_m=rng.random(objects),
            contacts=((1, 2),) if objects > 1 else (),
            settle_time_s=rng.random(),
            views=tuple(a_view(rng, i, behind) for i in range(views)),
        )
        for number in range(2)
    ]
    path = tmp_path / "scenes.mcap"
    with ArtifactWriter(path, provenance) as artifact:
        for index, scene in enumerate(scenes):
            write_scene(artifact, index, scene, "embree")
    for index, scene in enumerate(scenes):
        same(read_scene(path, index), scene)
    assert scene_places(path) == [(path, 0), (path, 1)]  # of an older version: all in one file


def test_scenes_in_files_of_their_own_are_read_by_their_index(
    tmp_path: Path, provenance: Provenance
) -> None:
    rng = np.random.default_rng(5)
    path, placed = tmp_path / "scenes.mcap", (PlacedObject("o", 1, rigid(rng)),)
    files = [tmp_path / "scenes" / f"{name}.mcap" for name in ("a", "b", "stray")]
    scenes = [
        ClutterScene(f"s{n}", 3, "val", n, placed, np.ones(1), (), 0.5, (a_view(rng, n, False),))
        for n in range(3)
    ]
    for file, scene in zip(files, scenes, strict=True):
        with ArtifactWriter(file, provenance) as artifact:
            write_scene(artifact, 0, scene, "embree")
    kept = files[:2]
    entries = [shard_entry(file, tmp_path, 1, "val") for file in kept]
    write_scene_index(path, provenance, [read_record(file) for file in kept], entries)
    assert not files[2].exists()
    assert scene_places(path) == [(file, 0) for file in kept]
    for index, scene in enumerate(scenes[:2]):
        same(read_scene(path, index), scene)
        same(read_scene(*scene_places(path)[index]), scene)
    for found, scene in zip(read_unseen_scenes(path), scenes, strict=False):
        same(found, replace(scene, views=()))
    with pytest.raises(ArtifactError, match="holds no scene 2"):
        read_scene(path, 2)
    kept[1].unlink()
    same(read_scene(path, 0), scenes[0])  # of the others nothing is read
    with pytest.raises(ArtifactError, match=r"b\.mcap is missing"):
        read_scene(path, 1)
