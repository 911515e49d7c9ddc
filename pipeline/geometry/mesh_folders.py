"""What a folder of meshes holds, by the names of its files alone.

Apart from their reading: Make asks for the list at every call, and should not wait for parsers.
"""

import re
from pathlib import Path

from pipeline.errors import MeshError

MESH_SUFFIXES = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")
FAMILIES_FILE = "families.toml"  # what a person declares to be alike
SOURCE_SUFFIXES = (*MESH_SUFFIXES, ".urdf")  # a URDF places meshes of the folder at a scale


def list_mesh_files(folder: Path) -> list[Path]:
    """Mesh and URDF files of a folder and its subfolders, sorted by relative path.

    Known suffixes only, hidden files and folders left out. Links are listed where they lead to a
    file inside the folder and left out where they lead outside; linked folders are not entered.
    Raises MeshError where the folder is missing or holds no mesh.
    """
    if not folder.is_dir():
        raise MeshError(f"{folder} is not a folder", "Point MESH_DIR at a folder of meshes")
    root = folder.resolve()
    found = [
        path
        for path in folder.rglob("*")
        if path.suffix.lower() in SOURCE_SUFFIXES
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
        and path.is_file()
        and path.resolve().is_relative_to(root)
    ]
    if not found:
        raise MeshError(
            f"{folder} holds no mesh file", f"Put files of {', '.join(SOURCE_SUFFIXES)} there"
        )
    return sorted(found, key=lambda path: path.relative_to(folder).as_posix())


def object_names(files: list[Path], folder: Path) -> dict[Path, str]:
    """A slug for each file from its path in the folder; equal slugs get -2, -3 in file order."""
    names: dict[Path, str] = {}
    for path in files:
        stem = path.relative_to(folder).with_suffix("").as_posix()
        slug = re.sub(r"[^a-z0-9_-]+", "_", stem.lower()).strip("_") or "object"
        name, number = slug, 2
        while name in names.values():
            name, number = f"{slug}-{number}", number + 1
        names[path] = name
    return names
