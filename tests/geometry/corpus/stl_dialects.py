"""One solid written as STL in each way that some tool writes it."""

import struct
from dataclasses import dataclass

import numpy as np

from tests.geometry.corpus.solids import Solid, corners_of_triangles


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
