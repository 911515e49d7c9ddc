"""One solid written as PLY in each way that some tool writes it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tests.geometry.corpus.solids import Solid

PLY_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
PlyElement = tuple[str, list[tuple[str, str, str]], list[list[object]]]
"""Name, properties (kind, kind of a list's length, name) and rows."""


@dataclass(frozen=True)
class Ply:
    """How a PLY file is written."""

    form: Literal["ascii", "binary_little_endian", "binary_big_endian"] = "binary_little_endian"
    real: str = "double"
    length: str = "uchar"
    index: str = "int"
    name: str = "vertex_indices"
    newline: str = "\n"
    normals: bool = False  # vertex properties before and behind the position
    face_more: bool = False  # properties before and behind the list of corners
    lists_more: bool = False  # a further list in front of the one that counts
    elements_more: bool = False  # elements before, between and behind
    faces_first: bool = False
    remarks: bool = False
    strips: bool = False


def ply(solid: Solid, how: Ply = Ply()) -> bytes:
    """PLY, body after header, element by element."""
    vertex = [
        *([("uchar", "", "red")] if how.normals else []),
        *((how.real, "", axis) for axis in "xyz"),
        *([("float", "", "nx"), ("uchar", "", "alpha")] if how.normals else []),
    ]
    corners = [
        [*([7] if how.normals else []), *at, *([0.5, 255] if how.normals else [])]
        for at in solid.corners_m.tolist()
    ]
    listed = (how.index, how.length, how.name)
    face = [
        *([("uchar", "", "flags")] if how.face_more else []),
        *([("float", "uchar", "texcoord")] if how.lists_more else []),
        listed,
        *([("float", "", "quality")] if how.face_more else []),
    ]
    faces: list[list[object]] = [
        [
            *([3] if how.face_more else []),
            *([[0.5, 0.25, 0.125]] if how.lists_more else []),
            list(polygon),
            *([0.5] if how.face_more else []),
        ]
        for polygon in solid.polygons
    ]
    elements: list[PlyElement]
    vertices: PlyElement
    vertices = ("vertex", vertex, [list(row) for row in corners])
    surface = ("face", face, faces)
    if how.strips:
        joined = [index for polygon in solid.polygons for index in (*polygon, -1)]
        surface = ("tristrips", [("int", "int", how.name)], [[joined]])
    elements = [surface, vertices] if how.faces_first else [vertices, surface]
    if how.elements_more:
        camera: PlyElement = (
            "camera",
            [("float", "", "fx"), ("int", "uchar", "size")],
            [[1.5, [640, 480]]],
        )
        edge: PlyElement = (
            "edge",
            [("int", "", "vertex1"), ("int", "", "vertex2")],
            [[0, 1], [1, 2]],
        )
        elements = [camera, elements[0], edge, elements[1], ("material", camera[1], camera[2])]
    head = ["ply", f"format {how.form} 1.0"]
    if how.remarks:
        head += ["comment element face 5", "obj_info num_cols 512", "comment"]
    for name, properties, rows in elements:
        head.append(f"element {name} {len(rows)}")
        head += [
            f"property list {length} {kind} {what}" if length else f"property {kind} {what}"
            for kind, length, what in properties
        ]
    body = b""
    for _, properties, rows in elements:
        body += b"".join(_ply_row(properties, row, how) for row in rows)
    return (how.newline.join([*head, "end_header"]) + how.newline).encode() + body


def _ply_row(properties: Sequence[tuple[str, str, str]], row: list[object], how: Ply) -> bytes:
    words: list[str] = []
    data = b""
    order = ">" if how.form == "binary_big_endian" else "<"
    for (kind, length, _), value in zip(properties, row, strict=True):
        values = value if isinstance(value, list) else [value]
        if length:
            words.append(str(len(values)))
            data += np.array([len(values)], dtype=order + PLY_TYPES[length]).tobytes()
        words += [f"{v:.17g}" for v in values]
        data += np.array(values).astype(order + PLY_TYPES[kind]).tobytes()
    return (" ".join(words) + how.newline).encode() if how.form == "ascii" else data
