"""OFF, and its relatives with normals, colours and texture coordinates behind the positions."""

import re
from collections.abc import Sequence
from itertools import chain

import numpy as np
from jaxtyping import Float

from pipeline.errors import MeshError
from pipeline.geometry.formats.surface import (
    EXPORT_AGAIN,
    Surface,
    check_faces_allowed,
    check_indices,
    check_long_enough,
    cut_or_malformed,
    surface_of,
)
from pipeline.geometry.formats.text import integers, reals, text_of, without_comments
from pipeline.geometry.polygons import Polygons

# Texture coordinates, colours, normals, a fourth coordinate, any dimension: in this order.
_HEADER = re.compile(rb"(?P<kind>(ST)?(N?C|C?N)?(?P<four>4)?(?P<any>n)?)OFF(?P<rest>.*)", re.DOTALL)
_LOWER = re.compile(rb"(st)?(nc?|cn?)?4?off", re.IGNORECASE)
# "0 0 0\n" and "3 0 1 2\n" are the shortest rows.
_VERTEX_BYTES, _FACE_BYTES = 6, 2


def read(label: str, data: bytes, max_faces: int) -> Surface:
    """An OFF file's faces.

    Parameters
    ----------
    label
        The file, for what is said of it.
    data
        The whole file.
    max_faces
        More are refused before memory is taken for them.

    Returns
    -------
    The surface in the file's own unit.

    Raises
    ------
    MeshError
        Where the file is no OFF, is binary, ends before its last face, has no faces or too many,
        or a face refers to a vertex that is not there.
    """
    if re.match(rb"\s*\S*OFF\s+BINARY", data[:64]):
        raise MeshError(f"{label} is binary OFF, which is not read", "Export it as text OFF or PLY")
    text = without_comments(text_of(label, data))
    lines = [line for line in (line.split() for line in text.split(b"\n")) if line]
    four, lines = _header(label, lines)
    vertices, faces = _counts(label, lines)
    check_faces_allowed(label, faces, max_faces)
    check_long_enough(label, len(data) + 1, _VERTEX_BYTES * vertices + _FACE_BYTES * faces, True)
    rows = lines[1:]
    if len(rows) < vertices + faces or any(len(row) < 3 for row in rows[:vertices]):
        rows = _from_stream(label, lines, vertices, faces)
    points = _points(label, rows[:vertices], four)
    polygons = _polygons(label, points, rows[vertices : vertices + faces])
    if faces == 0:
        raise MeshError(
            f"{label} has {vertices} points and no faces", "A point cloud must be meshed first"
        )
    check_indices(label, polygons.corners, vertices)
    return surface_of(label, polygons)


def _header(label: str, lines: list[list[bytes]]) -> tuple[bool, list[list[bytes]]]:
    """Whether positions have a fourth coordinate, and the lines from the counts on."""
    if not lines:
        raise MeshError(f"{label} has no OFF header", EXPORT_AGAIN)
    first = lines[0][0]
    if first.isdigit() and len(lines[0]) in (2, 3):
        return False, lines  # the header's word may be left out
    if _LOWER.match(first) and not _HEADER.match(first):
        first = first.upper()
    found = _HEADER.match(first)
    if not found or (found["rest"] and not found["rest"].isdigit()):
        raise MeshError(f"{label} has no OFF header", EXPORT_AGAIN)
    rest = [word for word in (found["rest"], *lines[0][1:]) if word]
    lines = [rest, *lines[1:]] if rest else lines[1:]
    if found["any"]:
        if not lines or lines[0][0] != b"3":
            dimension = lines[0][0].decode(errors="replace") if lines else "no"
            raise MeshError(f"{label} is in {dimension} dimensions", "Export it in three")
        lines = [lines[0][1:], *lines[1:]] if lines[0][1:] else lines[1:]
    return bool(found["four"]), lines


def _counts(label: str, lines: list[list[bytes]]) -> tuple[int, int]:
    counts = lines[0][:2] if lines else []
    if len(counts) < 2 or not all(re.fullmatch(rb"\d{1,18}", word) for word in counts):
        raise MeshError(f"{label} does not declare its vertices and faces", EXPORT_AGAIN)
    return int(counts[0]), int(counts[1])


def _from_stream(
    label: str, lines: list[list[bytes]], vertices: int, faces: int
) -> list[list[bytes]]:
    """Rows of a file that does not keep to lines: positions alone, and faces without colours."""
    words = list(chain.from_iterable(lines))
    at = 3 if len(lines[0]) != 2 else 2
    rows = [words[at + 3 * k : at + 3 * k + 3] for k in range(vertices)]
    at += 3 * vertices
    for _ in range(faces):
        if at >= len(words):
            break
        size = words[at]
        end = at + 1 + (int(size) if re.fullmatch(rb"\d{1,9}", size) else 0)
        if end > len(words):
            break
        rows.append(words[at:end])
        at = end
    if len(rows) < vertices + faces or (vertices and len(rows[vertices - 1]) < 3):
        there = len(lines) - 1
        raise MeshError(
            f"{label} is truncated: its header declares {vertices} vertices and {faces} faces, "
            f"{there} rows are there",
            EXPORT_AGAIN,
        )
    return rows


def _points(label: str, rows: Sequence[list[bytes]], four: bool) -> Float[np.ndarray, "n 3"]:
    width = 4 if four else 3
    if any(len(row) < width for row in rows):
        raise MeshError(f"{label} has vertices of fewer than {width} numbers", EXPORT_AGAIN)
    words = list(chain.from_iterable(row[:width] for row in rows))
    points = reals(label, words).reshape(-1, width)
    if four:
        if (points[:, 3] == 0).any():
            raise MeshError(f"{label} has vertices at infinity (w = 0)", "Mend the mesh")
        points = points[:, :3] / points[:, 3:]
    return points


def _polygons(
    label: str, points: Float[np.ndarray, "n 3"], rows: Sequence[list[bytes]]
) -> Polygons:
    counts = integers(label, [row[0] for row in rows])
    lengths = np.fromiter(map(len, rows), dtype=np.int64, count=len(rows))
    short = (counts < 0) | (counts >= lengths)
    if short.any():
        row = int(np.argmax(short))
        raise MeshError(
            f"{label} is {cut_or_malformed(row, len(rows))}: face {row + 1} declares "
            f"{counts[row]} corners, {lengths[row] - 1} are there",
            EXPORT_AGAIN,
        )
    words = chain.from_iterable(
        row[1 : 1 + count] for row, count in zip(rows, counts.tolist(), strict=True)
    )
    return Polygons(points, integers(label, list(words)), counts)
