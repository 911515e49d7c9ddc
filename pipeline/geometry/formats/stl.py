"""STL, text and binary.

The format has no shared corners, so that they are welded here; and it has no checks, so that
where a file contradicts itself the closed surface is believed, and the record says which.
"""

import re
import struct
from itertools import chain

import numpy as np
from jaxtyping import Float, Int

from pipeline.errors import MeshError
from pipeline.geometry.formats.surface import (
    EXPORT_AGAIN,
    Surface,
    check_faces_allowed,
    check_finite,
    surface_of,
)
from pipeline.geometry.formats.text import check_number, plain_triples, reals, text_of
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.polygons import Polygons
from pipeline.geometry.topology import is_closed
from pipeline.geometry.welding import weld

# Binary STL: 80 bytes of text and a count, then 50 bytes a triangle.
_HEADER_BYTES, _RECORD_BYTES = 84, 50
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("bits", "<u2")])
_NEVER_COUNTED = (0, 2**32 - 1)  # written first, to be filled in at the end
_TEXT_START = re.compile(rb"\s*solid\b", re.IGNORECASE)
# What a text file's first bytes have none of.
_BINARY = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")
_LOOKED_AT = 1024
_LARGEST = 1e12  # no unit makes a coordinate of an object as large as this
_FACET = re.compile(rb"[^\n]*\s*facet\s+normal.*\svertex\s", re.IGNORECASE | re.DOTALL)
_VERTEX = re.compile(rb"^[ \t]*vertex(?=[ \t\n])([^\n]*)", re.MULTILINE)
_MARK = re.compile(rb"^[ \t]*(vert(?=ex[ \t\n])|endl(?=oop[ \t\n]))", re.MULTILINE)
_NAME = re.compile(rb"^([ \t]*(?:end[ \t]*)?solid)[^\n]*", re.MULTILINE)
_WITHIN_LINE = re.compile(rb"[^ \t\n][ \t]+(vertex|endloop)[ \t\n]")
_KEYWORD = re.compile(
    rb"(facet\s+normal|outer\s+loop|vertex|endloop|end\s*facet|end\s*solid)(?=\s)"
)
# Corners are written as floats of 32 bits: one corner computed twice is this many units in the
# last place of its largest coordinate apart, or a last digit of a text of six or five digits.
_LAST_PLACES = 4 * float(np.finfo(np.float32).eps)
_LAST_DIGITS = (1e-6, 1e-5)


def read(label: str, data: bytes, max_faces: int) -> Surface:
    """An STL file's triangles, corners welded.

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
    The surface in the file's own unit, with a note
    where its count was not believed or corners were welded widely.

    Raises
    ------
    MeshError
        Where the file is no STL, is truncated, has no triangles or too many, or declares a number
        of triangles that neither it nor its surface bears out.
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text_of(label, data)  # says that it is UTF-16
    if _is_text(data):
        return _text(label, data, max_faces)
    return _binary(label, data, max_faces)


def _is_text(data: bytes) -> bool:
    start = data.removeprefix(b"\xef\xbb\xbf")
    if not _TEXT_START.match(start):
        return False
    if len(data) >= _HEADER_BYTES:
        (count,) = struct.unpack_from("<I", data, 80)
        if len(data) == _HEADER_BYTES + _RECORD_BYTES * count:
            return False
    head = start[:_LOOKED_AT].rstrip(b"\x1a\0 \t\r\n")
    binary = _BINARY.search(head)
    # A facet written out before the first of those bytes: text, and damaged.
    return not binary or bool(_FACET.match(head[: binary.start()]))


def _binary(label: str, data: bytes, max_faces: int) -> Surface:
    if len(data) < _HEADER_BYTES:
        raise MeshError(f"{label} is too short for an STL header", EXPORT_AGAIN)
    (declared,) = struct.unpack_from("<I", data, 80)
    present, surplus = divmod(len(data) - _HEADER_BYTES, _RECORD_BYTES)
    if declared == present and declared:
        check_faces_allowed(label, declared, max_faces)
        return _welded(label, _records(data, _HEADER_BYTES, declared))
    check_faces_allowed(label, present, max_faces)
    if declared != present and not _plausible(data, present):
        raise MeshError(f"{label} is neither a binary nor a text STL", EXPORT_AGAIN)
    if present == 0 and (declared == 0 or surplus == 0):
        if declared:
            raise _truncated(label, declared, present)
        raise MeshError(f"{label} has no triangles", EXPORT_AGAIN)
    if 0 < declared < present:
        joined = _joined_files(data)
        if joined is not None:
            return _welded(label, joined)
        counted = _welded(label, _records(data, _HEADER_BYTES, declared))
        if _closed(counted.mesh):
            return _with_note(counted, declared, present, "the declared ones, which are closed")
    whole = _welded(label, _records(data, _HEADER_BYTES, present)) if present else None
    if whole is not None and (_closed(whole.mesh) or declared in _NEVER_COUNTED):
        closed = ", which are closed" if _closed(whole.mesh) else ""
        return _with_note(whole, declared, present, f"those that are there{closed}")
    if declared > present:
        raise _truncated(label, declared, present)
    raise MeshError(
        f"{label} declares {declared} triangles and holds {present}, and neither number gives a "
        "closed surface",
        EXPORT_AGAIN,
    )


def _plausible(data: bytes, present: int) -> bool:
    """Whether records that are not counted right look like triangles at all."""
    if not present:
        return True
    corners = np.frombuffer(data, _RECORD, min(present, _LOOKED_AT), _HEADER_BYTES)["corners"]
    finite = corners[np.isfinite(corners)]
    return bool(np.abs(finite).max(initial=0.0) < _LARGEST)


def _truncated(label: str, declared: int, present: int) -> MeshError:
    return MeshError(
        f"{label} is truncated: its header declares {declared} triangles, {present} are there",
        EXPORT_AGAIN,
    )


def _with_note(surface: Surface, declared: int, present: int, held: str) -> Surface:
    note = f"its count declares {declared} triangles, {present} are there: took {held}"
    return Surface(surface.mesh, notes=(*surface.notes, note))


def _records(data: bytes, at: int, count: int) -> Float[np.ndarray, "m 3 3"]:
    records = np.frombuffer(data, dtype=_RECORD, count=count, offset=at)
    return records["corners"].astype(np.float64)


def _joined_files(data: bytes) -> Float[np.ndarray, "m 3 3"] | None:
    """The triangles of binary files written one behind the other, if that is what this is."""
    parts, at = [], 0
    while at < len(data):
        if len(data) - at < _HEADER_BYTES:
            return None
        (count,) = struct.unpack_from("<I", data, at + 80)
        at += _HEADER_BYTES
        if count == 0 or len(data) - at < _RECORD_BYTES * count:
            return None
        parts.append(_records(data, at, count))
        at += _RECORD_BYTES * count
    return np.concatenate(parts)


def _text(label: str, data: bytes, max_faces: int) -> Surface:
    text = text_of(label, data)
    first, _, rest = text.partition(b"\n")
    # A name may read like data, and the first line has nothing else that counts.
    text = text.lower() if not rest.strip() else first[:5].lower() + b"\n" + rest.lower()
    lines = _VERTEX.findall(text)
    check_faces_allowed(label, len(lines) // 3, max_faces)
    words = plain_triples(text, rb"vertex", len(lines))
    counts = _loops(text, len(lines))
    if words is None or counts is None or not lines:
        text = _one_keyword_a_line(text)
        words = _words(label, text, max_faces)
        counts = _ragged_loops(label, text)
    if not len(counts):
        raise MeshError(f"{label} has no triangles", EXPORT_AGAIN)
    try:
        numbers = reals(label, words)
    except MeshError:
        _refuse_vertex(label, text)
        raise
    points = numbers.reshape(-1, 3)
    if (counts == 3).all():
        surface = _welded(label, points.reshape(-1, 3, 3))
    else:
        surface = _welded_polygons(label, points, counts)
    ended = re.search(rb"^[ \t]*end[ \t]*solid", text[-4 * _LOOKED_AT :], re.MULTILINE)
    if not ended and not _closed(surface.mesh):
        raise MeshError(f"{label} is truncated: endsolid is missing", EXPORT_AGAIN)
    return surface


def _one_keyword_a_line(text: bytes) -> bytes:
    """The text with lines broken as most tools break them; as it is, where it has them so."""
    if not text.rstrip().count(b"\n"):
        return _KEYWORD.sub(rb"\n\1", text)  # its name cannot be told from its data
    unnamed = _NAME.sub(rb"\1", text)
    return _KEYWORD.sub(rb"\n\1", unnamed) if _WITHIN_LINE.search(unnamed) else text


def _words(label: str, text: bytes, max_faces: int) -> list[bytes]:
    rows = [line.split() for line in _VERTEX.findall(text)]
    check_faces_allowed(label, len(rows) // 3, max_faces)
    if any(len(row) != 3 for row in rows):
        _refuse_vertex(label, text)
    return list(chain.from_iterable(rows))


def _loops(text: bytes, vertices: int) -> Int[np.ndarray, " m"] | None:
    """Three corners for each loop, where that is so."""
    marks = _MARK.findall(text)
    if marks != [b"vert", b"vert", b"vert", b"endl"] * (vertices // 3):
        return None
    return np.full(vertices // 3, 3, dtype=np.int64)


def _ragged_loops(label: str, text: bytes) -> Int[np.ndarray, " m"]:
    """Corners of each loop. Raises MeshError for one that is not ended, or has fewer than 3."""
    marks = _MARK.findall(text)
    if marks[-1:] == [b"vert"]:
        raise MeshError(f"{label} is truncated: its last facet has no end", EXPORT_AGAIN)
    ends = np.flatnonzero(np.array([mark == b"endl" for mark in marks], dtype=bool))
    counts = np.diff(ends, prepend=-1) - 1
    short = np.flatnonzero(counts < 3)
    if len(short):
        found = [mark for mark in _MARK.finditer(text) if mark[1] == b"endl"][short[0]]
        line = text.count(b"\n", 0, found.start()) + 1
        raise MeshError(
            f"{label} has a facet of {counts[short[0]]} corners, which ends at line {line}",
            EXPORT_AGAIN,
        )
    return counts


def _refuse_vertex(label: str, text: bytes) -> None:
    for found in _VERTEX.finditer(text):
        line = text.count(b"\n", 0, found.start()) + 1
        where = f"{label} line {line}"
        words = found[1].split()
        for word in words:
            check_number(where, word)
        if len(words) != 3:
            raise MeshError(f"{where} has a vertex of {len(words)} numbers", EXPORT_AGAIN)


def _welded(label: str, triangles: Float[np.ndarray, "m 3 3"]) -> Surface:
    """Triangles over shared corners."""
    counts = np.full(len(triangles), 3, dtype=np.int64)
    return _welded_polygons(label, triangles.reshape(-1, 3), counts)


def _welded_polygons(
    label: str, points: Float[np.ndarray, "n 3"], counts: Int[np.ndarray, " m"]
) -> Surface:
    """Welded as little as closes the surface; where nothing does, in the last place alone."""
    check_finite(label, points)
    last_places = _LAST_PLACES * float(np.abs(points).max(initial=0.0))
    first, corners = weld(points, last_places)
    surface = surface_of(label, Polygons(points[first], corners, counts))
    if _closed(surface.mesh):
        return surface
    extent = float(np.ptp(points, axis=0).max())
    for share in _LAST_DIGITS:
        if share * extent > last_places:
            wider, group = weld(points[first], share * extent)
            if len(wider) == len(first):
                continue
            joined = surface_of(label, Polygons(points[first][wider], group[corners], counts))
            if _closed(joined.mesh):
                note = f"welded corners up to {share:g} of the longest extent apart"
                return Surface(joined.mesh, notes=(*joined.notes, note))
    return surface


def _closed(mesh: Mesh) -> bool:
    """Closed but for triangles that welding left without an area."""
    a, b, c = mesh.faces.T
    kept = mesh.faces[(a != b) & (b != c) & (c != a)]
    return len(kept) > 0 and is_closed(Mesh(mesh.vertices_m, kept))
