"""Reading mesh files: bounded, nothing outside their folder, units declared or detected."""

import hashlib
import os
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from urllib.parse import unquote

from pipeline.config.objects import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.file_kinds import check_kind
from pipeline.geometry.formats import gltf, obj, off, ply, stl
from pipeline.geometry.formats.surface import Surface, check_faces_allowed
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.units import METRES_PER_UNIT, UnitSource, length_unit

# Formats whose reader needs the file's bytes alone; glTF may name further files.
_READERS = {".obj": obj.read, ".off": off.read, ".ply": ply.read, ".stl": stl.read}
_GLTF_SUFFIXES = (".glb", ".gltf")


@dataclass(frozen=True, eq=False)
class MeshSource:
    """A mesh as it came, in metres, and where it came from."""

    name: str
    """Name of the object."""
    label: str
    """What a person calls the source: the file's path in its folder, or `parametric`."""
    sha256: str
    """Digest of the file's bytes; `parametric` for the embedded objects."""
    mesh: Mesh
    unit: str
    """Length unit of the source: m, cm, mm or in."""
    unit_known_by: UnitSource
    notes: tuple[str, ...] = ()
    """What the object's record should say of how the file was read."""
    left_off: tuple[str, ...] = ()
    """Paths of further files of this object that it names and that are not read."""

    @property
    def extent(self) -> float:
        """The longest extent, in the source's unit."""
        return float(self.mesh.extents_m.max()) / METRES_PER_UNIT[self.unit]

    def in_unit(self, unit: str) -> "MeshSource":
        """The same numbers read in another unit."""
        factor = METRES_PER_UNIT[unit] / METRES_PER_UNIT[self.unit]
        return replace(self, mesh=self.mesh.scaled(factor), unit=unit)


def load_mesh_file(path: Path, folder: Path, name: str, config: ObjectsConfig) -> MeshSource:
    """One file's surface in metres, its scene's nodes merged into one mesh.

    Parameters
    ----------
    path
        The mesh file.
    folder
        The folder of meshes; nothing outside it is read.
    name
        The object's name.
    config
        Bounds on file, faces and size, and the unit where no file declares one.

    Returns
    -------
    The surface, its unit, and what was done to read it.

    Raises
    ------
    MeshError
        With the file's name and the true reason, where the file leads out of the folder, is too
        large, no mesh, damaged, has no or too many faces, vertices that are not finite, indices
        out of range, faces that cannot be cut, or a size that no unit explains.
    """
    label = path.relative_to(folder).as_posix()
    surface, digest = read_surface(path, folder, config)
    raw = surface.mesh
    unit, known_by = length_unit(label, float(raw.extents_m.max()), surface.unit, config)
    mesh = Mesh(raw.vertices_m * METRES_PER_UNIT[unit], raw.faces)
    return MeshSource(name, label, digest, mesh, unit, known_by, surface.notes)


def read_surface(path: Path, folder: Path, config: ObjectsConfig) -> tuple[Surface, str]:
    """A file's checked surface in its own unit, and the digest of all bytes it is made of."""
    label = path.relative_to(folder).as_posix()
    data = _bytes_of(label, path, folder, config)
    surface = parse_mesh(label, data, config, path, folder)
    if len(surface.mesh.faces) == 0:
        raise MeshError(f"{label} has no faces of three or more corners", "Export its surface")
    check_faces_allowed(label, len(surface.mesh.faces), config.max_faces)
    digest = hashlib.sha256(data)
    for more in surface.beside:
        digest.update(more)
    return surface, digest.hexdigest()


def files_beside(path: Path, folder: Path, config: ObjectsConfig) -> tuple[Path, ...]:
    """Files of the folder that a glTF keeps its data in; none for another mesh.

    One that cannot be read names none; reading it says why.
    """
    if path.suffix.lower() not in _GLTF_SUFFIXES:
        return ()
    label = path.relative_to(folder).as_posix()
    try:
        names = gltf.files_named(label, _bytes_of(label, path, folder, config))
    except MeshError:
        return ()
    found = [Path(os.path.normpath(path.parent / unquote(name))) for name in names]
    root = folder.resolve()
    return tuple(f for f in found if f.is_file() and f.resolve().is_relative_to(root))


def _bytes_of(label: str, path: Path, folder: Path, config: ObjectsConfig) -> bytes:
    if not path.resolve().is_relative_to(folder.resolve()):
        raise MeshError(f"{label} leads out of its folder", "Copy the mesh into the folder")
    mebibytes = path.stat().st_size / 2**20
    if mebibytes > config.max_file_mib:
        raise MeshError(
            f"{label} has {mebibytes:.0f} MiB, more than the {config.max_file_mib} allowed",
            "Simplify the mesh, or raise objects.max_file_mib",
        )
    return path.read_bytes()


def parse_mesh(label: str, data: bytes, config: ObjectsConfig, path: Path, folder: Path) -> Surface:
    """The surface in the file's own unit, by the reader of its suffix.

    Of further files only those are read that a glTF keeps its data in: materials and textures
    stay unread. Raises MeshError.
    """
    suffix = path.suffix.lower()
    check_kind(label, data)
    if suffix in _GLTF_SUFFIXES:
        beside = partial(_beside, label, path, folder, config)
        return gltf.read(label, data, config.max_faces, beside)
    return _READERS[suffix](label, data, config.max_faces)


def _beside(label: str, path: Path, folder: Path, config: ObjectsConfig, name: str) -> bytes:
    """The bytes of a file that a glTF names. Raises MeshError where it is none of the folder's."""
    if ":" in name:
        raise MeshError(
            f"{label} keeps its data at '{name[:80]}', and only files of its folder are read "
            "(no http, https or file addresses)",
            "Export it as one GLB file",
        )
    found = path.parent / unquote(name)
    if not found.resolve().is_relative_to(folder.resolve()):
        raise MeshError(
            f"{label} keeps its data in '{name[:80]}', which leads out of its folder",
            "Copy that file into the folder",
        )
    if not found.is_file():
        raise MeshError(
            f"{label} keeps its data in '{name[:80]}', which is not there", "Put it there"
        )
    return _bytes_of(f"{label}: '{name[:80]}'", found, folder, config)
