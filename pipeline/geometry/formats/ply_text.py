"""The rows of a text PLY file."""

from collections.abc import Sequence
from itertools import chain

import numpy as np
from jaxtyping import Float

from pipeline.errors import MeshError
from pipeline.geometry.formats.ply_header import Element, Lists, Property, corner_list
from pipeline.geometry.formats.surface import EXPORT_AGAIN, cut_or_malformed
from pipeline.geometry.formats.text import integers, reals, text_of


def rows_of_text(
    label: str, data: bytes, order: str, elements: Sequence[Element], at: int
) -> tuple[Float[np.ndarray, "n 3"], Lists | None, Lists | None]:
    """One row a line, as the format has it; what a line has beyond its row is left aside."""
    text_of(label, data)  # names the line where it is none
    lines = [
        row for row in (line.split() for line in text_of(label, data[at:]).split(b"\n")) if row
    ]
    if len(lines) < sum(element.count for element in elements if element.properties):
        lines = _rows_of_stream(elements, lines, label)
    points = np.zeros((0, 3))
    found: dict[str, Lists] = {}
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


def _rows_of_stream(
    elements: Sequence[Element], lines: Sequence[list[bytes]], label: str
) -> list[list[bytes]]:
    """Rows of a text that does not keep to lines; fewer than declared where it ends."""
    words = list(chain.from_iterable(lines))
    rows, at = list[list[bytes]](), 0
    for element in elements:
        for _ in range(element.count if element.properties else 0):
            if at >= len(words):
                return rows
            start = at
            for held in element.properties:
                listed = held.length and at < len(words)
                length = int(integers(label, words[at : at + 1])[0]) if listed else 0
                at += 1 + max(length, 0)
            rows.append(words[start:at])
    return rows


def _points(label: str, element: Element, rows: Sequence[list[bytes]]) -> Float[np.ndarray, "n 3"]:
    if element.lists:
        raise MeshError(f"{label} has vertices with lists", "Export the mesh again")
    width = len(element.properties)
    _check_row_lengths(label, element, rows, width)
    names = [held.name for held in element.properties]
    x, y, z = (names.index(axis) for axis in "xyz")
    words = chain.from_iterable((row[x], row[y], row[z]) for row in rows)
    return reals(label, list(words)).reshape(-1, 3)


def _listed(label: str, element: Element, rows: Sequence[list[bytes]]) -> Lists:
    chosen = corner_list(label, element)
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
    return Lists(integers(label, list(words)), counts)


def _start(label: str, row: list[bytes], before: Sequence[Property]) -> int:
    """Which word of a row is its list's length, behind other lists."""
    at = 0
    for held in before:
        length = int(integers(label, row[at : at + 1])[0]) if held.length and at < len(row) else 0
        at += 1 + max(length, 0)
    if at >= len(row):
        raise MeshError(f"{label} has a face whose line is too short", EXPORT_AGAIN)
    return at


def _check_row_lengths(
    label: str, element: Element, rows: Sequence[list[bytes]], least: int
) -> None:
    for number, row in enumerate(rows):
        if len(row) < least:
            raise MeshError(
                f"{label} is {cut_or_malformed(number, len(rows))}: {element.name} {number + 1} "
                f"has {len(row)} numbers of {least}",
                EXPORT_AGAIN,
            )
