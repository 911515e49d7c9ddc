"""Reading mesh files: bounded, without following references, units declared or detected."""

import hashlib
import io
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import trimesh

from pipeline.config.objects import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.mesh_headers import check_face_count, check_faces_allowed, check_header

UnitSource = Literal["declared", "configured", "detected"]

_METRES_PER_UNIT = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
# Millimetres before centimetres: most tools for design write them.
_DETECTION_ORDER = ("m", "mm", "cm")
_UNIT_NAMES = {
    **{"meters": "m", "meter": "m", "metres": "m", "metre": "m", "m": "m"},
    **{"centimeters": "cm", "centimeter": "cm", "cm": "cm"},
    **{"millimeters": "mm", "millimeter": "mm", "mm": "mm"},
    **{"inches": "in", "inch": "in", "in": "in"},
}
# What a parser may raise on a damaged file, as seen on truncated, bit-flipped and fuzzed files.
_PARSER_ERRORS = (
    LookupError,
    ValueError,
    TypeError,
    AttributeError,
    NameError,
    RecursionError,
    ArithmeticError,
    AssertionError,
    RuntimeError,
    MemoryError,
    EOFError,
    struct.error,
)


@dataclass(frozen=True, eq=False)
class MeshSource:
    """A mesh as it came, in metres, and where it came from."""

    name: str
    """Name of the object: a slug, unique in its folder."""
    label: str
    """What a person calls the source: the file's path in its folder, or `parametric`."""
    sha256: str
    """Digest of the file's bytes; `parametric` for the embedded objects."""
    mesh: Mesh
    unit: str
    """Length unit of the source: m, cm, mm or in."""
    unit_known_by: UnitSource


def load_mesh_file(path: Path, folder: Path, name: str, config: ObjectsConfig) -> MeshSource:
    """One file's surface in metres, its scene's nodes merged into one mesh.

    Raises MeshError, naming the file and the reason, where the file leads out of the folder, is
    too large, no mesh, damaged, has no or too many faces, vertices that are not finite, indices
    out of range, or a size that no unit explains.
    """
    label = path.relative_to(folder).as_posix()
    raw, declared, data = read_raw_mesh(path, folder, config)
    unit, known_by = length_unit(label, float(raw.extents_m.max()), declared, config)
    mesh = Mesh(raw.vertices_m * _METRES_PER_UNIT[unit], raw.faces)
    return MeshSource(name, label, hashlib.sha256(data).hexdigest(), mesh, unit, known_by)


def read_raw_mesh(
    path: Path, folder: Path, config: ObjectsConfig
) -> tuple[Mesh, str | None, bytes]:
    """A file's checked surface in its own unit, the unit it declares, if any, and its bytes."""
    label = path.relative_to(folder).as_posix()
    if not path.resolve().is_relative_to(folder.resolve()):
        raise MeshError(f"{label} leads out of its folder", "Copy the mesh into the folder")
    mebibytes = path.stat().st_size / 2**20
    if mebibytes > config.max_file_mib:
        raise MeshError(
            f"{label} has {mebibytes:.0f} MiB, more than the {config.max_file_mib} allowed",
            "Simplify the mesh, or raise objects.max_file_mib",
        )
    data = path.read_bytes()
    check_header(label, data, config.max_faces)
    raw, declared = parse_mesh(label, data, config.max_faces)
    check_face_count(label, data, len(raw.faces))
    check_arrays(label, raw, config.max_faces)
    return raw, declared, data


def parse_mesh(label: str, data: bytes, max_faces: int) -> tuple[Mesh, str | None]:
    """The mesh in the file's own unit, and the unit it declares, if any.

    Nothing else is opened: material files and textures that the mesh refers to, or holds, stay
    unread.
    """
    suffix = Path(label).suffix.lower()
    options = {"skip_materials": True} if suffix in (".obj", ".ply", ".glb") else {}
    try:
        scene = trimesh.load_scene(
            io.BytesIO(data), file_type=suffix[1:], process=False, allow_remote=False, **options
        )
        # A part may be placed any number of times, and each time is a copy.
        placed = [scene.geometry[scene.graph[node][1]] for node in scene.graph.nodes_geometry]
        faces_placed = sum(len(getattr(part, "faces", ())) for part in placed)
        check_faces_allowed(label, faces_placed, max_faces)
        merged = scene.to_mesh()
        vertices = np.array(merged.vertices, dtype=np.float64).reshape(-1, 3)
        faces = np.array(merged.faces, dtype=np.int64).reshape(-1, 3)
    except _PARSER_ERRORS as error:
        reason = f"{type(error).__name__}: {error}".rstrip(": ")
        raise MeshError(
            f"{label} cannot be read as {suffix[1:].upper()} ({reason})",
            "Export the mesh again, or fetch the file again",
        ) from error
    units = "m" if suffix == ".glb" else _UNIT_NAMES.get(str(scene.units).lower())
    return Mesh(vertices, faces), units


def check_arrays(label: str, mesh: Mesh, max_faces: int) -> None:
    """Raise MeshError for no or too many faces, bad indices, or vertices that are not finite."""
    if len(mesh.faces) == 0 or len(mesh.vertices_m) == 0:
        raise MeshError(f"{label} has no faces", "A point cloud must be meshed first")
    if len(mesh.faces) > max_faces:
        raise MeshError(
            f"{label} has {len(mesh.faces)} faces, more than the {max_faces} allowed",
            "Simplify the mesh, or raise objects.max_faces",
        )
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices_m):
        raise MeshError(
            f"{label} has faces that refer to vertices it does not have", "Export the mesh again"
        )
    bad = int((~np.isfinite(mesh.vertices_m)).any(axis=1).sum())
    if bad:
        raise MeshError(f"{label} has {bad} vertices that are NaN or infinite", "Mend the mesh")


def length_unit(
    label: str, extent: float, declared: str | None, config: ObjectsConfig
) -> tuple[str, UnitSource]:
    """The file's length unit and how it is known.

    What the file declares holds; else what the configuration says; else the first of m, mm, cm
    that puts the longest extent between the configured bounds. Raises MeshError where the size
    lies outside them.
    """
    candidates: tuple[str, ...]
    known_by: UnitSource
    if declared is not None:
        candidates, known_by = (declared,), "declared"
    elif config.unit != "auto":
        candidates, known_by = (config.unit,), "configured"
    else:
        candidates, known_by = _DETECTION_ORDER, "detected"
    for unit in candidates:
        if config.min_extent_m <= extent * _METRES_PER_UNIT[unit] <= config.max_extent_m:
            return unit, known_by
    raise MeshError(
        f"{label} has an absurd size: its longest extent of {extent:.3g} is outside "
        f"{config.min_extent_m:g} to {config.max_extent_m:g} m in {' or '.join(candidates)}",
        "Declare its unit in objects.unit, or rescale the mesh",
    )
