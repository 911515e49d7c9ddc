"""Catalogue objects ↔ softgrip.v1.CatalogueObject."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import cast, get_args

import numpy as np

from pipeline.artifacts import ArtifactWriter, Provenance
from pipeline.artifacts.names import file_name
from pipeline.artifacts.reading import open_artifact
from pipeline.artifacts.tensors import set_tensors, tensors_of, to_tensor
from pipeline.errors import ArtifactError, ContentError, MeshError
from pipeline.geometry.catalogue import CatalogueObject, Material
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.shape import ShapeClass
from pipeline.geometry.units import UnitSource
from schemas.softgrip.v1 import objects_pb2

TOPIC = "/objects"
REFUSED_TOPIC = "/refused"
MESH_STORED_AS = {"vertices_m": "f8", "faces": "u4"}
INERTIA, STRETCH = {"inertia_kg_m2": "f8"}, {"stretch": "f8"}


def refused_message(label: str, error: MeshError) -> objects_pb2.RefusedMesh:
    """The message of a source that did not become an object."""
    return objects_pb2.RefusedMesh(source=label, reason=error.what, remedy=error.remedy)


def object_message(item: CatalogueObject, split: str) -> objects_pb2.CatalogueObject:
    """The message of one object."""
    return objects_pb2.CatalogueObject(
        key=item.key,
        name=item.name,
        split=split,
        source=item.source,
        source_sha256=item.source_sha256,
        unit=item.unit,
        unit_origin=item.unit_known_by,
        repairs=item.repairs,
        scale=item.scale,
        stretch=None if np.all(item.stretch == 1.0) else to_tensor(item.stretch),
        extent_m=item.target_extent_m,
        area_m2=item.area_m2,
        volume_m3=item.volume_m3,
        nsvr=item.nsvr,
        shape_class=item.shape_class,
        mass_kg=item.mass_kg,
        inertia_kg_m2=to_tensor(item.inertia_kg_m2),
        mesh=_mesh_message(item.mesh),
        convex_parts=[_mesh_message(part) for part in item.convex_parts],
        material=item.material,
        family=item.family,
        copies=item.copies,
    )


def write_objects(
    path: Path,
    provenance: Provenance,
    objects: Sequence[CatalogueObject],
    split: Mapping[str, str],
    refused: Sequence[objects_pb2.RefusedMesh],
) -> None:
    """Write a catalogue: its objects with their splits, and the meshes that became none."""
    with ArtifactWriter(path, provenance) as artifact:
        for index, item in enumerate(objects):
            artifact.write(TOPIC, object_message(item, split[item.name]), log_time_ns=index)
        for index, message in enumerate(refused):
            artifact.write(REFUSED_TOPIC, message, log_time_ns=index)


def object_of(message: objects_pb2.CatalogueObject) -> CatalogueObject:
    """The object of a message.

    Parameters
    ----------
    message
        Of stage objects.

    Returns
    -------
    The catalogue entry.

    Raises
    ------
    ContentError
        A word in it is none of those that its field knows, a tensor has another shape, a mesh is
        none, or its name is no file's.
    """
    name = file_name(message.name)
    for field, known in (
        ("shape_class", set(ShapeClass)),
        ("unit_origin", get_args(UnitSource)),
        ("material", get_args(Material)),
    ):
        if getattr(message, field) not in known:
            raise ContentError(f"'{name}' has {field} '{getattr(message, field)}'")
    stretch = tensors_of(message, STRETCH, {"stretch": "3"}, {"stretch": 1.0})["stretch"]
    return CatalogueObject(
        name=name,
        source=message.source,
        source_sha256=message.source_sha256,
        unit=message.unit,
        unit_known_by=cast(UnitSource, message.unit_origin),
        repairs=tuple(message.repairs),
        scale=message.scale,
        stretch=stretch,
        target_extent_m=message.extent_m,
        area_m2=message.area_m2,
        volume_m3=message.volume_m3,
        nsvr=message.nsvr,
        shape_class=ShapeClass(message.shape_class),
        mass_kg=message.mass_kg,
        centre_of_mass_m=np.zeros(3),
        inertia_kg_m2=tensors_of(message, INERTIA, {"inertia_kg_m2": "3 3"})["inertia_kg_m2"],
        mesh=_mesh(message.mesh),
        convex_parts=tuple(_mesh(part) for part in message.convex_parts),
        material=cast(Material, message.material),
        family=message.family,
        copies=tuple(message.copies),
        key=message.key,
    )


def read_objects(path: Path) -> dict[str, tuple[CatalogueObject, str]]:
    """Name → (object, split) of an objects artifact."""
    with open_artifact(path) as artifact:
        return {
            message.name: (object_of(message), message.split)
            for _, message in artifact.messages(objects_pb2.CatalogueObject)
        }


def objects_by_key(path: Path) -> dict[str, CatalogueObject]:
    """Key → object of an artifact; none where it is not there or cannot be read."""
    try:
        found = [item for item, _ in read_objects(path).values()]
    except ArtifactError:
        return {}  # made anew, all of it
    return {item.key: item for item in found if item.key}


def catalogue(path: Path) -> dict[str, tuple[CatalogueObject, str]]:
    """What `read_objects` reads, once a process as long as the file stays."""
    status = path.stat()
    return _catalogue(path, status.st_ino, status.st_mtime_ns)


@lru_cache(maxsize=1)
def _catalogue(path: Path, inode: int, time_ns: int) -> dict[str, tuple[CatalogueObject, str]]:
    return read_objects(path)


def _mesh_message(mesh: Mesh) -> objects_pb2.TriangleMesh:
    message = objects_pb2.TriangleMesh()
    set_tensors(message, vars(mesh), MESH_STORED_AS)
    return message


def _mesh(message: objects_pb2.TriangleMesh) -> Mesh:
    arrays = tensors_of(message, MESH_STORED_AS, {"vertices_m": "n 3", "faces": "m 3"})
    vertices, faces = arrays["vertices_m"], arrays["faces"].astype(np.int64)
    if faces.max(initial=-1) >= len(vertices):
        raise ContentError("A mesh has faces that refer to vertices it does not have")
    return Mesh(vertices, faces)
