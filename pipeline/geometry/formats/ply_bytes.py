"""The rows of a binary PLY file, of either order of bytes."""

import sys
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from pipeline.errors import MeshError
from pipeline.geometry.formats.ply_header import Element, Lists, Property, corner_list
from pipeline.geometry.formats.surface import EXPORT_AGAIN, check_long_enough


def rows_of_bytes(
    label: str, data: bytes, order: str, elements: Sequence[Element], at: int
) -> tuple[Float[np.ndarray, "n 3"], Lists | None, Lists | None]:
    points = np.zeros((0, 3))
    found: dict[str, Lists] = {}
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
            chosen = corner_list(label, element)
            found[element.name], at = _lists(label, data, order, element, chosen, at)
        elif element.name == "vertex":
            raise MeshError(f"{label} has vertices with lists", "Export the mesh again")
        else:
            _, at = _lists(label, data, order, element, None, at)
        if len(found) + (len(points) > 0) == _wanted(elements):
            break
    return points, found.get("face"), found.get("tristrips")


def _wanted(elements: Sequence[Element]) -> int:
    names = ("vertex", "face", "tristrips")
    return sum(element.name in names and element.count > 0 for element in elements)


def _field(element: Element, name: str) -> str:
    return f"{[held.name for held in element.properties].index(name)}"


def _record(
    properties: Sequence[Property], order: str, lengths: dict[int, int]
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
    label: str, data: bytes, order: str, element: Element, chosen: Property | None, at: int
) -> tuple[Lists, int]:
    """One list of each row, and where the rows end."""
    equal = _equal_lists(label, data, order, element, chosen, at)
    return equal if equal is not None else _any_lists(label, data, order, element, chosen, at)


def _equal_lists(
    label: str, data: bytes, order: str, element: Element, chosen: Property | None, at: int
) -> tuple[Lists, int] | None:
    """As above where all rows are as the first: one look at memory. None where they are not."""
    nothing = np.zeros(0, dtype=np.int64)
    if element.count == 0 or not element.properties:
        return Lists(nothing, nothing), at
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
        return Lists(nothing, nothing), end
    k = element.properties.index(chosen)
    values = _whole(label, rows[f"{k}"].reshape(-1))
    return Lists(values, np.full(element.count, lengths[k], dtype=np.int64)), end


def _any_lists(
    label: str, data: bytes, order: str, element: Element, chosen: Property | None, at: int
) -> tuple[Lists, int]:
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
        return Lists(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)), at
    lengths = np.array(counts, dtype=np.int64)
    item = int(chosen.kind[1])
    within = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    byte = np.repeat(np.array(starts, dtype=np.int64), lengths) + within * item
    held = np.frombuffer(data, dtype=np.uint8)[byte[:, None] + np.arange(item)]
    return Lists(_whole(label, held.reshape(-1).view(order + chosen.kind)), lengths), at


def _whole(label: str, values: np.ndarray) -> Int[np.ndarray, " k"]:
    whole = values.astype(np.int64)
    if values.dtype.kind == "f" and not (whole == values).all():
        raise MeshError(f"{label} has vertex numbers that are not whole", EXPORT_AGAIN)
    return np.asarray(whole)
