"""URDF files as objects: the meshes and solids of their links, at their scale, as one surface.

A rigid object is one link, or several that fixed joints hold together (A-2). Meshes are looked
for beside the URDF and in its folder, never outside; URDF is in metres by its definition.
"""

import hashlib
import os
import re
from contextlib import suppress
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from pipeline.config.objects import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.formats.surface import check_faces_allowed, check_finite
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.mesh_files import MeshSource, files_beside, load_mesh_file, read_surface
from pipeline.geometry.mesh_folders import MESH_SUFFIXES
from pipeline.geometry.units import length_unit

URDF_SUFFIX = ".urdf"
_PACKAGES = ("package://", "model://")  # of ROS and of Gazebo
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:")  # longer than the letter of a drive
_LARGEST_URDF_MIB = 16  # a URDF names meshes and holds none


def load_object_file(path: Path, folder: Path, name: str, config: ObjectsConfig) -> MeshSource:
    """One object of a folder: a URDF, or a mesh file on its own. Raises MeshError."""
    if path.suffix.lower() == URDF_SUFFIX:
        return load_urdf_file(path, folder, name, config)
    return load_mesh_file(path, folder, name, config)


def standalone(files: list[Path], folder: Path) -> list[Path]:
    """Files that are objects themselves: all but the meshes that a URDF among them places.

    A URDF that cannot be read keeps none of its meshes back; loading it says why.
    """
    placed: set[Path] = set()
    for path in files:
        if path.suffix.lower() == URDF_SUFFIX:
            try:
                root = _root(path, folder)
                references = [m.get("filename", "") for m in root.iter("mesh")]
                placed |= {_resolved(reference, path, folder) for reference in references}
            except MeshError:
                continue
    return [path for path in files if path.resolve() not in placed]


def read_with(path: Path, folder: Path, config: ObjectsConfig) -> tuple[Path, ...]:
    """Files of the folder that an object's file is read with: a URDF's meshes, a glTF's data.

    One that cannot be read names none; loading it says why.

    Parameters
    ----------
    path
        A mesh or a URDF.
    folder
        The mesh folder.
    config
        Bounds of files.

    Returns
    -------
    The files, each once.
    """
    if path.suffix.lower() != URDF_SUFFIX:
        return files_beside(path, folder, config)
    found: dict[Path, None] = {}
    with suppress(MeshError):
        for reference in [m.get("filename", "") for m in _root(path, folder).iter("mesh")]:
            with suppress(MeshError):
                mesh = Path(os.path.normpath(_named(reference, path, folder)))
                found |= dict.fromkeys((mesh, *files_beside(mesh, folder, config)))
    return tuple(found)


def load_urdf_file(path: Path, folder: Path, name: str, config: ObjectsConfig) -> MeshSource:
    """The object of a URDF in metres, every ``<mesh scale>`` and ``<origin>`` applied.

    A link's visual geometry is taken, its collision geometry where it has none.

    Parameters
    ----------
    path
        The URDF.
    folder
        The mesh folder; no mesh is read outside it.
    name
        What the object is called.
    config
        Units and bounds of files.

    Returns
    -------
    The object in metres, and where it came from.

    Raises
    ------
    MeshError
        The file is no URDF, its links can move against each other, or a mesh is missing, leads out
        of the folder or cannot be read; the message names the file and the reason.
    """
    label = path.relative_to(folder).as_posix()
    root = _root(path, folder)
    digest = hashlib.sha256(path.read_bytes())
    parts: list[Mesh] = []
    notes: list[str] = []
    faces = 0
    for link, root_from_link in _placed_links(label, root):
        bodies = link.findall("visual") or link.findall("collision")
        for body in bodies:
            geometry = body.find("geometry")
            if geometry is None or not len(geometry):
                raise MeshError(f"{label} has a link without geometry", "Export it again")
            mesh, held, said = _shape(label, geometry[0], path, folder, config)
            digest.update(held.encode())
            notes += [note for note in said if note not in notes]
            faces += len(mesh.faces)
            check_faces_allowed(label, faces, config.max_faces)
            parts.append(mesh.transformed(root_from_link @ _origin(label, body)))
    if not parts:
        raise MeshError(f"{label} has no visual or collision geometry", "Export it again")
    starts = np.cumsum([0, *(len(part.vertices_m) for part in parts[:-1])])
    merged = Mesh(
        np.concatenate([part.vertices_m for part in parts]),
        np.concatenate([part.faces + at for part, at in zip(parts, starts, strict=True)]),
    )
    check_finite(label, merged.vertices_m)
    unit, known_by = length_unit(label, float(merged.extents_m.max()), "m", config)
    return MeshSource(
        name,
        label,
        digest.hexdigest(),
        merged,
        unit,
        known_by,
        tuple(notes),
        _left_off(root, path, folder),
    )


def _left_off(root: ElementTree.Element, urdf: Path, folder: Path) -> tuple[str, ...]:
    """Collision meshes of links whose visual meshes are taken, by their paths in the folder."""
    taken: set[Path] = set()
    others: set[Path] = set()
    for link in root.findall("link"):
        seen, felt = (link.findall(f"{kind}/geometry/mesh") for kind in ("visual", "collision"))
        if link.find("visual") is None:
            taken |= _places(felt, urdf, folder)
        else:
            taken |= _places(seen, urdf, folder)
            others |= _places(felt, urdf, folder)
    paths = (path.relative_to(folder.resolve()).as_posix() for path in others - taken)
    return tuple(sorted(paths))


def _places(meshes: list[ElementTree.Element], urdf: Path, folder: Path) -> set[Path]:
    """The files of those meshes that are there."""
    found: set[Path] = set()
    for mesh in meshes:
        with suppress(MeshError):  # one that is not read may be missing
            found.add(_resolved(mesh.get("filename", ""), urdf, folder))
    return found


def _root(path: Path, folder: Path) -> ElementTree.Element:
    label = path.relative_to(folder).as_posix()
    if not path.resolve().is_relative_to(folder.resolve()):
        raise MeshError(f"{label} leads out of its folder", "Copy the file into the folder")
    if path.stat().st_size > _LARGEST_URDF_MIB * 2**20:
        raise MeshError(f"{label} has more than {_LARGEST_URDF_MIB} MiB", "Export the URDF again")
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise MeshError(f"{label} is no XML ({error})", "Export the URDF again") from error
    if root.tag != "robot":
        raise MeshError(f"{label} is no URDF: its root is <{root.tag}>", "Export the URDF again")
    if any("xacro" in element.tag for element in root.iter()):
        raise MeshError(
            f"{label} holds macros of xacro", "Expand it: xacro robot.xacro > robot.urdf"
        )
    return root


def _placed_links(
    label: str, root: ElementTree.Element
) -> list[tuple[ElementTree.Element, Float[np.ndarray, "4 4"]]]:
    """Every link with its pose in the root link, joints at their zero position."""
    links = {link.get("name", ""): link for link in root.findall("link")}
    above: dict[str, tuple[str, np.ndarray]] = {}
    moving: dict[str, str] = {}  # the kind of the joint above a link, where it is not fixed
    for joint in root.findall("joint"):
        kind, parent, child = joint.get("type"), joint.find("parent"), joint.find("child")
        if parent is None or child is None:
            raise MeshError(f"{label} has a joint without parent or child", "Export it again")
        if kind != "fixed":
            moving[child.get("link", "")] = str(kind)
        for end in (parent, child):
            if end.get("link") not in links:
                raise MeshError(
                    f"{label} has a joint to link '{end.get('link')}', which it does not have",
                    "Mend its joints",
                )
        above[child.get("link", "")] = (parent.get("link", ""), _origin(label, joint))
    placed: dict[str, Float[np.ndarray, "4 4"]] = {}
    for name in links:
        chain, at = list[str](), name  # up to a link whose pose is known, each link once
        while at not in placed and at in above and len(chain) < len(links):
            chain.append(at)
            at = above[at][0]
        if at not in placed and (at in above or at not in links):
            raise MeshError(f"{label}: link '{name}' hangs on no root", "Mend its joints")
        pose = placed.setdefault(at, np.eye(4))
        for below in reversed(chain):
            pose = placed[below] = pose @ above[below][1]
    _check_rigid(label, links, {child: parent for child, (parent, _) in above.items()}, moving)
    return [(link, placed[name]) for name, link in links.items()]


def _check_rigid(
    label: str,
    links: dict[str, ElementTree.Element],
    parents: dict[str, str],
    moving: dict[str, str],
) -> None:
    """Raise MeshError where a joint that moves parts two links that both have geometry.

    A link without geometry is a frame, such as the world that an object floats in: a joint to it
    moves the object as a whole.
    """
    # In one tree, the shapes that move together hang below one and the same joint that moves.
    carriers: dict[str, tuple[str, str]] = {}
    first: dict[str, str] = {}
    for name, link in links.items():
        chain, at = list[str](), name
        while at not in carriers and at in parents:
            chain.append(at)
            at = parents[at]
        carrier, tree = carriers.setdefault(at, (at, at))
        for below in reversed(chain):
            carrier = below if below in moving else carrier
            carriers[below] = (carrier, tree)
        if link.find("visual") is None and link.find("collision") is None:
            continue
        other = first.setdefault(tree, carrier)
        if other != carrier:
            kind = moving.get(carrier) or moving[other]
            raise MeshError(
                f"{label} has a {kind} joint, and an object must be rigid",
                "Fix the joint at the wanted pose, or export its links one by one",
            )


def _shape(
    label: str, shape: ElementTree.Element, urdf: Path, folder: Path, config: ObjectsConfig
) -> tuple[Mesh, str, tuple[str, ...]]:
    """A geometry's surface in its own frame, its file's digest, and what its reading noted."""
    if shape.tag == "mesh":
        reference = shape.get("filename", "")
        path = _resolved(reference, urdf, folder)
        if path.suffix.lower() not in MESH_SUFFIXES:
            raise MeshError(
                f"{label} places '{reference}', which is none of {', '.join(MESH_SUFFIXES)}",
                "Export that mesh as OBJ",
            )
        surface, digest = read_surface(path, folder.resolve(), config)
        raw = surface.mesh
        scale = _numbers(label, shape.get("scale", "1 1 1"), 3)
        if not (scale != 0).all():
            raise MeshError(f"{label} scales '{reference}' to nothing", "Change its scale")
        # A mirrored mesh is turned inside out, unless its faces run the other way round.
        faces = raw.faces if scale.prod() > 0 else raw.faces[:, ::-1]
        return Mesh(raw.vertices_m * scale, faces), digest, surface.notes
    if shape.tag == "box":
        solid = trimesh.creation.box(extents=_numbers(label, shape.get("size", ""), 3))
    elif shape.tag == "sphere":
        (radius,) = _numbers(label, shape.get("radius", ""), 1)
        solid = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    elif shape.tag == "cylinder":
        (radius,) = _numbers(label, shape.get("radius", ""), 1)
        (length,) = _numbers(label, shape.get("length", ""), 1)
        solid = trimesh.creation.cylinder(radius=radius, height=length, sections=64)
    else:
        raise MeshError(f"{label} has a <{shape.tag}>, which URDF does not know", "Use a mesh")
    return Mesh(np.array(solid.vertices), np.array(solid.faces, dtype=np.int64)), "", ()


def _resolved(reference: str, urdf: Path, folder: Path) -> Path:
    """The file that a URDF names, links followed. Raises MeshError as `_named` does."""
    return _named(reference, urdf, folder).resolve()


def _named(reference: str, urdf: Path, folder: Path) -> Path:
    """The file that a URDF names, by its path in the folder.

    Raises MeshError where it is missing or outside the folder.

    A ``package://`` may stand for any folder from the URDF's up to the folder of meshes, with or
    without the package's name; a path may have backslashes and percent escapes.
    """
    label, root = urdf.relative_to(folder).as_posix(), folder.resolve()
    if not reference.strip():
        raise MeshError(f"{label} has a mesh that names no file", "Export the URDF again")
    bases = [urdf.parent, *(up for up in urdf.parent.parents if up.is_relative_to(folder))]
    written = _paths_meant(label, reference)
    candidates = [base / part for part in written for base in bases]
    found = [path for path in candidates if _is_file(path)]
    if not found:
        raise MeshError(f"{label} places '{reference}', which is not there", "Put it there")
    inside = [path for path in found if path.resolve().is_relative_to(root)]
    if not inside:
        raise MeshError(
            f"{label} places '{reference}', which leads out of its folder",
            "Copy the mesh into the folder",
        )
    return inside[0]


def _paths_meant(label: str, reference: str) -> list[str]:
    """Paths that a reference may mean: as it is written first, then without escapes."""
    package = next((kind for kind in _PACKAGES if reference.startswith(kind)), None)
    if package:
        names = [reference.removeprefix(package)]
        names.append(names[0].partition("/")[2])
    elif reference.lower().startswith("file:"):
        names = [reference[len("file:") :]]
        if names[0].startswith("//"):
            host, slash, rest = names[0][2:].partition("/")
            # Two slashes and a relative path are common, and no address.
            names = ["/" + rest] if host in ("", "localhost") else [host + slash + rest]
    elif _SCHEME.match(reference):
        raise MeshError(
            f"{label} places '{reference}', and only files of its folder are read",
            "Copy the mesh into the folder, and name it by its path",
        )
    else:
        names = [reference]
    ways = [names, [name.replace("\\", "/") for name in names]]
    ways += [[unquote(name) for name in way] for way in ways]
    return list(dict.fromkeys(name for way in ways for name in way if name))


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name too long to be one
        return False


def _origin(label: str, holder: ElementTree.Element) -> Float[np.ndarray, "4 4"]:
    """``<origin xyz rpy>`` of a joint or geometry: fixed axes x, y, z in turn."""
    pose = np.eye(4)
    origin = holder.find("origin")
    if origin is not None:
        angles = _numbers(label, origin.get("rpy", "0 0 0"), 3)
        pose[:3, :3] = Rotation.from_euler("xyz", angles).as_matrix()
        pose[:3, 3] = _numbers(label, origin.get("xyz", "0 0 0"), 3)
    return pose


def _numbers(label: str, text: str, count: int) -> Float[np.ndarray, " count"]:
    """So many finite numbers; one alone stands for all of them, as some tools write scales."""
    try:
        numbers = np.array([float(part) for part in text.split()])
    except ValueError:
        numbers = np.zeros(0)
    if len(numbers) == 1 and count > 1:
        numbers = np.repeat(numbers, count)
    if len(numbers) != count or not np.isfinite(numbers).all():
        raise MeshError(f"{label} has '{text}' where {count} numbers belong", "Mend that line")
    return numbers
