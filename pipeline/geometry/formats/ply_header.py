"""What a PLY file's header declares, held against its size before anything is allocated."""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from pipeline.errors import MeshError
from pipeline.geometry.formats.surface import EXPORT_AGAIN, check_faces_allowed, check_long_enough
from pipeline.geometry.formats.text import text_of

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
    **{"int64": "i8", "uint64": "u8"},
}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNER_LISTS = ("vertex_indices", "vertex_index", "vertex_indexes", "vertices")
_MOST_HEADER_BYTES = 64 * 1024  # a hundred times an honest one
_START = re.compile(rb"ply[ \t]*(\r\n|\n|\r)")
_END = re.compile(rb"[\r\n][ \t]*end_header[ \t]*(\r\n|\n|\r|$)")
_NUMBERS_ALONE = re.compile(rb"[0-9eE+\-. \t\r\n]{24,256}")


@dataclass(frozen=True)
class Property:
    name: str
    kind: str
    """numpy's code without the order of bytes."""
    length: str = ""
    """Of a list: the code of its length."""


@dataclass(frozen=True)
class Element:
    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def lists(self) -> tuple[Property, ...]:
        return tuple(held for held in self.properties if held.length)


@dataclass(frozen=True, eq=False)
class Lists:
    """One list of every row: values end to end, and how many each row has."""

    values: Int[np.ndarray, " k"]
    counts: Int[np.ndarray, " m"]


def read_header(label: str, data: bytes, max_faces: int) -> tuple[str, list[Element], int]:
    """The order of bytes ("" for text), the elements, and where the body begins."""
    start = _START.match(data)
    if not start:
        raise MeshError(f"{label} has no PLY header", EXPORT_AGAIN)
    end = _END.search(data, 0, _MOST_HEADER_BYTES)
    if not end:
        raise MeshError(f"{label} is truncated: its header has no end_header", EXPORT_AGAIN)
    # A lone CR ends the header's lines: an LF behind it is the first byte of the body.
    break_bytes = 1 if start[1] == b"\r" and end[1] == b"\r\n" else len(end[1])
    form, elements = "", list[Element]()
    for line in re.split(rb"\r\n|\n|\r", data[: end.start()]):
        words = line.decode("ascii", errors="replace").split()
        if words[:1] == ["format"] and len(words) > 1:
            form = words[1]
        elif words[:1] == ["element"] and len(words) == 3:
            if not re.fullmatch(r"[0-9]{1,18}", words[2]):
                raise MeshError(f"{label} declares {words[2]!r} {words[1]} elements", EXPORT_AGAIN)
            elements.append(Element(words[1], int(words[2]), ()))
        elif words[:1] == ["property"] and len(words) > 2 and elements:
            last = elements[-1]
            held = (*last.properties, _property(label, words))
            elements[-1] = Element(last.name, last.count, held)
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


def _property(label: str, words: list[str]) -> Property:
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
        return Property(words[4], _TYPES[kinds[1]], _TYPES[kinds[0]])
    if listed:
        raise MeshError(f"{label} has a list without a name", EXPORT_AGAIN)
    return Property(words[2], _TYPES[kinds[0]])


def _least_bytes(element: Element, order: str) -> int:
    if not order:
        return 2 * len(element.properties)  # a digit, and what parts it from the next
    return sum(int((held.length or held.kind)[1]) for held in element.properties)


def corner_list(label: str, element: Element) -> Property:
    for name in _CORNER_LISTS:
        for held in element.lists:
            if held.name == name:
                return held
    whole = [held for held in element.lists if held.kind[0] in "iu"]
    if len(whole) != 1:
        raise MeshError(f"{label} has faces without a list of their vertices", EXPORT_AGAIN)
    return whole[0]
