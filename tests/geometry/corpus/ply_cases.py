"""PLY as tools write it."""

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tests.geometry.corpus.case import Case
from tests.geometry.corpus.ply_dialects import Ply, ply
from tests.geometry.corpus.solids import BOX, NOTCHED, TRIANGLES

_TEXT = Ply(form="ascii")
_BIG = Ply(form="binary_big_endian")
_DIALECTS = {
    "little": (Ply(), "little-endian"),
    "big": (_BIG, "big-endian"),
    "text": (_TEXT, "text"),
    "vertex_index": (Ply(name="vertex_index"), "the list is called vertex_index"),
    "crlf": (Ply(newline="\r\n"), "a header of Windows lines before binary data"),
    "cr": (Ply(newline="\r"), "a header of old Macintosh lines before binary data"),
    "text_crlf": (replace(_TEXT, newline="\r\n"), "text with line ends of Windows"),
    "text_cr": (replace(_TEXT, newline="\r"), "text with line ends of old Macintoshes"),
    "remarks": (Ply(remarks=True), "comments and obj_info in the header"),
    "properties": (Ply(normals=True, face_more=True), "further properties"),
    "text_properties": (replace(_TEXT, normals=True, face_more=True), "further properties in text"),
    "lists": (Ply(lists_more=True), "a list before the one that counts"),
    "text_lists": (replace(_TEXT, lists_more=True, face_more=True), "the same in text"),
    "elements": (Ply(elements_more=True), "further elements"),
    "text_elements": (replace(_TEXT, elements_more=True), "further elements in text"),
    "faces_first": (Ply(faces_first=True), "faces before vertices"),
    "big_all": (
        replace(_BIG, elements_more=True, lists_more=True, normals=True),
        "big-endian with further elements, lists and properties",
    ),
}


def cases() -> Iterator[Case]:
    """Every way of writing PLY, and what PLY files get wrong."""
    for name, (how, what) in _DIALECTS.items():
        yield Case(f"ply_{name}.ply", ply(NOTCHED, how), what, NOTCHED)
    kinds = ("char", "uchar", "short", "ushort", "int", "uint", "int8", "uint16", "int32")
    for length, index in itertools.product(kinds, kinds):
        if length != index and "uchar" not in (length, index):
            continue
        how = Ply(length=length, index=index)
        what = f"lists of {length} and {index}"
        yield Case(f"ply_{length}_{index}.ply", ply(BOX, how), what, BOX)
    for real in ("float32", "float64", "float"):
        yield Case(f"ply_{real}.ply", ply(TRIANGLES, Ply(real=real)), f"coordinates of {real}", BOX)
    whole = replace(TRIANGLES, corners_m=TRIANGLES.corners_m * 1000)
    for real in ("short", "int"):
        yield Case(
            f"ply_{real}.ply", ply(whole, Ply(real=real)), f"coordinates of {real}, millimetres",
            BOX,
        )  # fmt: skip
    strip = replace(
        TRIANGLES, polygons=((0, 1, 3, 2, 7, 6, 4, 5, 0, 1), (1, 5, 2, 6), (0, 3, 4, 7))
    )
    strip = replace(strip, polygons=((3, 2, 0, 1, 4, 5, 7, 6, 3, 2), (1, 2, 5, 6), (0, 4, 3, 7)))
    for form in ("ascii", "binary_little_endian", "binary_big_endian"):
        yield Case(
            f"ply_strips_{form}.ply", ply(strip, Ply(form=form, strips=True)), "triangle strips",
            BOX,
        )  # fmt: skip
    head, mark, body = ply(NOTCHED, _TEXT).partition(b"end_header\n")
    stream = head + mark + b" ".join(body.split()) + b"\n"
    yield Case("ply_text_stream.ply", stream, "text, all rows on one line", NOTCHED)
    colours = head + mark + body.replace(b"\n", b" 255 0 0\n")
    yield Case("ply_text_colours.ply", colours, "colours that the header leaves out", NOTCHED)
    yield from _refused()


def _refused() -> Iterator[Case]:
    data, text = ply(BOX), ply(BOX, _TEXT)
    yield Case("bad_cut.ply", data[:-9], "cut in the last face", refused="is truncated")
    yield Case("bad_cut_text.ply", text[:-9], "text cut in the last face", refused="is truncated")
    rows = text.splitlines(keepends=True)
    cut = b"".join(rows[:-2])
    yield Case("bad_cut_rows.ply", cut, "text, two rows missing", refused="is truncated")
    cloud = replace(BOX, polygons=())
    yield Case("bad_cloud.ply", ply(cloud), "a point cloud", refused="8 points and no faces")
    alone = ply(cloud).replace(b"element face 0\nproperty list uchar int vertex_indices\n", b"")
    yield Case("bad_cloud_alone.ply", alone, "the same without faces", refused="8 points and no")
    grid = ply(cloud).replace(b"element face 0", b"element range_grid 0")
    yield Case("bad_range.ply", grid, "a range image", refused="no faces")
    header = data[: data.index(b"end_header") + 11]
    yield Case(
        "bad_text_as_binary.ply", header + text[text.index(b"end_header") + 11 :],
        "text under a binary header", refused="text",
    )  # fmt: skip
    swapped = header.replace(b"binary_little_endian", b"ascii") + data[len(header) :]
    yield Case("bad_binary_as_text.ply", swapped, "bytes under a text header", refused="not text")
    yield Case(
        "bad_form.ply", data.replace(b"binary_little_endian", b"binary_middle_endian"),
        "an order of bytes that is none", refused="binary_middle_endian",
    )  # fmt: skip
    yield Case(
        "bad_type.ply", data.replace(b"property double x", b"property real x"), "an unknown type",
        refused="'real'",
    )  # fmt: skip
    yield Case("bad_no_z.ply", text.replace(b"property double z\n", b""), "no z", refused="no z")
    yield Case("bad_header.ply", b"plyformat" + data[3:], "no header", refused="no PLY header")
    yield Case(
        "bad_index.ply", text.replace(b"4 3 2 1 0", b"4 3 2 1 8"), "an index too large",
        refused="vertex 8, and it has vertices 0 to 7",
    )  # fmt: skip
    yield Case("bad_comma.ply", text.replace(b"0.0", b"0,0"), "commas", refused="comma")
    nan = replace(BOX, corners_m=np.where(BOX.corners_m == 0.07, np.nan, BOX.corners_m))
    yield Case("bad_nan.ply", ply(nan), "corners of NaN", refused="NaN")
