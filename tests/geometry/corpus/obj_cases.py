"""OBJ as tools write it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tests.geometry.corpus.case import Case
from tests.geometry.corpus.obj_dialects import Obj, obj
from tests.geometry.corpus.solids import BOX, NOTCHED, TRIANGLES, Solid, box

_DIALECTS = {
    "plain": (Obj(), "as most tools write it"),
    "tabs": (Obj(gap="\t"), "tabs between words"),
    "spaces": (Obj(gap="   ", note="  \t"), "several blanks, and blanks at line ends"),
    "indented": (Obj(indent="\t "), "indented lines"),
    "crlf": (Obj(newline="\r\n"), "line ends of Windows"),
    "cr": (Obj(newline="\r"), "line ends of old Macintoshes"),
    "mark": (Obj(mark=b"\xef\xbb\xbf"), "byte-order mark"),
    "comments": (Obj(note=" # f 1 2 3"), "comments behind data"),
    "glued_comments": (Obj(note="#side"), "comments glued to data"),
    "continued": (Obj(continued=True), "lines continued by a backslash"),
    "continued_crlf": (Obj(continued=True, newline="\r\n"), "continued lines that end in CR LF"),
    "counts_back": (Obj(counted="back"), "indices that count back"),
    "counts_both": (Obj(counted="both"), "indices of both kinds"),
    "interleaved": (Obj(interleaved=True), "each face behind its own vertices"),
    "faces_first": (Obj(faces_first=True), "faces before all vertices"),
    "normals": (Obj(corner="{0}//{1}"), "corners v//vn"),
    "textures": (Obj(corner="{0}/{1}"), "corners v/vt"),
    "both": (Obj(corner="{0}/{1}/{1}"), "corners v/vt/vn"),
    "open_slash": (Obj(corner="{0}/"), "corners that end in a slash"),
    "back_normals": (Obj(counted="back", corner="{0}//{0}"), "v//vn that count back"),
    "colours": (Obj(colours=True), "colours behind positions"),
    "weight": (Obj(weight="1.0"), "weights behind positions"),
    "weight_colours": (Obj(weight="1.0", colours=True), "weights and colours"),
    "groups": (Obj(groups=True), "objects, groups and materials between faces"),
    "elements": (Obj(elements=True), "points and lines among the faces"),
    "exponents": (Obj(number="{:.17E}"), "numbers with exponents"),
    "signs": (Obj(number="{:+.17f}"), "numbers with plus signs"),
    "unended": (Obj(final_newline=False), "no line end at the end"),
}


def cases() -> Iterator[Case]:
    """Every way of writing OBJ, and what OBJ files get wrong."""
    for name, (how, what) in _DIALECTS.items():
        solid = TRIANGLES if how.interleaved or how.elements else BOX
        yield Case(f"obj_{name}.obj", obj(solid, how), what, solid)
    yield from _mixed()
    yield from _refused()


def _mixed() -> Iterator[Case]:
    lines = []
    for x in (0.0, 0.025):
        cube = box(0.05, 0.05, 0.05).moved((x, 0, 0))
        lines += ["v " + " ".join(f"{c:.9g}" for c in at) for at in cube.corners_m]
        lines += ["f " + " ".join(str(i - 8) for i in p) for p in cube.polygons]
    union = box(0.075, 0.05, 0.05)
    yield Case(
        "obj_two_counted_back.obj",
        "\n".join(lines).encode(),
        "two overlapping boxes, each counted back from where it stands",
        union,
        bodies=2,
    )
    half = obj(BOX).decode().splitlines()
    faces = [k for k, line in enumerate(half) if line.startswith("f ")]
    for k in faces[:3]:
        half[k] = "f " + " ".join(f"{i}/1/1" for i in half[k].split()[1:])
    half[faces[3]] = "f " + " ".join(f"{i}//1" for i in half[faces[3]].split()[1:])
    yield Case(
        "obj_half.obj",
        "\n".join(half).encode(),
        "half with normals, half without, in one file",
        BOX,
    )
    half = obj(BOX).decode().splitlines()
    for k in [k for k, line in enumerate(half) if line.startswith("v ")][4:]:
        half[k] += " 0.5 0.5 0.5"
    yield Case("obj_half_coloured.obj", "\n".join(half).encode(), "half of it has colours", BOX)
    wide = "\n".join(f"v 9{k} 1e9 {k}" for k in range(3)).encode() + b"\n"
    yield Case("obj_stray_vertices.obj", obj(BOX) + wide, "vertices far off that no face uses", BOX)
    nan = b"v nan nan nan\n"
    yield Case("obj_stray_nan.obj", obj(BOX) + nan, "a vertex of NaN that no face uses", BOX)
    edges = b"f 1 2\nf 3\n"
    yield Case("obj_edges.obj", obj(BOX) + edges, "faces of one and two corners", BOX)
    repeated = obj(BOX).replace(b"f 4 3 2 1", b"f 4 4 3 2 1 1")
    yield Case("obj_repeated_corners.obj", repeated, "a corner written twice", BOX)
    doubled = obj(BOX) + b"f 4 3 2 1\n"
    yield Case("obj_repeated_face.obj", doubled, "a face written twice", BOX, recorded="coincident")
    fortran = obj(BOX, Obj(number="{:.17E}")).replace(b"E-", b"D-").replace(b"E+", b"d+")
    yield Case("obj_fortran.obj", fortran, "exponents as Fortran writes them", BOX)
    outline = obj(BOX).replace(b"\nf ", b"\nfo ")
    yield Case("obj_outline.obj", outline, "faces by their old name, fo", BOX)
    yield Case("OBJ_UPPER.OBJ", obj(BOX), "suffix in upper case", BOX)
    latin = "# Gehäuse für Prüfung\no Gehäuse\n".encode("latin-1") + obj(BOX)
    yield Case("obj_latin.obj", latin, "names in an old code page", BOX)
    far = BOX.moved((512_000.0, 5_400_000.0, 120.0))
    yield Case("obj_far.obj", obj(far), "coordinates of a land survey", BOX, tolerance=1e-5)
    turned = Solid(NOTCHED.corners_m, tuple(p[::-1] for p in NOTCHED.polygons), *_true(NOTCHED))
    yield Case(
        "obj_inside_out.obj", obj(turned), "all faces inwards", NOTCHED, recorded="inside out"
    )


def _true(solid: Solid) -> tuple[float, float]:
    return solid.volume_m3, solid.area_m2


def _refused() -> Iterator[Case]:
    whole = obj(BOX)
    yield Case(
        "bad_cut.obj", whole.rstrip()[:-4], "cut within the last face", refused="is truncated"
    )
    commas = obj(BOX, Obj(gap=", ")).replace(b"v, ", b"v ").replace(b"f, ", b"f ")
    yield Case("bad_commas.obj", commas, "commas between numbers", refused="comma")
    comma = obj(BOX, Obj(number="{:.6f}")).replace(b"0.1", b"0,1")
    yield Case("bad_comma.obj", comma, "commas as decimal marks", refused="comma")
    yield Case(
        "bad_points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "vertices alone", refused="no faces"
    )
    yield Case(
        "bad_lines.obj",
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2 3 1\n",
        "a drawing of lines",
        refused="only lines",
    )
    yield Case(
        "bad_zero.obj",
        whole.replace(b"f 4 3 2 1", b"f 3 2 1 0"),
        "indices from zero",
        refused="vertex 0",
    )
    yield Case(
        "bad_index.obj",
        whole.replace(b"f 4 3 2 1", b"f 4 3 2 99"),
        "an index beyond the last vertex",
        refused="vertex 99, and it has 8",
    )
    yield Case(
        "bad_back.obj",
        whole.replace(b"f 4 3 2 1", b"f -99 3 2 1"),
        "an index back beyond the first vertex",
        refused="vertex -99",
    )
    yield Case(
        "bad_short.obj",
        whole.replace(b"v 0 0 0\n", b"v 0 0\n"),
        "a vertex of two numbers",
        refused="line 3",
    )
    yield Case(
        "bad_word.obj",
        whole.replace(b"v 0 0 0\n", b"v 0 zero 0\n"),
        "a word in place of a number",
        refused="'zero' is no number",
    )
    yield Case(
        "bad_nan.obj",
        whole.replace(b"v 0 0 0\n", b"v 0 nan 0\n"),
        "a vertex of NaN",
        refused="NaN",
    )
    yield Case(
        "bad_indefinite.obj",
        whole.replace(b"v 0 0 0\n", b"v 0 -1.#IND 0\n"),
        "NaN as Windows prints it",
        refused="NaN",
    )
    noise = np.random.default_rng(0).integers(0, 256, 400, dtype=np.uint8).tobytes()
    yield Case(
        "bad_half_binary.obj",
        whole[:200] + noise + b"\0\0",
        "text that turns into bytes",
        refused="not text",
    )
    yield Case("bad_utf16.obj", whole.decode().encode("utf-16"), "UTF-16 text", refused="UTF-16")
    surface = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\ncstype bspline\nsurf 0 1 0 1 1 2 3 4\nend\n"
    yield Case("bad_nurbs.obj", surface, "free-form surfaces", refused="free-form")
    yield Case("bad_zip.obj", b"PK\x03\x04" + whole, "a ZIP archive", refused="ZIP")
    yield Case("bad_gzip.obj", b"\x1f\x8b\x08\0" + whole, "packed by gzip", refused="gzip")
    page = b"\n<!DOCTYPE html><html><body>404</body></html>"
    yield Case("bad_page.obj", page, "a web page", refused="web page")
    xml = b"<?xml version='1.0'?><COLLADA/>"
    yield Case("bad_collada.obj", xml, "another format under this name", refused="XML")
    pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n"
    yield Case("bad_pointer.obj", pointer, "a pointer of Git LFS", refused="git lfs pull")
    yield Case("bad_empty.obj", b" \n", "nothing", refused="is empty")
    parts = [replace(Obj(), counted="on")]
    apart = obj(BOX, parts[0]) + b"\n".join(
        [b"v " + b" ".join(b"%.9g" % c for c in at) for at in BOX.corners_m + 1.0]
    )
    apart += b"\n" + b"\n".join(b"f " + b" ".join(b"%d" % (i + 9) for i in p) for p in BOX.polygons)
    yield Case("bad_two_apart.obj", apart, "two boxes a metre apart", refused="bodies", bodies=2)
