"""One solid written in every format, in each way that some tool writes it."""

import base64
import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Literal

import numpy as np

from tests.geometry.corpus.solids import Solid, corners_of_triangles

PLY_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}


PlyElement = tuple[str, list[tuple[str, str, str]], list[list[object]]]
"""Name, properties (kind, kind of a list's length, name) and rows."""


@dataclass(frozen=True)
class Obj:
    """How an OBJ file is written. Every field alone is something that tools do."""

    gap: str = " "
    indent: str = ""
    newline: str = "\n"
    mark: bytes = b""  # before the first line
    note: str = ""  # behind every line of data
    counted: Literal["on", "back", "both"] = "on"
    corner: str = "{0}"  # {0} is the vertex, {1} any other index
    colours: bool = False
    weight: str = ""  # the fourth number of a vertex
    continued: bool = False
    faces_first: bool = False
    interleaved: bool = False  # vertices of a face just before it, counted back
    groups: bool = False
    elements: bool = False  # points and lines among the faces
    number: str = "{:.17g}"
    final_newline: bool = True


@dataclass(frozen=True)
class Stl:
    """How an STL file is written."""

    text: bool = False
    upper: bool = False
    solid: str = "box"
    end: str = "endsolid box"
    newline: str = "\n"
    gap: str = " "
    header: bytes = b"made by a tool"
    tail: bytes = b""
    count_off_by: int = 0
    colour_bits: bool = False
    normals: bool = True


@dataclass(frozen=True)
class Off:
    """How an OFF file is written."""

    head: str = "OFF\n{0} {1} 0"
    vertex_more: str = ""
    face_more: str = ""
    newline: str = "\n"
    note: str = ""
    comments: bool = False
    blank_lines: bool = False
    mark: bytes = b""


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


@dataclass(frozen=True)
class Gltf:
    """How a GLB, or a glTF with its data in its text, is written."""

    mode: Literal["triangles", "strip", "fan"] = "triangles"
    index: Literal["u1", "u2", "u4", ""] = "u4"  # "": not indexed
    real: Literal["f4", "quantised"] = "f4"
    sparse: bool = False
    stride: int = 0
    pose: Literal["none", "matrix", "nested", "mirrored", "instanced"] = "none"
    extra_primitives: bool = False  # of points, of lines, and without positions
    text: bool = False


def obj(solid: Solid, how: Obj = Obj()) -> bytes:
    """Wavefront OBJ."""
    if how.interleaved:
        lines = []
        for polygon in solid.polygons:
            lines += [_obj_vertex(solid.corners_m[i], how) for i in polygon]
            corners = [how.corner.format(k - len(polygon), -1) for k in range(len(polygon))]
            lines.append(how.gap.join(["f", *corners]))
        return _text(lines, how)
    vertices = [_obj_vertex(corner, how) for corner in solid.corners_m]
    faces = []
    for number, polygon in enumerate(solid.polygons):
        back = how.counted == "back" or (how.counted == "both" and number % 2 == 1)
        count = len(solid.corners_m)
        names = [i - count if back else i + 1 for i in polygon]
        corners = [how.corner.format(i, 1) for i in names]
        if how.continued and len(corners) > 2:
            corners[1] += " \\" + how.newline
        if how.groups:
            faces += [f"o part{number}", f"g side{number} all", "usemtl grey shade", "s off"]
        if how.elements:
            faces += ["p 1", "l 1 2 3"]
        faces.append(how.gap.join(["f", *corners]))
    extra = ["vt 0.5 0.5", "vn 0 0 1"]
    parts = [faces, vertices, extra] if how.faces_first else [vertices, extra, faces]
    return _text(["# made by a script", "mtllib none.mtl", *chain.from_iterable(parts)], how)


def _obj_vertex(corner: np.ndarray, how: Obj) -> str:
    words = ["v", *(how.number.format(c) for c in corner)]
    if how.weight:
        words.append(how.weight)
    if how.colours:
        words += ["0.5", "0.25", "1"]
    return how.gap.join(words)


def _text(lines: list[str], how: Obj) -> bytes:
    written = how.newline.join(how.indent + line + how.note for line in lines)
    return how.mark + (written + (how.newline if how.final_newline else "")).encode()


def stl(solid: Solid, how: Stl = Stl()) -> bytes:
    """STL; the solid must be of triangles."""
    triangles = corners_of_triangles(solid)
    return stl_text(triangles, how) if how.text else stl_binary(triangles, how)


def stl_binary(triangles: np.ndarray, how: Stl = Stl()) -> bytes:
    """Binary STL of the corners (m, 3, 3)."""
    record = np.zeros(
        len(triangles), dtype=[("normal", "<f4", 3), ("at", "<f4", (3, 3)), ("bits", "<u2")]
    )
    record["at"] = triangles
    record["bits"] = 0x8000 | 31 if how.colour_bits else 0
    if how.normals:
        record["normal"] = _normals(triangles)
    count = struct.pack("<I", (len(triangles) + how.count_off_by) % 2**32)
    return how.header.ljust(80, b" ")[:80] + count + record.tobytes() + how.tail


def stl_text(triangles: np.ndarray, how: Stl = Stl(text=True)) -> bytes:
    """Text STL of the corners (m, 3, 3)."""
    lines = [f"solid {how.solid}".rstrip()]
    for normal, triangle in zip(_normals(triangles), triangles, strict=True):
        lines.append("facet normal " + " ".join(f"{c:.9g}" for c in normal))
        lines.append("  outer loop")
        lines += ["    vertex " + " ".join(f"{c:.17g}" for c in at) for at in triangle]
        lines += ["  endloop", "endfacet"]
    if how.end:
        lines.append(how.end)
    if how.gap != " ":
        lines = [line.replace(" ", how.gap) for line in lines]
    written = how.newline.join(lines) + how.newline
    return (written.upper() if how.upper else written).encode() + how.tail


def _normals(triangles: np.ndarray) -> np.ndarray:
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    normals = np.cross(b - a, c - a)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30))


def off(solid: Solid, how: Off = Off()) -> bytes:
    """OFF."""
    rows = [" ".join(f"{c:.17g}" for c in at) + how.vertex_more for at in solid.corners_m]
    rows += [" ".join(map(str, (len(p), *p))) + how.face_more for p in solid.polygons]
    lines = [how.head.format(len(solid.corners_m), len(solid.polygons))]
    for row in rows:
        if how.comments:
            lines.append("# a remark 1 2 3")
        if how.blank_lines:
            lines.append("")
        lines.append(row + how.note)
    return how.mark + (how.newline.join(lines).replace("\n", how.newline) + how.newline).encode()


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


def gltf(solid: Solid, how: Gltf = Gltf()) -> bytes:
    """GLB, or a glTF of one file; the solid must be of triangles."""
    writer = GltfWriter()
    pose = np.eye(4)
    corners = solid.corners_m
    triangles = np.array(solid.polygons)
    if how.pose in ("matrix", "nested"):
        pose[:3, :3] = [[0, -2, 0], [2, 0, 0], [0, 0, 2]]  # a quarter turn, twice as large
        pose[:3, 3] = [0.5, 0.25, -0.125]
    elif how.pose == "mirrored":
        pose[0, 0] = -1
    corners = (corners - pose[:3, 3]) @ np.linalg.inv(pose[:3, :3]).T
    if how.pose == "mirrored":
        triangles = triangles[:, ::-1]  # so that the mirrored node turns them outward again
    primitives: list[dict[str, object]] = []
    more: dict[str, object] = {}
    scale, origin = 1.0, np.zeros(3)
    if how.real == "quantised":
        # Exact: integers over the box, put back by the node above.
        origin, scale = corners.min(axis=0), float(np.ptp(corners, axis=0).max())
        stored = np.round((corners - origin) / scale * 65535).astype("<u2")
        more = {"normalized": True}
    else:
        stored = corners.astype("<f4")
    parts = triangles if how.mode != "triangles" else [triangles.reshape(-1)]
    if not how.index:
        whole = stored[triangles.reshape(-1)]
        position = writer.accessor(whole, "VEC3", stride=how.stride, **more)
        primitives.append({"attributes": {"POSITION": position}})
    else:
        sparse = _sparse(writer, stored) if how.sparse else None
        position = (
            writer.accessor(stored, "VEC3", stride=how.stride, **more) if sparse is None else sparse
        )
        for part in parts:
            indices = writer.accessor(np.asarray(part).astype("<" + how.index), "SCALAR")
            mode = {"triangles": 4, "strip": 5, "fan": 6}[how.mode]
            primitives.append(
                {"attributes": {"POSITION": position}, "indices": indices, "mode": mode}
            )
    if how.extra_primitives:
        primitives += [
            {"attributes": {"POSITION": position}, "mode": 0},
            {"attributes": {"POSITION": position}, "mode": 3},
            {"attributes": {}},
        ]
    tree = {
        "asset": {"version": "2.0", "generator": "script"},
        "meshes": [{"primitives": primitives}],
        **_nodes(how, pose, scale, origin),
    }
    if how.real == "quantised":
        tree["extensionsUsed"] = tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    return writer.finish(tree, how.text)


def _nodes(how: Gltf, pose: np.ndarray, scale: float, origin: np.ndarray) -> dict[str, object]:
    inner: dict[str, object] = {"mesh": 0}
    if how.real == "quantised":
        inner |= {"scale": [scale] * 3, "translation": origin.tolist()}
    if how.pose == "nested":
        half = {"translation": pose[:3, 3].tolist(), "children": [1]}
        turn = {"rotation": [0, 0, 0.5**0.5, 0.5**0.5], "scale": [2, 2, 2], "children": [2]}
        return {"nodes": [half, turn, inner], "scenes": [{"nodes": [0]}], "scene": 0}
    outer: dict[str, object] = {"children": [1]}
    if how.pose == "matrix":
        outer["matrix"] = pose.T.reshape(-1).tolist()
    elif how.pose == "mirrored":
        outer["scale"] = [-1, 1, 1]
    return {"nodes": [outer, inner], "scenes": [{"nodes": [0]}], "scene": 0}


def _sparse(writer: "GltfWriter", stored: np.ndarray) -> int:
    """Zeros, with every vertex replaced."""
    indices = writer.view(np.arange(len(stored), dtype="<u2"))
    values = writer.view(stored)
    writer.accessors.append(
        {
            "componentType": 5126,
            "count": len(stored),
            "type": "VEC3",
            "sparse": {
                "count": len(stored),
                "indices": {"bufferView": indices, "componentType": 5123},
                "values": {"bufferView": values},
            },
        }
    )
    return len(writer.accessors) - 1


class GltfWriter:
    """Buffer, views and accessors of one file."""

    def __init__(self) -> None:
        self.body = b""
        self.views: list[dict[str, object]] = []
        self.accessors: list[dict[str, object]] = []

    def view(self, values: np.ndarray, stride: int = 0) -> int:
        data = values.tobytes()
        if stride:
            rows = [row.tobytes().ljust(stride, b"\x7f") for row in values]
            data = b"".join(rows)
        at = len(self.body)
        self.body += data + b"\0" * (-len(data) % 4)
        view: dict[str, object] = {"buffer": 0, "byteOffset": at, "byteLength": len(data)}
        self.views.append(view | ({"byteStride": stride} if stride else {}))
        return len(self.views) - 1

    def accessor(self, values: np.ndarray, kind: str, stride: int = 0, **more: object) -> int:
        codes = {"u1": 5121, "u2": 5123, "u4": 5125, "f4": 5126}
        self.accessors.append(
            {
                "bufferView": self.view(values, stride),
                "componentType": codes[values.dtype.str[1:]],
                "count": len(values),
                "type": kind,
                **more,
            }
        )
        return len(self.accessors) - 1

    def finish(self, tree: dict[str, object], text: bool = False) -> bytes:
        whole: dict[str, object] = {
            **tree,
            "bufferViews": self.views,
            "accessors": self.accessors,
            "buffers": [{"byteLength": len(self.body)}],
        }
        if text:
            uri = "data:application/octet-stream;base64," + base64.b64encode(self.body).decode()
            whole["buffers"] = [{"byteLength": len(self.body), "uri": uri}]
            return json.dumps(whole).encode()
        return glb(whole, self.body)


def glb(tree: dict[str, object], body: bytes = b"", version: int = 2) -> bytes:
    """A binary glTF of a description and one buffer."""
    written = json.dumps(tree, separators=(",", ":")).encode()
    written += b" " * (-len(written) % 4)
    chunks = struct.pack("<I4s", len(written), b"JSON") + written
    if body:
        body += b"\0" * (-len(body) % 4)
        chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", version, 12 + len(chunks)) + chunks
