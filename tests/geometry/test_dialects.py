"""A random solid, written in any format in any of its ways, is read as the solid it is."""

import math
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pipeline.config import ObjectsConfig
from pipeline.geometry.catalogue import measure_object
from pipeline.geometry.mesh_files import load_mesh_file
from pipeline.geometry.shape import surface_area, volume
from tests.geometry.corpus.gltf_dialects import Gltf, gltf
from tests.geometry.corpus.obj_dialects import Obj, obj
from tests.geometry.corpus.off_dialects import Off, off
from tests.geometry.corpus.ply_dialects import Ply, ply
from tests.geometry.corpus.solids import Solid, corners_of_triangles, prism
from tests.geometry.corpus.stl_dialects import Stl, stl

CONFIG = ObjectsConfig(rescaled=False)
TOLERANCE = 1e-6
QUANTISED = 2e-4  # positions of two bytes
# Exact as floats of 32 bits up to 16 m: what such a file holds is then what was meant.
GRAIN_M = 2.0**-20


@st.composite
def prisms(draw: st.DrawFn) -> tuple[Solid, Solid]:
    """Over a star-shaped outline, concave as a rule, turned and moved.

    Once in polygons, and once in triangles about the centres of its caps: the corners of that one
    lie on the grain, and its volume and area are summed from them.
    """
    count = draw(st.integers(3, 9))
    radii = draw(st.lists(st.floats(0.02, 0.06), min_size=count, max_size=count))
    angles = [2 * math.pi * k / count for k in range(count)]
    outline = [(r * math.cos(a), r * math.sin(a)) for r, a in zip(radii, angles, strict=True)]
    whole = prism(outline, draw(st.floats(0.03, 0.08)))
    centres = [(0.0, 0.0, 0.0), (0.0, 0.0, float(whole.corners_m[-1, 2]))]
    triangles = []
    for i in range(count):
        j = (i + 1) % count
        triangles += [(2 * count, j, i), (2 * count + 1, count + i, count + j)]
        triangles += [(i, j, count + j), (i, count + j, count + i)]
    fanned = replace(
        whole,
        corners_m=np.concatenate([whole.corners_m, centres]),
        polygons=tuple(triangles),
    )
    turn = Rotation.from_rotvec(draw(st.lists(st.floats(-3, 3), min_size=3, max_size=3)))
    moved = draw(st.lists(st.floats(-0.05, 0.05), min_size=3, max_size=3))
    whole, fanned = (held.turned(turn.as_matrix()).moved(moved) for held in (whole, fanned))
    corners = np.round(fanned.corners_m / GRAIN_M) * GRAIN_M
    return whole, measured(replace(fanned, corners_m=corners))


def measured(solid: Solid) -> Solid:
    """The solid of triangles with the sums of its tetrahedra and triangles."""
    corners = corners_of_triangles(solid) - solid.corners_m.mean(axis=0)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    six_volumes = np.einsum("ij,ij->i", a, np.cross(b, c))
    two_areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return replace(solid, volume_m3=six_volumes.sum() / 6, area_m2=two_areas.sum() / 2)


NEWLINES = st.sampled_from(["\n", "\r\n", "\r"])
NOTES = st.sampled_from(["", " ", " # f 1 2 3", "\t# v 0 0 0"])
FLAGS = st.booleans()
OBJ = st.builds(
    Obj,
    gap=st.sampled_from([" ", "\t", "  ", " \t "]),
    indent=st.sampled_from(["", " ", "\t"]),
    newline=NEWLINES,
    mark=st.sampled_from([b"", b"\xef\xbb\xbf"]),
    note=NOTES,
    counted=st.sampled_from(["on", "back", "both"]),
    corner=st.sampled_from(["{0}", "{0}/{1}", "{0}//{1}", "{0}/{1}/{1}"]),
    colours=FLAGS,
    weight=st.sampled_from(["", "1", "1.0"]),
    continued=FLAGS,
    interleaved=FLAGS,
    groups=FLAGS,
    elements=FLAGS,
    number=st.sampled_from(["{:.17g}", "{:.17E}", "{:+.20f}"]),
    final_newline=FLAGS,
)
STL = st.one_of(
    st.builds(
        Stl,
        header=st.sampled_from([b"", b"solid", b"solid facet", b"\0\1", b"COLOR=abcd"]),
        tail=st.sampled_from([b"", b"\0", bytes(4), b"\r\n", bytes(49)]),
        count_off_by=st.sampled_from([0, 0, 1, 7, -1]),
        colour_bits=FLAGS,
        normals=FLAGS,
    ),
    st.builds(
        Stl,
        text=st.just(True),
        upper=FLAGS,
        solid=st.sampled_from(["", "box", "vertex 1 2 3", "facet normal"]),
        end=st.sampled_from(["", "endsolid", "endsolid box", "end solid"]),
        newline=NEWLINES,
        gap=st.sampled_from([" ", "\t", "  "]),
        tail=st.sampled_from([b"", b"\n\n", b"\x1a"]),
    ),
)
OFF_HEADS = st.sampled_from(
    [
        ("OFF\n{0} {1} 0", ""), ("OFF {0} {1} 0", ""), ("OFF{0} {1} 0", ""), ("{0} {1} 0", ""),
        ("off\n{0} {1}", ""), ("COFF\n{0} {1} 0", " 1 2 3 255"), ("NOFF {0} {1} 0", " 0 0 1"),
        ("STOFF\n{0} {1} 0", " 0.5 0.5"), ("4OFF\n{0} {1} 0", " 1"), ("OFF\n{0} {1} 9", " 9 9 9"),
    ]
)  # fmt: skip
OFF = st.builds(
    lambda head, **more: Off(head=head[0], vertex_more=head[1], **more),
    head=OFF_HEADS,
    face_more=st.sampled_from(["", " 255 0 0", " 0.5 0.5 0.5 1", " 3"]),
    newline=NEWLINES,
    note=st.sampled_from(["", " # x", "\t"]),
    comments=FLAGS,
    blank_lines=FLAGS,
    mark=st.sampled_from([b"", b"\xef\xbb\xbf"]),
)
WHOLE = st.sampled_from(
    ["char", "uchar", "short", "ushort", "int", "uint", "int8", "uint8", "int16", "uint32"]
)
PLY = st.builds(
    Ply,
    form=st.sampled_from(["ascii", "binary_little_endian", "binary_big_endian"]),
    real=st.sampled_from(["double", "float64"]),
    length=WHOLE,
    index=WHOLE,
    name=st.sampled_from(["vertex_index", "vertex_indices"]),
    newline=NEWLINES,
    normals=FLAGS,
    face_more=FLAGS,
    lists_more=FLAGS,
    elements_more=FLAGS,
    faces_first=FLAGS,
    remarks=FLAGS,
)
GLTF = st.builds(
    Gltf,
    mode=st.sampled_from(["triangles", "strip", "fan"]),
    index=st.sampled_from(["u1", "u2", "u4"]),
    stride=st.sampled_from([0, 16, 20]),
    pose=st.sampled_from(["none", "matrix", "nested", "mirrored"]),
    extra_primitives=FLAGS,
    text=FLAGS,
)


def check(data: bytes, suffix: str, solid: Solid, tolerance: float = TOLERANCE) -> None:
    """The file's volume and area are the solid's."""
    with TemporaryDirectory() as scratch:
        path = Path(scratch) / f"solid{suffix}"
        path.write_bytes(data)
        mesh = measure_object(load_mesh_file(path, path.parent, "solid", CONFIG), CONFIG).mesh
    assert volume(mesh) == pytest.approx(solid.volume_m3, rel=tolerance)
    assert surface_area(mesh) == pytest.approx(solid.area_m2, rel=tolerance)


MANY = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@MANY
@given(prisms(), OBJ)
def test_any_solid_in_any_obj(solids: tuple[Solid, Solid], how: Obj) -> None:
    whole, fanned = solids
    solid = fanned if how.interleaved or how.elements else whole
    check(obj(solid, how), ".obj", solid)


@MANY
@given(prisms(), STL)
def test_any_solid_in_any_stl(solids: tuple[Solid, Solid], how: Stl) -> None:
    check(stl(solids[1], how), ".stl", solids[1])


@MANY
@given(prisms(), OFF, FLAGS)
def test_any_solid_in_any_off(solids: tuple[Solid, Solid], how: Off, fanned: bool) -> None:
    check(off(solids[fanned], how), ".off", solids[fanned])


@MANY
@given(prisms(), PLY, FLAGS, FLAGS)
def test_any_solid_in_any_ply(
    solids: tuple[Solid, Solid], how: Ply, fanned: bool, strips: bool
) -> None:
    solid = solids[fanned or strips]
    if strips:
        how = replace(how, strips=True, face_more=False, lists_more=False)
    check(ply(solid, how), ".ply", solid)


@MANY
@given(prisms(), PLY)
def test_any_solid_in_any_ply_of_floats(solids: tuple[Solid, Solid], how: Ply) -> None:
    check(ply(solids[1], replace(how, real="float")), ".ply", solids[1])


@MANY
@given(prisms(), GLTF)
def test_any_solid_in_any_gltf(solids: tuple[Solid, Solid], how: Gltf) -> None:
    check(gltf(solids[1], how), ".gltf" if how.text else ".glb", solids[1])


@MANY
@given(prisms(), GLTF)
def test_any_solid_in_any_gltf_of_two_bytes(solids: tuple[Solid, Solid], how: Gltf) -> None:
    coarse = replace(how, real="quantised", stride=8, pose="none")
    check(gltf(solids[1], coarse), ".gltf" if how.text else ".glb", solids[1], QUANTISED)
