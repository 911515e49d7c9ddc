"""STL as tools write it."""

import struct
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tests.geometry.corpus.case import Case
from tests.geometry.corpus.solids import BOX, TRIANGLES, box, corners_of_triangles, in_triangles
from tests.geometry.corpus.stl_dialects import Stl, stl, stl_binary, stl_text

_CORNERS = corners_of_triangles(TRIANGLES)
_DIALECTS = {
    "plain": (Stl(), "binary"),
    "solid": (Stl(header=b"solid made by a tool"), "binary with a header that begins with solid"),
    "solid_facet": (Stl(header=b"solid facet normal"), "binary, its header reads like text"),
    "solid_newline": (Stl(header=b"solid\n facet\n"), "binary, its header has lines"),
    "surplus": (Stl(tail=bytes(4)), "four bytes behind the last triangle"),
    "solid_surplus": (Stl(header=b"solid part", tail=bytes(7)), "both of these"),
    "padded": (Stl(tail=bytes(512)), "padded with zeros"),
    "newline": (Stl(tail=b"\r\n"), "a line end behind the last triangle"),
    "colours": (Stl(colour_bits=True), "colours in the spare bits"),
    "colour_header": (Stl(header=b"COLOR=\xff\xff\xff\xff,MATERIAL="), "a colour in the header"),
    "no_normals": (Stl(normals=False), "normals left at zero"),
    "count_zero": (Stl(count_off_by=-12), "a count of zero that was never filled in"),
    "count_large": (Stl(count_off_by=5), "a count too large, the surface closed"),
    "count_small": (Stl(count_off_by=-3), "a count too small, the surface closed"),
    "count_minus": (Stl(count_off_by=-13), "a count of minus one"),
    "text": (Stl(text=True), "text"),
    "text_upper": (Stl(text=True, upper=True), "text in upper case"),
    "text_crlf": (Stl(text=True, newline="\r\n"), "text with line ends of Windows"),
    "text_cr": (Stl(text=True, newline="\r"), "text with line ends of old Macintoshes"),
    "text_tabs": (Stl(text=True, gap="\t"), "text with tabs"),
    "text_line": (Stl(text=True, newline=" "), "text on one line"),
    "text_no_name": (Stl(text=True, solid="", end="endsolid"), "text without a name"),
    "text_end_solid": (Stl(text=True, end="end solid box"), "text that ends in end solid"),
    "text_no_end": (Stl(text=True, end=""), "text without an end, the surface closed"),
    "text_name": (Stl(text=True, solid="vertex 1 2 3 facet"), "a name that reads like data"),
    "text_path": (Stl(text=True, solid="C:\\Teile\\Gehäuse 1.stl"), "a name beyond ASCII"),
    "text_tail": (
        Stl(text=True, tail=b"\n\n\x1a"),
        "text behind which an old system's end mark is",
    ),
}


def cases() -> Iterator[Case]:
    """Every way of writing STL, and what STL files get wrong."""
    for name, (how, what) in _DIALECTS.items():
        held = "count" if name.startswith("count") else ""
        yield Case(f"stl_{name}.stl", stl(TRIANGLES, how), what, BOX, recorded=held)
    yield from _corners()
    yield from _several()
    yield from _lines()
    yield from _refused()


def _corners() -> Iterator[Case]:
    """Corners that should be one and are not quite."""
    for name, solid, tolerance in (
        ("near", TRIANGLES.moved((0.0123, 0.0456, 0.0789)), 1e-6),
        ("far", TRIANGLES.moved((3.3, -2.7, 1.9)), 1e-4),
        ("very_far", TRIANGLES.moved((700.3, -20.7, 100.9)), 1e-2),
    ):
        exact = corners_of_triangles(solid).astype(np.float32)
        turn = np.random.default_rng(5).integers(-1, 2, exact.shape)
        last_bit = np.nextafter(exact, np.where(turn > 0, np.inf, -np.inf).astype(np.float32))
        data = stl_binary(np.where(turn == 0, exact, last_bit))
        yield Case(
            f"stl_last_bit_{name}.stl", data, f"corners that differ in the last bit, {name}", BOX,
            tolerance=tolerance,
        )  # fmt: skip
    grain = 1e-9 * np.random.default_rng(6).uniform(-1, 1, _CORNERS.shape)
    yield Case(
        "stl_text_last_digits.stl", stl_text(_CORNERS + grain), "text corners that differ by 1e-9",
        BOX,
    )  # fmt: skip
    flat = np.concatenate([_CORNERS, _CORNERS[:2, [0, 1, 1]], _CORNERS[:1, [0, 0, 0]]])
    yield Case("stl_degenerate.stl", stl_binary(flat), "triangles without area", BOX)
    record = stl(TRIANGLES, Stl(normals=False))
    record = record[:84] + struct.pack("<3f", *[np.nan] * 3) + record[96:]
    yield Case("stl_nan_normal.stl", record, "normals of NaN", BOX)
    inward = stl_binary(_CORNERS, Stl(normals=False))
    yield Case("stl_millimetres.stl", stl_binary(_CORNERS * 1000), "in millimetres", BOX)
    yield Case("STL_UPPER.STL", inward, "suffix in upper case", BOX)


def _several() -> Iterator[Case]:
    left, right = in_triangles(box(0.05, 0.05, 0.05)), in_triangles(box(0.05, 0.05, 0.05))
    right = right.moved((0.025, 0, 0))
    union = box(0.075, 0.05, 0.05)
    text = Stl(text=True)
    both = stl(left, text) + stl(right, replace(text, solid="second", end="endsolid second"))
    yield Case("stl_text_two.stl", both, "two solids in one text file", union, bodies=2)
    both = stl(left) + stl(right)
    yield Case("stl_two.stl", both, "two binary files joined to one", union, bodies=2)


def _lines() -> Iterator[Case]:
    """Text broken into lines in other ways, and facets of four corners."""
    text = stl(TRIANGLES, Stl(text=True)).decode()
    joined = text.replace("\n  outer", " outer").replace("\n    vertex", " vertex")
    joined = joined.replace("\n  endloop\n", " endloop ")
    yield Case("stl_text_facets.stl", joined.encode(), "a facet a line", BOX)
    coloured = text.replace("facet normal", "color 1 0 0\nfacet normal")
    yield Case("stl_text_colours.stl", coloured.encode(), "lines with colours", BOX)
    lines = ["solid four"]
    for polygon in BOX.polygons:
        corners = [" ".join(f"{c:.17g}" for c in BOX.corners_m[i]) for i in polygon]
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {at}" for at in corners)]
        lines += ["endloop", "endfacet"]
    four = "\n".join([*lines, "endsolid four"])
    yield Case("stl_text_four.stl", four.encode(), "facets of four corners", BOX)


def _refused() -> Iterator[Case]:
    whole, text = stl(TRIANGLES), stl(TRIANGLES, Stl(text=True))
    yield Case("bad_cut.stl", whole[:-30], "cut within a triangle", refused="is truncated")
    yield Case("bad_cut_even.stl", whole[:-100], "cut between triangles", refused="is truncated")
    yield Case("bad_cut_text.stl", text[: len(text) * 2 // 3], "text cut", refused="is truncated")
    yield Case("bad_header.stl", whole[:40], "cut within the header", refused="too short")
    yield Case(
        "bad_none.stl", stl(replace(TRIANGLES, polygons=TRIANGLES.polygons[:1]))[:80] + bytes(4),
        "no triangle", refused="no triangles",
    )  # fmt: skip
    yield Case(
        "bad_none_text.stl", b"solid empty\nendsolid empty\n", "text without a facet",
        refused="no triangles",
    )  # fmt: skip
    noise = np.random.default_rng(1).integers(0, 256, 900, dtype=np.uint8).tobytes()
    yield Case("bad_noise.stl", noise, "bytes of something else", refused="neither a binary nor")
    nan = _CORNERS.copy()
    nan[3, 1, 2] = np.nan
    yield Case("bad_nan.stl", stl_binary(nan), "a corner of NaN", refused="NaN")
    yield Case(
        "bad_nan_text.stl", text.replace(b"vertex 0 0 0", b"vertex 0 nan 0"), "the same in text",
        refused="NaN",
    )  # fmt: skip
    yield Case(
        "bad_comma.stl", text.replace(b"0.0", b"0,0"), "commas as decimal marks", refused="comma"
    )
    yield Case(
        "bad_half_binary.stl", text[:400] + whole[84:], "text that turns into bytes",
        refused="not text",
    )  # fmt: skip
    open_count = stl_binary(_CORNERS[:-2], Stl(count_off_by=-4))
    yield Case(
        "bad_count_open.stl", open_count, "a count too small, closed neither way",
        refused="declares 6 triangles and holds 10",
    )  # fmt: skip
    yield Case(
        "bad_vertex.stl", text.replace(b"endloop", b"vertex 0 0 0\n endloop", 1).replace(
            b"    vertex 0", b"    vertx 0", 2
        ), "a facet of two corners and a misspelt word", refused="line",
    )  # fmt: skip
    utf16 = text.decode().encode("utf-16")
    yield Case("bad_utf16.stl", utf16, "UTF-16 text", refused="UTF-16")
