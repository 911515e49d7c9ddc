"""What a folder of meshes holds, by the names of its files alone.

Apart from their reading: Make asks for the list at every call, and should not wait for parsers.
"""

import os
from pathlib import Path

from pipeline.errors import MeshError

MESH_SUFFIXES = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")
SOURCE_SUFFIXES = (*MESH_SUFFIXES, ".urdf")  # a URDF places meshes of the folder at a scale


def list_mesh_files(folder: Path) -> list[Path]:
    """Mesh and URDF files of a folder and its subfolders, sorted by relative path.

    Known suffixes only, hidden files and folders left out. Links are listed where they lead to a
    file inside the folder and left out where they lead outside; linked folders are not entered.

    Parameters
    ----------
    folder
        Looked through with its subfolders.

    Returns
    -------
    Their paths.

    Raises
    ------
    MeshError
        The folder is missing, holds no mesh, or a file's name is no text.
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
    for path in found:
        if _no_text(path):
            raise MeshError(
                f"{folder} holds a file whose name is not UTF-8: {_no_text(path)}", "Rename it"
            )
    return sorted(found, key=lambda path: path.relative_to(folder).as_posix())


def _no_text(path: Path) -> str:
    """The name of a file with the bytes that are no UTF-8 written as numbers; else nothing."""
    written = os.fsencode(path.name).decode(errors="backslashreplace")
    return "" if written == path.name else written
