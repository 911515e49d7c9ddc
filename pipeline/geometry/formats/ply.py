"""PLY, text and binary of either order: vertices, faces of any list types, triangle strips."""

import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from jaxtyping import Float, Int

from pipeline.errors import MeshError
from pipeline.geometry.formats.strips import strip_triangles
from pipeline.geometry.formats.surface import (
    EXPORT_AGAIN,
    Surface,
    check_faces_allowed,
    check_indices,
    check_long_enough,
    cut_or_malformed,
    surface_of,
)
from pipeline.geometry.formats.text import integers, reals, text_of
from pipeline.geometry.polygons import Polygons

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
    **{"int64": "i8", "uint64": "u8"},
}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNER_LISTS = ("vertex_indices", "vertex_index", "vertex_indexes", "vertices")
_MOST_HEADER_BYTES = 64 * 1024
_START = re.compile(rb"ply[ \t]*(\r\n|\n|\r)")
_END = re.compile(rb"[\r\n][ \t]*end_header[ \t]*(\r\n|\n|\r|$)")
_NUMBERS_ALONE = re.compile(rb"[0-9eE+\-. \t\r\n]{24,256}")


@dataclass(frozen=True)
class _Property:
    name: str
    kind: str
    """numpy's code without the order of bytes."""
    length: str = ""
    """Of a list: the code of its length."""


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]

    @property
    def lists(self) -> tuple[_Property, ...]:
        return tuple(held for held in self.properties if held.length)


@dataclass(frozen=True, eq=False)
class _Lists:
    """One list of every row: values end to end, and how many each row has."""

    values: Int[np.ndarray, " k"]
    counts: Int[np.ndarray, " m"]


def read(label: str, data: bytes, max_faces: int) -> Surface:
    """A PLY file's faces and triangle strips.

    Raises MeshError where the file is no PLY, ends before its last face, has no faces or too
    many, or a face refers to a vertex that is not there.
    """
    order, elements, body = _header(label, data, max_faces)
    wanted = [element for element in elements if element.name in ("vertex", "face", "tristrips")]
    vertices = next((element for element in wanted if element.name == "vertex"), None)
    if vertices is None:
        raise MeshError(f"{label} has no vertices", EXPORT_AGAIN)
    for axis in "xyz":
        if not any(held.name == axis and not held.length for held in vertices.properties):
            raise MeshError(f"{label} has vertices with no {axis}", EXPORT_AGAIN)
    if sum(element.count for element in wanted if element is not vertices) == 0:
        raise MeshError(
            f"{label} has {vertices.count} points and no faces",
            "A point cloud must be meshed first",
        )
    reader = _rows_of_text if not order else _rows_of_bytes
    points, faces, strips = reader(label, data, order, elements, body)
    polygons = _polygons(points, faces, strips)
    check_indices(label, polygons.corners, len(points))
    check_faces_allowed(label, len(polygons.counts), max_faces)
    return surface_of(label, polygons)


def _polygons(
    points: Float[np.ndarray, "n 3"], faces: _Lists | None, strips: _Lists | None
) -> Polygons:
    corners, counts = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    if faces is not None:
        corners.append(faces.values)
        counts.append(faces.counts)
    if strips is not None:
        # -1 ends a strip, and so does the end of a row.
        ends = np.flatnonzero(strips.values < 0)
        cuts = np.unique(np.concatenate([ends, np.cumsum(strips.counts)]))
        for part in np.split(strips.values, cuts):
            triangles = strip_triangles(part[part >= 0])
            corners.append(triangles.reshape(-1))
            counts.append(np.full(len(triangles), 3, dtype=np.int64))
    return Polygons(points, np.concatenate(corners), np.concatenate(counts))


def _header(label: str, data: bytes, max_faces: int) -> tuple[str, list[_Element], int]:
    """The order of bytes ("" for text), the elements, and where the body begins."""
    start = _START.match(data)
    if not start:
        raise MeshError(f"{label} has no PLY header", EXPORT_AGAIN)
    end = _END.search(data, 0, _MOST_HEADER_BYTES)
    if not end:
        raise MeshError(f"{label} is truncated: its header has no end_header", EXPORT_AGAIN)
    # A lone CR ends the header's lines: an LF behind it is the first byte of the body.
    break_bytes = 1 if start[1] == b"\r" and end[1] == b"\r\n" else len(end[1])
    form, elements = "", list[_Element]()
    for line in re.split(rb"\r\n|\n|\r", data[: end.start()]):
        words = line.decode("ascii", errors="replace").split()
        if words[:1] == ["format"] and len(words) > 1:
            form = words[1]
        elif words[:1] == ["element"] and len(words) == 3:
            if not re.fullmatch(r"[0-9]{1,18}", words[2]):
                raise MeshError(f"{label} declares {words[2]!r} {words[1]} elements", EXPORT_AGAIN)
            elements.append(_Element(words[1], int(words[2]), ()))
        elif words[:1] == ["property"] and len(words) > 2 and elements:
            last = elements[-1]
            held = (*last.properties, _property(label, words))
            elements[-1] = _Element(last.name, last.count, held)
    if form not in _ORDERS:
        raise MeshError(
            f"{label} is in a form of PLY that is none: '{form}'", "Export it as text or binary"
        )
    body = end.start(1) + break_bytes
    order = _ORDERS[form]
    if order and _NUMBERS_ALONE.match(data, body) and not re.search(rb"[^\t-\r -~]", data[body:]):
        raise MeshError(
            f"{label} is declared {form}, and its body is text",
            "Declare it as ascii, or export again",
        )
    for element in elements:
        if element.name in ("face", "tristrips"):
            check_faces_allowed(label, element.count, max_faces)
    least = sum(element.count * _least_bytes(element, order) for element in elements)
    if order:
        check_long_enough(label, len(data) - body, least)
    elif least > len(data) - body + 1:
        text_of(label, data)  # a body that is no text has another reason to be short
        check_long_enough(label, len(data) - body + 1, least, least=True)
    return order, elements, body


def _property(label: str, words: list[str]) -> _Property:
    listed = words[1] == "list"
    kinds = words[2:4] if listed else words[1:2]
    for kind in kinds:
        if kind not in _TYPES:
            raise MeshError(
                f"{label} has properties of a type that PLY has not: '{kind}'", EXPORT_AGAIN
            )
    if listed and len(words) > 4:
        if _TYPES[kinds[0]][0] == "f":
            raise MeshError(f"{label} has lists whose length is a {kinds[0]}", EXPORT_AGAIN)
        return _Property(words[4], _TYPES[kinds[1]], _TYPES[kinds[0]])
    if listed:
        raise MeshError(f"{label} has a list without a name", EXPORT_AGAIN)
    return _Property(words[2], _TYPES[kinds[0]])


def _least_bytes(element: _Element, order: str) -> int:
    if not order:
        return 2 * len(element.properties)  # a digit, and what parts it from the next
    return sum(int((held.length or held.kind)[1]) for held in element.properties)


def _corner_list(label: str, element: _Element) -> _Property:
    for name in _CORNER_LISTS:
        for held in element.lists:
            if held.name == name:
                return held
    whole = [held for held in element.lists if held.kind[0] in "iu"]
    if len(whole) != 1:
        raise MeshError(f"{label} has faces without a list of their vertices", EXPORT_AGAIN)
    return whole[0]


def _rows_of_bytes(
    label: str, data: bytes, order: str, elements: Sequence[_Element], at: int
) -> tuple[Float[np.ndarray, "n 3"], _Lists | None, _Lists | None]:
    points = np.zeros((0, 3))
    found: dict[str, _Lists] = {}
    for element in elements:
        if element.name == "vertex" and not element.lists:
            fields = _record(element.properties, order, {})
            check_long_enough(label, len(data) - at, fields.itemsize * element.count)
            rows = np.frombuffer(data, fields, element.count, at) if element.count else None
            if rows is not None:
                points = np.stack([rows[_field(element, axis)] for axis in "xyz"], axis=1)
                points = points.astype(np.float64)
            at += fields.itemsize * element.count
        elif element.name in ("face", "tristrips") and element.count:
            chosen = _corner_list(label, element)
            found[element.name], at = _lists(label, data, order, element, chosen, at)
        elif element.name == "vertex":
            raise MeshError(f"{label} has vertices with lists", "Export the mesh again")
        else:
            _, at = _lists(label, data, order, element, None, at)
        if len(found) + (len(points) > 0) == _wanted(elements):
            break
    return points, found.get("face"), found.get("tristrips")


def _wanted(elements: Sequence[_Element]) -> int:
    names = ("vertex", "face", "tristrips")
    return sum(element.name in names and element.count > 0 for element in elements)


def _field(element: _Element, name: str) -> str:
    return f"{[held.name for held in element.properties].index(name)}"


def _record(
    properties: Sequence[_Property], order: str, lengths: dict[int, int]
) -> "np.dtype[np.void]":
    """One row, its lists as long as is said: fields are named by their number."""
    fields: list[tuple[str, str] | tuple[str, str, int]] = []
    for k, held in enumerate(properties):
        if held.length:
            fields.append((f"length {k}", order + held.length))
            fields.append((f"{k}", order + held.kind, lengths[k]))
        else:
            fields.append((f"{k}", order + held.kind))
    return np.dtype(fields)


def _lists(
    label: str, data: bytes, order: str, element: _Element, chosen: _Property | None, at: int
) -> tuple[_Lists, int]:
    """One list of each row, and where the rows end."""
    equal = _equal_lists(label, data, order, element, chosen, at)
    return equal if equal is not None else _any_lists(label, data, order, element, chosen, at)


def _equal_lists(
    label: str, data: bytes, order: str, element: _Element, chosen: _Property | None, at: int
) -> tuple[_Lists, int] | None:
    """As above where all rows are as the first: one look at memory. None where they are not."""
    nothing = np.zeros(0, dtype=np.int64)
    if element.count == 0 or not element.properties:
        return _Lists(nothing, nothing), at
    lengths: dict[int, int] = {}
    end = at
    for k, held in enumerate(element.properties):
        if held.length:
            if end + int(held.length[1]) > len(data):
                return None
            lengths[k] = int(np.frombuffer(data, order + held.length, 1, end)[0])
            if not 0 <= lengths[k] <= len(data):
                return None
            end += int(held.length[1]) + lengths[k] * int(held.kind[1])
        else:
            end += int(held.kind[1])
    if at + (end - at) * element.count > len(data):
        return None
    fields = _record(element.properties, order, lengths)
    rows = np.frombuffer(data, fields, element.count, at)
    if any((rows[f"length {k}"] != length).any() for k, length in lengths.items()):
        return None
    end = at + fields.itemsize * element.count
    if chosen is None:
        return _Lists(nothing, nothing), end
    k = element.properties.index(chosen)
    values = _whole(label, rows[f"{k}"].reshape(-1))
    return _Lists(values, np.full(element.count, lengths[k], dtype=np.int64)), end


def _any_lists(
    label: str, data: bytes, order: str, element: _Element, chosen: _Property | None, at: int
) -> tuple[_Lists, int]:
    """As above, row by row."""
    sign = sys.intern("big" if order == ">" else "little")
    layout = [
        (held.length != "", int((held.length or held.kind)[1]), int(held.kind[1]),
         held.length[:1] == "i", held is chosen)
        for held in element.properties
    ]  # fmt: skip
    starts, counts, total = list[int](), list[int](), len(data)
    for row in range(element.count):
        for listed, size, item, signed, wanted in layout:
            if not listed:
                at += size
                continue
            length = int.from_bytes(data[at : at + size], sign, signed=signed)  # type: ignore[arg-type]
            if length < 0:
                raise MeshError(f"{label} has a list of {length} values", EXPORT_AGAIN)
            at += size
            if wanted:
                starts.append(at)
                counts.append(length)
            at += length * item
        if at > total:
            raise MeshError(
                f"{label} is truncated: its header declares {element.count} {element.name} "
                f"elements, {row} are there",
                EXPORT_AGAIN,
            )
    if chosen is None:
        return _Lists(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)), at
    lengths = np.array(counts, dtype=np.int64)
    item = int(chosen.kind[1])
    within = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    byte = np.repeat(np.array(starts, dtype=np.int64), lengths) + within * item
    held = np.frombuffer(data, dtype=np.uint8)[byte[:, None] + np.arange(item)]
    return _Lists(_whole(label, held.reshape(-1).view(order + chosen.kind)), lengths), at


def _whole(label: str, values: np.ndarray) -> Int[np.ndarray, " k"]:
    whole = values.astype(np.int64)
    if values.dtype.kind == "f" and not (whole == values).all():
        raise MeshError(f"{label} has vertex numbers that are not whole", EXPORT_AGAIN)
    return np.asarray(whole)


def _rows_of_text(
    label: str, data: bytes, order: str, elements: Sequence[_Element], at: int
) -> tuple[Float[np.ndarray, "n 3"], _Lists | None, _Lists | None]:
    """One row a line, as the format has it; what a line has beyond its row is left aside."""
    text_of(label, data)  # names the line where it is none
    lines = [
        row for row in (line.split() for line in text_of(label, data[at:]).split(b"\n")) if row
    ]
    points = np.zeros((0, 3))
    found: dict[str, _Lists] = {}
    first = 0
    for element in elements:
        if not element.properties:
            continue
        rows = lines[first : first + element.count]
        first += element.count
        if element.name not in ("vertex", "face", "tristrips") or not element.count:
            continue
        if len(rows) < element.count:
            raise MeshError(
                f"{label} is truncated: its header declares {element.count} {element.name} "
                f"elements, {len(rows)} are there",
                EXPORT_AGAIN,
            )
        if element.name == "vertex":
            points = _points(label, element, rows)
        else:
            found[element.name] = _listed(label, element, rows)
    return points, found.get("face"), found.get("tristrips")


def _points(label: str, element: _Element, rows: Sequence[list[bytes]]) -> Float[np.ndarray, "n 3"]:
    if element.lists:
        raise MeshError(f"{label} has vertices with lists", "Export the mesh again")
    width = len(element.properties)
    _check_row_lengths(label, element, rows, width)
    names = [held.name for held in element.properties]
    x, y, z = (names.index(axis) for axis in "xyz")
    words = chain.from_iterable((row[x], row[y], row[z]) for row in rows)
    return reals(label, list(words)).reshape(-1, 3)


def _listed(label: str, element: _Element, rows: Sequence[list[bytes]]) -> _Lists:
    chosen = _corner_list(label, element)
    before = element.properties[: element.properties.index(chosen)]
    ahead = sum(not held.length for held in before)
    if len(before) == ahead:
        _check_row_lengths(label, element, rows, ahead + 1)
        starts = [ahead] * len(rows)
    else:
        starts = [_start(label, row, before) for row in rows]
    counts = integers(label, [row[at] for row, at in zip(rows, starts, strict=True)])
    lengths = np.array([len(row) - at - 1 for row, at in zip(rows, starts, strict=True)])
    short = (counts < 0) | (counts > lengths)
    if short.any():
        row = int(np.argmax(short))
        raise MeshError(
            f"{label} is {cut_or_malformed(row, len(rows))}: {element.name} {row + 1} declares "
            f"{counts[row]} vertices, {lengths[row]} are there",
            EXPORT_AGAIN,
        )
    words = chain.from_iterable(
        row[at + 1 : at + 1 + count]
        for row, at, count in zip(rows, starts, counts.tolist(), strict=True)
    )
    return _Lists(integers(label, list(words)), counts)


def _start(label: str, row: list[bytes], before: Sequence[_Property]) -> int:
    """Which word of a row is its list's length, behind other lists."""
    at = 0
    for held in before:
        length = int(integers(label, row[at : at + 1])[0]) if held.length and at < len(row) else 0
        at += 1 + max(length, 0)
    if at >= len(row):
        raise MeshError(f"{label} has a face whose line is too short", EXPORT_AGAIN)
    return at


def _check_row_lengths(
    label: str, element: _Element, rows: Sequence[list[bytes]], least: int
) -> None:
    for number, row in enumerate(rows):
        if len(row) < least:
            raise MeshError(
                f"{label} is {cut_or_malformed(number, len(rows))}: {element.name} {number + 1} "
                f"has {len(row)} numbers of {least}",
                EXPORT_AGAIN,
            )
