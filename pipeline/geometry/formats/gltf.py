"""glTF 2, binary and text: the triangles of a scene's nodes, each where its node puts it.

Pictures and materials stay unread. A mirrored node turns its triangles round, as the format has
it. What a file packs with Draco or meshopt is refused by name.
"""

import base64
import binascii
import json
import re
import struct
from collections.abc import Callable
from typing import Any
from urllib.parse import unquote_to_bytes

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from pipeline.errors import MeshError
from pipeline.geometry.formats.strips import fan_triangles, strip_triangles
from pipeline.geometry.formats.surface import (
    EXPORT_AGAIN,
    Surface,
    check_faces_allowed,
    check_finite,
    check_indices,
    check_long_enough,
)
from pipeline.geometry.formats.text import text_of
from pipeline.geometry.mesh import Mesh

Beside = Callable[[str], bytes]
"""Reads a file that another names, relative to it, within the folder of meshes."""

_MAGIC = b"glTF"
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6  # modes of glTF 2.0
_PACKED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}
_INSTANCES = "EXT_mesh_gpu_instancing"
_READ = re.compile(
    # What is understood, and what changes how a surface looks but not where it is.
    r"KHR_mesh_quantization|EXT_mesh_gpu_instancing|KHR_draco_mesh_compression|"
    r"(EXT|KHR)_meshopt_compression|"
    r"[A-Z]+_(materials?|textures?|lights?|xmp|audio|animation)(_.*)?"
)
_DAMAGED = (LookupError, ValueError, TypeError, AttributeError, RecursionError, OverflowError)


def read(label: str, data: bytes, max_faces: int, beside: Beside) -> Surface:
    """A glTF file's triangles in metres.

    Parameters
    ----------
    label
        The file, for what is said of it.
    data
        The whole file, binary or text.
    max_faces
        More, counted at every place a mesh is put, are refused before memory is taken.
    beside
        Reads the files that it keeps its data in.

    Returns
    -------
    Triangles over the vertices that they use.

    Raises
    ------
    MeshError
        Where the file is no glTF 2, damaged, packed, or has no triangles or too many.
    """
    tree, body = _chunks(label, data)
    try:
        return _Scene(label, tree, body, beside, len(data), max_faces).surface()
    except _DAMAGED as error:
        reason = f"{type(error).__name__}: {error}".rstrip(": ")[:200]
        raise MeshError(
            f"{label} has a damaged glTF description ({reason})", EXPORT_AGAIN
        ) from error


def files_named(label: str, data: bytes) -> tuple[str, ...]:
    """The files that it keeps its data in, as it names them. Raises MeshError as `read` does."""
    tree, _ = _chunks(label, data)
    try:
        uris = [str(buffer["uri"]) for buffer in tree.get("buffers", []) if "uri" in buffer]
    except _DAMAGED as error:
        raise MeshError(f"{label} has a damaged glTF description", EXPORT_AGAIN) from error
    return tuple(uri for uri in uris if ":" not in uri)


def _chunks(label: str, data: bytes) -> tuple[Any, bytes | None]:
    """The description, and a binary file's own buffer."""
    if data[:4] != _MAGIC:
        if not data.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{"):
            raise MeshError(f"{label} is neither binary nor text glTF", EXPORT_AGAIN)
        return _description(label, text_of(label, data)), None
    if len(data) < 20:
        raise MeshError(f"{label} is truncated within its header", EXPORT_AGAIN)
    version, declared = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise MeshError(
            f"{label} is glTF of version {version}, and version 2 is read", "Export it as glTF 2"
        )
    check_long_enough(label, len(data), declared)
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= len(data):
        length, kind = struct.unpack_from("<I4s", data, at)
        check_long_enough(label, len(data), at + 8 + length)
        chunks.setdefault(kind, data[at + 8 : at + 8 + length])
        at += 8 + length
    return _description(label, chunks.get(b"JSON", b"")), chunks.get(b"BIN\0")


def _description(label: str, text: bytes) -> Any:
    try:
        tree = json.loads(text)
        version = str(tree.get("asset", {}).get("version", "2.0"))
    except _DAMAGED as error:
        raise MeshError(
            f"{label} has a damaged glTF description ({error})", EXPORT_AGAIN
        ) from error
    if version.partition(".")[0] != "2":
        raise MeshError(
            f"{label} is glTF of version {version[:8]}, and version 2 is read",
            "Export it as glTF 2",
        )
    return tree


class _Scene:
    """One file's description and its buffers, each read once."""

    def __init__(
        self, label: str, tree: Any, body: bytes | None, beside: Beside, size: int, max_faces: int
    ) -> None:
        self.label, self.tree, self.max_faces = label, tree, max_faces
        self.body, self.beside, self.size = body, beside, size
        self.buffers: dict[int, bytes] = {}
        self.outside: list[bytes] = []
        self.parts: dict[int, list[Mesh]] = {}
        self.faces = 0

    def surface(self) -> Surface:
        """Every mesh of the scene where its nodes put it."""
        self._check_extensions()
        placed: list[Mesh] = []
        for node, pose in self._placed_nodes():
            if "mesh" not in node:
                continue
            for instance in self._instances(node):
                for part in self._mesh(int(node["mesh"]), node.get("weights")):
                    self.faces += len(part.faces)
                    check_faces_allowed(self.label, self.faces, self.max_faces)
                    placed.append(_posed(part, pose @ instance))
        if self.faces == 0:
            raise MeshError(
                f"{self.label} has no triangles in its scene, only points, lines or nothing",
                "Export its surface",
            )
        starts = np.cumsum([0, *(len(part.vertices_m) for part in placed)])
        faces = [part.faces + at for part, at in zip(placed, starts.tolist(), strict=False)]
        vertices = np.concatenate([part.vertices_m for part in placed])
        check_finite(self.label, vertices)
        return Surface(Mesh(vertices, np.concatenate(faces)), "m", beside=tuple(self.outside))

    def _check_extensions(self) -> None:
        for name in self.tree.get("extensionsRequired", []):
            if not _READ.fullmatch(str(name)):
                raise MeshError(
                    f"{self.label} needs the glTF extension {str(name)[:60]}, which is not read",
                    "Export it without that extension",
                )

    def _placed_nodes(self) -> list[tuple[dict[str, Any], Float[np.ndarray, "4 4"]]]:
        """The scene's nodes, each once, with their poses."""
        nodes = self.tree.get("nodes", [])
        scenes = self.tree.get("scenes", [])
        if scenes:
            roots = scenes[int(self.tree.get("scene", 0))].get("nodes", [])
        else:
            below = {int(child) for node in nodes for child in node.get("children", [])}
            roots = [k for k in range(len(nodes)) if k not in below]
        if not nodes:  # a library of meshes that nobody places
            meshes = range(len(self.tree.get("meshes", [])))
            return [({"mesh": k}, np.eye(4)) for k in meshes]
        placed, seen = [], set[int]()
        waiting = [(int(k), np.eye(4)) for k in reversed(roots)]
        while waiting:
            number, above = waiting.pop()
            if number in seen or not 0 <= number < len(nodes):
                continue
            seen.add(number)
            pose = above @ _local(nodes[number])
            placed.append((nodes[number], pose))
            waiting += [(int(k), pose) for k in reversed(nodes[number].get("children", []))]
        return placed

    def _instances(self, node: dict[str, Any]) -> list[Float[np.ndarray, "4 4"]]:
        held = node.get("extensions", {}).get(_INSTANCES)
        if held is None:
            return [np.eye(4)]
        attributes = held.get("attributes", {})
        columns = {
            key: self._accessor(int(attributes[name]), width)
            for name, key, width in (
                ("TRANSLATION", "translation", 3),
                ("ROTATION", "rotation", 4),
                ("SCALE", "scale", 3),
            )
            if name in attributes
        }
        count = min((len(values) for values in columns.values()), default=0)
        check_faces_allowed(self.label, count, self.max_faces)
        return [_local({key: values[k] for key, values in columns.items()}) for k in range(count)]

    def _mesh(self, number: int, weights: Any) -> list[Mesh]:
        """A mesh's triangles, a part for each primitive that has some."""
        if weights is None and number in self.parts:
            return self.parts[number]
        mesh = self.tree["meshes"][number]
        chosen = mesh.get("weights") if weights is None else weights
        parts = [
            part
            for primitive in mesh.get("primitives", [])
            if (part := self._part(primitive, chosen or [])) is not None
        ]
        if weights is None:
            self.parts[number] = parts
        return parts

    def _part(self, primitive: dict[str, Any], weights: Any) -> Mesh | None:
        attributes = primitive.get("attributes", {})
        mode = int(primitive.get("mode", _TRIANGLES))
        if mode not in (_TRIANGLES, _STRIP, _FAN) or "POSITION" not in attributes:
            return None
        self._check_unpacked(primitive)
        points = self._accessor(int(attributes["POSITION"]), 3)
        for weight, target in zip(weights, primitive.get("targets", []), strict=False):
            if weight and "POSITION" in target:
                points = points + float(weight) * self._accessor(int(target["POSITION"]), 3)
        if "indices" in primitive:
            corners = self._accessor(int(primitive["indices"]), 1).reshape(-1).astype(np.int64)
        else:
            corners = np.arange(len(points))
        check_indices(self.label, corners, len(points))
        triangles = self._triangles(mode, corners)
        used, inverse = np.unique(triangles, return_inverse=True)
        return Mesh(points[used], inverse.reshape(-1, 3).astype(np.int64))

    def _triangles(self, mode: int, corners: Int[np.ndarray, " k"]) -> Int[np.ndarray, "m 3"]:
        if mode == _STRIP:
            return strip_triangles(corners)
        if mode == _FAN:
            return fan_triangles(corners)
        if len(corners) % 3:
            raise MeshError(
                f"{self.label} has triangles with {len(corners)} corners in all, which three does "
                "not divide",
                EXPORT_AGAIN,
            )
        return corners.reshape(-1, 3)

    def _check_unpacked(self, primitive: dict[str, Any]) -> None:
        """Raise MeshError for what Draco packs and the file does not also keep as it is."""
        if "KHR_draco_mesh_compression" not in primitive.get("extensions", {}):
            return
        used = [primitive["attributes"]["POSITION"]]
        used += [primitive["indices"]] if "indices" in primitive else []
        if any("bufferView" not in self.tree["accessors"][int(k)] for k in used):
            raise self._packed("Draco")

    def _packed(self, by: str) -> MeshError:
        return MeshError(
            f"{self.label} is packed by {by}, which is not read", f"Export it without {by}"
        )

    def _accessor(self, number: int, width: int) -> Float[np.ndarray, "n width"]:
        """Rows of numbers. Checked against what is stored before memory is taken."""
        accessor = self.tree["accessors"][number]
        count, kind = int(accessor["count"]), _TYPES[int(accessor["componentType"])]
        if _WIDTHS.get(accessor.get("type")) != width or count < 0:
            raise ValueError(f"accessor {number} is no {width} numbers a row")
        check_faces_allowed(self.label, count // 3, self.max_faces)
        if "bufferView" in accessor:
            at = int(accessor.get("byteOffset", 0))
            values = self._rows(int(accessor["bufferView"]), at, count, kind, width)
        elif "sparse" in accessor and count <= self.size:
            values = np.zeros((count, width), dtype=kind)
        else:
            raise MeshError(
                f"{self.label} declares {count} vertices or corners that it does not store",
                "Export the mesh again, without compression",
            )
        if "sparse" in accessor:
            values = self._replaced(values, accessor["sparse"], width)
        return _dequantised(values, bool(accessor.get("normalized", False)))

    def _replaced(self, values: np.ndarray, sparse: Any, width: int) -> np.ndarray:
        count, where = int(sparse["count"]), sparse["indices"]
        index = self._rows(
            int(where["bufferView"]), int(where.get("byteOffset", 0)), count,
            _TYPES[int(where["componentType"])], 1,
        ).reshape(-1)  # fmt: skip
        given = sparse["values"]
        rows = self._rows(
            int(given["bufferView"]), int(given.get("byteOffset", 0)), count,
            values.dtype.str, width,
        )  # fmt: skip
        check_indices(self.label, index.astype(np.int64), len(values))
        values = values.copy()
        values[index] = rows
        return values

    def _rows(self, view: int, at: int, count: int, kind: str, width: int) -> np.ndarray:
        """Rows of a view, copied from between whatever else it holds."""
        held = self.tree["bufferViews"][view]
        self._check_view(held)
        buffer = self._buffer(int(held["buffer"]))
        start, length = int(held.get("byteOffset", 0)), int(held["byteLength"])
        row = np.dtype(kind).itemsize * width
        stride = int(held.get("byteStride", 0)) or row
        if min(start, length, at) < 0 or stride < row:
            raise ValueError(f"view {view} has a size that cannot be")
        if start + length > len(buffer):
            raise MeshError(
                f"{self.label} is truncated: it declares {start + length} bytes of data, "
                f"{len(buffer)} are there",
                EXPORT_AGAIN,
            )
        if count == 0:
            return np.zeros((0, width), dtype=kind)
        if at + stride * (count - 1) + row > length:
            raise ValueError(f"view {view} is too short for {count} rows")
        return np.ndarray(
            (count, width), kind, buffer, start + at, (stride, np.dtype(kind).itemsize)
        )

    def _check_view(self, held: Any) -> None:
        for name in held.get("extensions", {}):
            if name in _PACKED and (
                name in self.tree.get("extensionsRequired", [])
                or "uri" not in self.tree["buffers"][int(held["buffer"])]
            ):
                raise self._packed(_PACKED[name])

    def _buffer(self, number: int) -> bytes:
        if number not in self.buffers:
            self.buffers[number] = self._buffer_bytes(number)
        return self.buffers[number]

    def _buffer_bytes(self, number: int) -> bytes:
        uri = self.tree["buffers"][number].get("uri")
        if uri is None:
            if number or self.body is None:
                raise ValueError(f"buffer {number} is nowhere")
            return self.body
        scheme, _, rest = str(uri).partition(":")
        if scheme.lower() == "data" and rest:
            head, _, held = rest.partition(",")
            if not head.endswith(";base64"):
                return unquote_to_bytes(held)
            try:
                return base64.b64decode(unquote_to_bytes(held), validate=False)
            except binascii.Error as error:
                raise ValueError(f"buffer {number} is no base64") from error
        found = self.beside(str(uri))
        self.outside.append(found)
        return found


def _posed(part: Mesh, pose: Float[np.ndarray, "4 4"]) -> Mesh:
    """The part in the scene's frame; turned round where the pose mirrors."""
    moved = part.transformed(pose)
    if np.linalg.det(pose[:3, :3]) < 0:
        return Mesh(moved.vertices_m, moved.faces[:, ::-1])
    return moved


def _local(node: dict[str, Any]) -> Float[np.ndarray, "4 4"]:
    """A node's pose in the node above it: a matrix, or translation, rotation and scale."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    pose = np.eye(4)
    turn = np.array(node.get("rotation", (0, 0, 0, 1)), dtype=np.float64)
    size = float(np.linalg.norm(turn))
    if not np.isfinite(size) or size == 0:
        raise ValueError("a node's rotation is no quaternion")
    pose[:3, :3] = Rotation.from_quat(turn / size).as_matrix()
    pose[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), dtype=np.float64).reshape(3)
    pose[:3, 3] = np.array(node.get("translation", (0, 0, 0)), dtype=np.float64).reshape(3)
    return pose


def _dequantised(values: np.ndarray, normalised: bool) -> Float[np.ndarray, "n width"]:
    """Stored numbers as reals: whole ones as shares of the largest, where that is declared."""
    reals = values.astype(np.float64)
    if not normalised or values.dtype.kind == "f":
        return reals
    return np.asarray(np.maximum(reals / np.iinfo(values.dtype).max, -1.0))
