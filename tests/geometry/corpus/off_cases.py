"""OFF as tools write it."""

from collections.abc import Iterator

from tests.geometry.corpus.case import Case
from tests.geometry.corpus.off_dialects import Off, off
from tests.geometry.corpus.solids import BOX, NOTCHED, TRIANGLES

_DIALECTS = {
    "plain": (Off(), "as most tools write it"),
    "same_line": (Off(head="OFF {0} {1} 0"), "counts on the line of the header"),
    "glued": (Off(head="OFF{0} {1} 0"), "counts glued to the header, as in ModelNet"),
    "no_edges": (Off(head="OFF\n{0} {1}"), "no count of edges"),
    "no_header": (Off(head="{0} {1} 12"), "counts alone: the header may be left out"),
    "lower": (Off(head="off\n{0} {1} 0"), "header in lower case"),
    "remark": (Off(head="# made by a tool\nOFF # and so on\n\n# counts\n{0} {1} 0"), "remarks"),
    "remarks": (Off(comments=True, blank_lines=True), "remarks and empty lines between rows"),
    "notes": (Off(note=" # row"), "remarks behind rows"),
    "crlf": (Off(newline="\r\n"), "line ends of Windows"),
    "cr": (Off(newline="\r"), "line ends of old Macintoshes"),
    "mark": (Off(mark=b"\xef\xbb\xbf"), "byte-order mark"),
    "coff": (Off(head="COFF\n{0} {1} 0", vertex_more=" 255 0 128 255"), "colours at vertices"),
    "coff_real": (Off(head="COFF\n{0} {1} 0", vertex_more=" 0.5 0 1 1"), "the same as shares"),
    "off_colours": (Off(vertex_more=" 255 0 128"), "colours at vertices under plain OFF"),
    "noff": (Off(head="NOFF\n{0} {1} 0", vertex_more=" 0 0 1"), "normals at vertices"),
    "cnoff": (Off(head="CNOFF\n{0} {1} 0", vertex_more=" 0 0 1 9 9 9 9"), "both"),
    "stoff": (Off(head="STOFF\n{0} {1} 0", vertex_more=" 0.5 0.5"), "texture coordinates"),
    "stcnoff": (Off(head="STCNOFF {0} {1} 0", vertex_more=" 0 0 1 1 0 0 1 .5 .5"), "all of them"),
    "4off": (Off(head="4OFF\n{0} {1} 0", vertex_more=" 1"), "homogeneous coordinates"),
    "noff_dim": (Off(head="nOFF\n3\n{0} {1} 0"), "the dimension on a line of its own"),
    "face_rgb": (Off(face_more=" 255 0 0"), "colours of faces"),
    "face_rgba": (Off(face_more=" 0.5 0.25 0.125 1.0"), "colours of faces as shares"),
    "face_map": (Off(face_more=" 4"), "faces with an index into a colour map"),
    "tail": (Off(note=" \t"), "blanks at line ends"),
}


def cases() -> Iterator[Case]:
    """Every way of writing OFF, and what OFF files get wrong."""
    for name, (how, what) in _DIALECTS.items():
        yield Case(f"off_{name}.off", off(BOX, how), what, BOX)
    yield Case("off_triangles.off", off(TRIANGLES), "triangles", BOX)
    mixed = off(NOTCHED).replace(b"OFF\n10 7 0", b"OFF\n10 9 0") + b"2 0 1\n1 3\n"
    yield Case("off_edges.off", mixed, "rows of one and two corners among the faces", NOTCHED)
    stream = b" ".join(off(TRIANGLES).split())
    yield Case("off_stream.off", stream, "all on one line", BOX)
    yield Case("off_more.off", off(BOX) + b"0 1\n1 2\n", "rows behind the last face", BOX)
    whole = off(BOX)
    rows = whole.splitlines(keepends=True)
    yield Case("bad_cut.off", b"".join(rows[:-2]), "two faces missing", refused="is truncated")
    yield Case(
        "bad_vertices.off", b"".join(rows[:6]), "cut among the vertices", refused="is truncated"
    )
    yield Case("bad_points.off", b"OFF\n2 0 0\n0 0 0\n1 0 0\n", "no faces", refused="no faces")
    yield Case("bad_binary.off", b"OFF BINARY\n" + bytes(64), "binary OFF", refused="binary OFF")
    yield Case("bad_comma.off", off(BOX).replace(b"0.0", b"0,0"), "commas", refused="comma")
    yield Case(
        "bad_index.off", whole.replace(b"4 3 2 1 0", b"4 3 2 1 8"), "an index too large",
        refused="vertex 8, and it has vertices 0 to 7",
    )  # fmt: skip
    yield Case(
        "bad_dimension.off", b"nOFF\n4\n" + b"\n".join(rows[1:]), "four dimensions",
        refused="4 dimensions",
    )  # fmt: skip
    yield Case("bad_header.off", b"OF\n" + b"".join(rows[1:]), "no header", refused="no OFF header")
    yield Case(
        "bad_half_binary.off", whole[:150] + bytes(range(256)), "text that turns into bytes",
        refused="not text",
    )  # fmt: skip
