"""What a mesh file's header declares, held against its size before anything is allocated."""

import json
import struct
from pathlib import PurePath

from pipeline.errors import MeshError

_EXPORT_AGAIN = "Export the mesh again, or fetch the file again"
_PLY_BYTES = {
    **dict.fromkeys(("char", "uchar", "int8", "uint8"), 1),
    **dict.fromkeys(("short", "ushort", "int16", "uint16"), 2),
    **dict.fromkeys(("int", "uint", "int32", "uint32", "float", "float32"), 4),
    **dict.fromkeys(("double", "float64", "int64", "uint64"), 8),
}
_MOST_HEADER_BYTES = 64 * 1024


def check_header(name: str, data: bytes, max_faces: int) -> None:
    """Raise MeshError where the file is no mesh, is truncated, or declares too many faces.

    name: file name with its suffix, for the message and the format; data: the whole file.
    """
    if not data.strip(b"\0 \t\r\n"):
        raise MeshError(f"{name} is empty", _EXPORT_AGAIN)
    start = data[:512].lstrip(b"\xef\xbb\xbf \t\r\n").lower()
    if start.startswith((b"<!doctype html", b"<html", b"<head", b"<?xml", b"<!--")):
        raise MeshError(f"{name} is a web page, not a mesh", "Download the mesh itself")
    if start.startswith(b"version https://git-lfs"):
        raise MeshError(f"{name} is a Git LFS pointer, not a mesh", "Run git lfs pull")
    check = {".ply": _ply, ".stl": _stl, ".off": _off, ".glb": _glb}.get(
        PurePath(name).suffix.lower()
    )
    if check is not None:
        check(name, data, max_faces)


def _ply(name: str, data: bytes, max_faces: int) -> None:
    elements, ascii_body, body_bytes = _ply_elements(name, data)
    for element, count, _ in elements:
        if element == "face":
            check_faces_allowed(name, count, max_faces)
    _long_enough(name, body_bytes, sum(count * size for _, count, size in elements), ascii_body)


def _ply_elements(name: str, data: bytes) -> tuple[list[tuple[str, int, int]], bool, int]:
    """Name, count and least bytes of each element, whether the body is text, and its length."""
    marker = data.find(b"end_header", 0, _MOST_HEADER_BYTES)
    if not data.startswith(b"ply") or marker < 0:
        raise MeshError(f"{name} has no PLY header", _EXPORT_AGAIN)
    end = data.find(b"\n", marker)
    ascii_body, elements = False, list[tuple[str, int, int]]()
    for line in data[:marker].decode("ascii", errors="replace").splitlines():
        words = line.split()
        if words[:1] == ["format"] and len(words) > 1:
            ascii_body = words[1] == "ascii"
        elif words[:1] == ["element"] and len(words) == 3:
            count = int(words[2]) if words[2].isdecimal() else -1
            if count < 0:
                raise MeshError(f"{name} declares {words[2]!r} {words[1]} elements", _EXPORT_AGAIN)
            elements.append((words[1], count, 0))
        elif words[:1] == ["property"] and len(words) > 2 and elements:
            # A list takes at least its count.
            kind = words[2] if words[1] == "list" else words[1]
            element, count, size = elements[-1]
            size += 2 if ascii_body else _PLY_BYTES.get(kind, 1)
            elements[-1] = (element, count, size)
    return elements, ascii_body, len(data) - end - 1 if end >= 0 else 0


def _stl(name: str, data: bytes, max_faces: int) -> None:
    if data[:5].lower() == b"solid" and b"facet" in data[:_MOST_HEADER_BYTES]:
        if b"endsolid" not in data[-_MOST_HEADER_BYTES:]:
            raise MeshError(f"{name} is truncated: endsolid is missing", _EXPORT_AGAIN)
        return
    if len(data) < 84:
        raise MeshError(f"{name} is too short for an STL header", _EXPORT_AGAIN)
    (count,) = struct.unpack_from("<I", data, 80)
    _long_enough(name, len(data) - 84, 50 * count, ascii_body=False)
    check_faces_allowed(name, count, max_faces)


def check_face_count(name: str, data: bytes, parsed: int) -> None:
    """Raise MeshError where fewer faces could be read than an OFF or PLY file declares.

    A text file's least length does not tell a cut in its last lines; triangulating polygons
    only adds faces.
    """
    suffix, declared = PurePath(name).suffix.lower(), 0
    if suffix == ".off":
        _, declared = _off_counts(name, data)
    elif suffix == ".ply":
        elements, _, _ = _ply_elements(name, data)
        declared = sum(count for element, count, _ in elements if element == "face")
    if parsed < declared:
        raise MeshError(
            f"{name} is truncated: its header declares {declared} faces, {parsed} are there",
            _EXPORT_AGAIN,
        )


def check_faces_allowed(name: str, count: int, max_faces: int) -> None:
    """Raise MeshError where a file declares, or places, too many faces."""
    if count > max_faces:
        raise MeshError(
            f"{name} declares {count} faces, more than the {max_faces} allowed",
            "Simplify the mesh, or raise objects.max_faces",
        )


def _off_counts(name: str, data: bytes) -> tuple[int, int]:
    lines = data[:_MOST_HEADER_BYTES].decode("utf-8", errors="replace").splitlines()
    words = [word for line in lines for word in line.split("#")[0].split()]
    if not words or not words[0].upper().endswith("OFF"):
        raise MeshError(f"{name} has no OFF header", _EXPORT_AGAIN)
    if len(words) < 3 or not (words[1].isdecimal() and words[2].isdecimal()):
        raise MeshError(f"{name} does not declare its vertices and faces", _EXPORT_AGAIN)
    return int(words[1]), int(words[2])


def _off(name: str, data: bytes, max_faces: int) -> None:
    vertices, faces = _off_counts(name, data)
    check_faces_allowed(name, faces, max_faces)
    # "0 0 0\n" and "3 0 1 2\n" are the shortest lines.
    _long_enough(name, len(data) + 1, 6 * vertices + 8 * faces, ascii_body=True)


def _glb(name: str, data: bytes, max_faces: int) -> None:
    if len(data) < 20 or data[:4] != b"glTF":
        raise MeshError(f"{name} has no binary glTF header", _EXPORT_AGAIN)
    (declared,) = struct.unpack_from("<I", data, 8)
    (json_bytes,) = struct.unpack_from("<I", data, 12)
    _long_enough(name, len(data), max(declared, 20 + json_bytes), ascii_body=False)
    try:
        tree = json.loads(data[20 : 20 + json_bytes])
        accessors = tree.get("accessors", [])
        counts = [int(accessor.get("count", 0)) for accessor in accessors]
        used = [
            [
                *part.get("attributes", {}).values(),
                *([part["indices"]] if "indices" in part else []),
            ]
            for mesh in tree.get("meshes", [])
            for part in mesh["primitives"]
        ]
        stored = all("bufferView" in accessors[i] for part in used for i in part)
        # Primitives may share accessors, and each gets arrays of its own.
        corners = sum(max((counts[i] for i in part), default=0) for part in used)
        views = [
            view.get("byteOffset", 0) + view["byteLength"] for view in tree.get("bufferViews", [])
        ]
        longest = int(max(views, default=0))
    except (LookupError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise MeshError(
            f"{name} has a damaged glTF description ({error})", _EXPORT_AGAIN
        ) from error
    check_faces_allowed(name, max([corners, *counts]) // 3, max_faces)
    _long_enough(name, len(data), longest, ascii_body=False)
    if not stored:
        raise MeshError(
            f"{name} declares vertices or faces that it does not store as plain arrays",
            "Export the mesh without compression (Draco, meshopt) and sparse accessors",
        )


def _long_enough(name: str, present: int, declared: int, ascii_body: bool) -> None:
    if present < declared:
        least = "at least " if ascii_body else ""
        raise MeshError(
            f"{name} is truncated: its header declares {least}{declared} bytes, "
            f"{present} are there",
            _EXPORT_AGAIN,
        )
