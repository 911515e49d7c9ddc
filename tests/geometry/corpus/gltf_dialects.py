"""One solid written as glTF in each way that some tool writes it."""

import base64
import json
import struct
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tests.geometry.corpus.solids import Solid


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
