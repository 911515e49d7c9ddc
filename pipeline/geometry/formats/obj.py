"""Wavefront OBJ: its vertices and faces; materials, textures and normals stay unread.

Faces may stand before, among and behind the vertices, and may count them from the first or back
from where the face stands; a vertex may have a weight and colours behind its position. Lines
and points are no surface and are left aside.
"""

import re
from collections.abc import Sequence
from itertools import chain
from typing import NoReturn

import numpy as np
from jaxtyping import Float, Int

from pipeline.errors import MeshError
from pipeline.geometry.formats.surface import (
    EXPORT_AGAIN,
    Surface,
    check_faces_allowed,
    surface_of,
)
from pipeline.geometry.formats.text import (
    check_number,
    check_whole_number,
    integers,
    plain_triples,
    reals,
    text_of,
    without_comments,
)
from pipeline.geometry.polygons import Polygons

_VERTEX = re.compile(rb"^[ \t]*v(?=[ \t\n])([^\n]*)", re.MULTILINE)
_FACE = re.compile(rb"^[ \t]*fo?(?=[ \t\n])([^\n]*)", re.MULTILINE)
_ENDS_IN_FACE = re.compile(rb"\n[ \t]*f[^\n]*\n\Z")
_CONTINUED = re.compile(rb"(?:[^\n]*\\[ \t]*\n)+[^\n]*")
_CONTINUES = re.compile(rb"\\[ \t]*\n")
_FREE_FORM = re.compile(rb"^[ \t]*(surf|curv)[ \t]", re.MULTILINE)
_DRAWING = re.compile(rb"^[ \t]*l[ \t]", re.MULTILINE)
_CALL = re.compile(rb"^[ \t]*call[ \t]+([^\n]*)", re.MULTILINE)


def read(label: str, data: bytes, max_faces: int) -> Surface:
    """An OBJ file's faces.

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
        Where the file is no text, a line is none that OBJ knows, there are no faces or too many,
        or a face refers to a vertex that is not there.
    """
    text = _joined(without_comments(text_of(label, data)))
    lines = _FACE.findall(text)
    check_faces_allowed(label, len(lines), max_faces)
    vertices = _vertices(label, text)
    if not lines:
        raise _no_faces(label, text, len(vertices))
    if _CALL.search(text):
        raise MeshError(f"{label} calls another file", "Export the mesh as one file")
    words = plain_triples(text, rb"f", len(lines))
    counts = np.full(len(lines), 3, dtype=np.int64)
    if words is None:
        rows = [line.split() for line in lines]
        counts = np.fromiter(map(len, rows), dtype=np.int64, count=len(rows))
        words = list(chain.from_iterable(rows))
        if len(rows[-1]) < 3 and data[-1:] not in b"\r\n" and _ENDS_IN_FACE.search(text):
            raise MeshError(f"{label} is truncated: it ends within a face", EXPORT_AGAIN)
    corners = _corners(label, text, words, counts, len(vertices))
    return surface_of(label, Polygons(vertices, corners, counts))


def _joined(text: bytes) -> bytes:
    """Lines that a backslash continues as one, the count of lines kept."""

    def join(found: re.Match[bytes]) -> bytes:
        return _CONTINUES.sub(b" ", found[0]) + b"\n" * found[0].count(b"\n")

    return _CONTINUED.sub(join, text) if b"\\" in text else text


def _vertices(label: str, text: bytes) -> Float[np.ndarray, "n 3"]:
    lines = _VERTEX.findall(text)
    words, width = plain_triples(text, rb"v", len(lines)), 3
    if words is None:
        rows = [line.split() for line in lines]
        lengths = set(map(len, rows))
        if lengths and min(lengths) < 3:
            _refuse_line(label, text, _VERTEX, lambda words: len(words) < 3)
        if len(lengths) > 1:  # some have a weight or colours, others do not
            rows = [row[:3] for row in rows]
        width = len(rows[0]) if rows else 3
        words = list(chain.from_iterable(rows))
    try:
        numbers = reals(label, words)
    except MeshError:
        _refuse_number(label, text)
    return numbers.reshape(-1, width)[:, :3]


def _corners(
    label: str,
    text: bytes,
    named: Sequence[bytes],
    counts: Int[np.ndarray, " m"],
    vertices: int,
) -> Int[np.ndarray, " k"]:
    """Vertex indices from 0 of all corners, face after face."""
    joined = b" ".join(named)
    words = re.sub(rb"/\S*", b"", joined).split() if b"/" in joined else named
    if len(words) != len(named):
        _refuse_line(label, text, _FACE, lambda row: any(word[:1] == b"/" for word in row))
    try:
        numbers = integers(label, words)
    except MeshError:
        _refuse_corner(label, text)
    corners = numbers - 1
    if len(numbers) and numbers.min() < 0:
        # -1 is the last vertex before the face.
        at = [match.start() for match in _VERTEX.finditer(text)]
        faces = [match.start() for match in _FACE.finditer(text)]
        standing = np.repeat(np.searchsorted(at, faces), counts)
        corners = np.where(numbers < 0, standing + numbers, corners)
    wrong = (corners < 0) | (corners >= vertices)
    if wrong.any():
        _refuse_index(label, int(numbers[np.argmax(wrong)]), vertices)
    return corners


def _refuse_index(label: str, named: int, vertices: int) -> NoReturn:
    if named == 0:
        what = "refers to vertex 0, and OBJ counts from 1"
    elif named < 0:
        what = f"refers to vertex {named}, counted back, and has fewer vertices before it"
    else:
        what = f"refers to vertex {named}, and it has {vertices}"
    raise MeshError(f"{label} has a face that {what}", "Export the mesh again")


def _refuse_number(label: str, text: bytes) -> NoReturn:
    for found in _VERTEX.finditer(text):
        for word in found[1].split():
            check_number(f"{label} line {_line(text, found)}", word)
    raise MeshError(f"{label} has vertices that are no numbers", EXPORT_AGAIN)


def _refuse_corner(label: str, text: bytes) -> NoReturn:
    for found in _FACE.finditer(text):
        for word in found[1].split():
            check_whole_number(f"{label} line {_line(text, found)}", word.partition(b"/")[0])
    raise MeshError(f"{label} has faces whose corners are no numbers", EXPORT_AGAIN)


def _refuse_line(label: str, text: bytes, kind: re.Pattern[bytes], bad: object) -> NoReturn:
    assert callable(bad)
    for found in kind.finditer(text):
        if bad(found[1].split()):
            shown = found[0].strip()[:40].decode("utf-8", errors="replace")
            raise MeshError(
                f"{label} line {_line(text, found)} is cut short or malformed: '{shown}'",
                EXPORT_AGAIN,
            )
    raise MeshError(f"{label} has a malformed line", EXPORT_AGAIN)


def _no_faces(label: str, text: bytes, vertices: int) -> MeshError:
    if _FREE_FORM.search(text):
        return MeshError(
            f"{label} has free-form curves or surfaces and no faces", "Export it as polygons"
        )
    if _DRAWING.search(text):
        return MeshError(f"{label} has no faces, only lines", "Export its surface")
    if vertices:
        return MeshError(
            f"{label} has {vertices} points and no faces", "A point cloud must be meshed first"
        )
    return MeshError(f"{label} has neither vertices nor faces of OBJ", EXPORT_AGAIN)


def _line(text: bytes, found: re.Match[bytes]) -> int:
    return text.count(b"\n", 0, found.start()) + 1
