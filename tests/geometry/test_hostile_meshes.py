"""A file of a KiB that declares a terabyte, or multiplies itself into one, costs nothing."""

import base64
import json
import struct
import zlib
from pathlib import Path

import numpy as np
import trimesh

from pipeline.config import ObjectsConfig
from pipeline.geometry.urdf_files import load_object_file
from tests.refusals import assert_refused_cheaply

TERA, FACES_31 = 10**12, 2**31
BOX = trimesh.creation.box(extents=(0.1, 0.05, 0.02))


def load(path: Path) -> object:
    return load_object_file(path, path.parent, path.stem, ObjectsConfig())


def ply(
    vertices: int, faces: int, body: bytes, encoding: str = "binary_little_endian", **kinds: str
) -> bytes:
    listed = kinds.get("listed", "list uchar int vertex_indices")
    head = f"ply\nformat {encoding} 1.0\nelement vertex {vertices}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += kinds.get("more", "")
    head += f"element face {faces}\nproperty {listed}\nend_header\n"
    return head.encode() + body


def triangle() -> bytes:
    return np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4").tobytes()


def glb(tree: dict[str, object], body: bytes = b"") -> bytes:
    text = json.dumps({"asset": {"version": "2.0"}, **tree}, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    body += b"\0" * (-len(body) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def glb_of(
    accessors: list[dict[str, object]],
    primitives: list[dict[str, object]],
    view: dict[str, object] | None = None,
    **more: object,
) -> bytes:
    body = triangle() + np.arange(3, dtype="<u4").tobytes()
    tree: dict[str, object] = {
        "buffers": [{"byteLength": len(body)}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36, **(view or {})},
            {"buffer": 0, "byteOffset": 36, "byteLength": 12},
        ],
        "accessors": accessors,
        "meshes": [{"primitives": primitives}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        **more,
    }
    return glb(tree, body)


def accessor(count: int, kind: str = "VEC3", code: int = 5126, **more: object) -> dict[str, object]:
    return {"count": count, "type": kind, "componentType": code, **more}


def wide_picture() -> bytes:
    """A PNG of a few bytes that declares 13 000 x 13 000 pixels, just below what Pillow refuses."""
    head = struct.pack(">IIBBBBB", 13_000, 13_000, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(bytes(10_000))), (b"IEND", b""))
    framed = (
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(framed)


def urdf(solid: str) -> bytes:
    body = f"<visual><geometry>{solid}</geometry></visual>"
    return f"<robot name='r'><link name='l'>{body}</link></robot>".encode()


# Ten entities of ten of the one before: 10^10 letters.
LAUGHS = (
    "<!DOCTYPE robot [<!ENTITY e0 'ha'>"
    + "".join(f"<!ENTITY e{i} '{f'&e{i - 1};' * 10}'>" for i in range(1, 11))
    + "]><robot name='&e10;'/>"
)
POINTS, CORNERS = accessor(3, bufferView=0), accessor(3, "SCALAR", 5125, bufferView=1)
PART: dict[str, object] = {"attributes": {"POSITION": 0}, "indices": 1}
HOSTILE = {
    "vertices.ply": ply(TERA, 1, triangle()),
    "faces.ply": ply(3, FACES_31, triangle()),
    "text_vertices.ply": ply(TERA, 1, b"0 0 0\n", "ascii"),
    "text_faces.ply": ply(3, FACES_31, b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "ascii"),
    "corners.ply": ply(
        3, 1, triangle() + struct.pack("<I", 2**32 - 1), listed="list uint int vertex_indices"
    ),
    "no_corners.ply": ply(
        3, 1, triangle() + struct.pack("<i", -1), listed="list int int vertex_indices"
    ),
    "text_corners.ply": ply(3, 1, b"0 0 0\n1 0 0\n0 1 0\n4294967295 0 1 2\n", "ascii"),
    "corners.off": f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{TERA} 0 1 2\n".encode(),
    "nothing.ply": ply(3, 1, triangle(), more=f"element nothing {TERA}\n"),
    "list.ply": ply(3, 1, triangle(), more=f"element more {TERA}\nproperty list uchar int x\n"),
    "faces.stl": b"\0" * 80 + struct.pack("<I", FACES_31) + bytes(100),
    "faces.off": f"OFF\n3 {FACES_31} 0\n0 0 0\n".encode(),
    "vertices.off": f"OFF\n{TERA} 1 0\n0 0 0\n".encode(),
    "index.obj": f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {FACES_31}\n".encode(),
    "wide_index.obj": f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/1 2/2/2 {TERA}/{TERA}/{TERA}\n".encode(),
    "negative.obj": f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -{TERA}\n".encode(),
    "count.glb": glb_of([accessor(TERA, bufferView=0), CORNERS], [PART]),
    "indices.glb": glb_of([POINTS, accessor(FACES_31, "SCALAR", 5125, bufferView=1)], [PART]),
    "view.glb": glb_of([POINTS, CORNERS], [PART], {"byteLength": TERA}),
    "stride.glb": glb_of([POINTS, CORNERS], [PART], {"byteStride": TERA}),
    "no_data.glb": glb_of([accessor(5_999_999), CORNERS], [PART]),
    "no_data_often.glb": glb_of(
        [*[accessor(5_999_999, "MAT4") for _ in range(9)], CORNERS],
        [{"attributes": {"POSITION": i, "_A": i}, "indices": 9} for i in range(9)],
    ),
    "uri.glb": glb_of([POINTS, CORNERS], [PART], buffers=[{"uri": "/dev/zero", "byteLength": 48}]),
    "laughs.urdf": LAUGHS.encode(),
    "deep.urdf": b"<robot name='r'>" + b"<a>" * 20_000,
    "radius.urdf": urdf("<sphere radius='1e300'/>"),
    "number.urdf": urdf(f"<box size='{'9' * 600}'/>"),
}
# What looks like it and is harmless: read as cheaply.
HARMLESS = {
    # Each node twice the child of the one before: 2^30 ways to its mesh.
    "nodes.glb": glb_of(
        [POINTS, CORNERS],
        [PART] * 8,
        nodes=[*({"children": [i + 1, i + 1]} for i in range(30)), {"mesh": 0}],
    ),
    "loop.glb": glb_of([POINTS, CORNERS], [PART], nodes=[{"children": [0], "mesh": 0}]),
    "picture.glb": glb_of(
        [POINTS, CORNERS, accessor(3, "VEC2", bufferView=0)],
        [
            {"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1, "material": i}
            for i in (0, 1)
        ],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}} for i in (0, 1)],
        textures=[{"source": 0}] * 2,
        images=[{"uri": "data:image/png;base64," + base64.b64encode(wide_picture()).decode()}],
    ),
}


def test_a_small_file_that_declares_a_terabyte_costs_nothing(tmp_path: Path) -> None:
    for suffix in ("ply", "stl", "off", "obj", "glb"):
        BOX.export(tmp_path / f"honest.{suffix}")
    (tmp_path / "honest.urdf").write_bytes(urdf("<box size='0.1 0.05 0.02'/>"))
    for name, data in HARMLESS.items():
        (tmp_path / name).write_bytes(data)
    honest = sorted(tmp_path.iterdir())
    for name, data in HOSTILE.items():
        (tmp_path / name).write_bytes(data)
    assert_refused_cheaply(load, honest, [tmp_path / name for name in HOSTILE])
