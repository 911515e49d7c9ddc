"""Files of several bodies, of bodies within bodies, and of bodies that hardly are any."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tests.geometry.corpus.case import Case
from tests.geometry.corpus.ply_dialects import Ply, ply
from tests.geometry.corpus.solids import Solid, box, in_triangles, prism, together
from tests.geometry.corpus.stl_dialects import stl

CUBE = box(0.1, 0.1, 0.1)
HOLLOW = box(0.05, 0.05, 0.05).moved((0.045, 0.025, 0.025))


def _inward(solid: Solid) -> Solid:
    return replace(solid, polygons=tuple(polygon[::-1] for polygon in solid.polygons))


def _pegs() -> Solid:
    """A plate with 400 pegs of eight sides sunk 2 mm into it."""
    radius, height, sunk = 0.0005, 0.05, 0.002
    turns = [2 * math.pi * k / 8 for k in range(8)]
    outline = [(radius * math.cos(turn), radius * math.sin(turn)) for turn in turns]
    peg, plate = prism(outline, height), box(0.1, 0.1, 0.01)
    base = 4 * radius**2 * math.sin(math.pi / 4)
    around = 16 * radius * math.sin(math.pi / 8)
    places = [
        (0.005 + 0.0047 * row, 0.005 + 0.0047 * column, 0.01 - sunk)
        for row in range(20)
        for column in range(20)
    ]
    return together(
        [plate, *(peg.moved(place) for place in places)],
        plate.volume_m3 + 400 * base * (height - sunk),
        plate.area_m2 + 400 * around * (height - sunk),
    )


def cases() -> Iterator[Case]:
    """Cavities, parts of one body, marks and specks beside it, and what is too thin."""
    left = CUBE.volume_m3 - HOLLOW.volume_m3
    for name, inner, what in (
        ("inward", _inward(HOLLOW), "a cavity off the middle"),
        ("outward", HOLLOW, "a cavity whose shell faces outward"),
    ):
        solid = together([CUBE, inner], left, CUBE.area_m2, HOLLOW.volume_m3)
        yield Case(f"cavity_{name}.ply", ply(solid), what, solid, bodies=2, recorded="cavit")
    solid = in_triangles(together([CUBE, _inward(HOLLOW)], left, CUBE.area_m2, HOLLOW.volume_m3))
    yield Case(
        "cavity.stl", stl(solid), "a cavity in an STL", solid, bodies=2, recorded="cavit",
        tolerance=1e-5,
    )  # fmt: skip
    yield Case(
        "pegs.ply", ply(_pegs(), Ply(real="double")), "a plate with 400 pegs, each 0.02 % of it",
        _pegs(), bodies=401, recorded="united 401 parts",
    )  # fmt: skip
    square = [(0.101, 0.02, 0.02), (0.101, 0.08, 0.02), (0.101, 0.08, 0.08), (0.101, 0.02, 0.08)]
    mark = Solid(np.array(square), ((0, 1, 2, 3),), 0.0, 0.0)
    yield Case(
        "label.ply", ply(together([CUBE, mark], CUBE.volume_m3, CUBE.area_m2)),
        "a label's open sheet beside a closed body", CUBE, recorded="left off 1 loose sheet",
    )  # fmt: skip
    specks = [box(0.001, 0.001, 0.001).moved((0.2 + 0.01 * k, 0, 0)) for k in range(5)]
    yield Case(
        "specks.ply", ply(together([CUBE, *specks], CUBE.volume_m3, CUBE.area_m2)),
        "five specks beside a body, together nothing", CUBE, bodies=6, recorded="dropped 5 specks",
    )  # fmt: skip
    for thickness in (1e-4, 1e-5, 1e-6):
        yield Case(
            f"bad_sheet_{thickness:g}.ply", ply(box(0.1, 0.07, thickness)),
            f"a sheet of {1e3 * thickness:g} mm", refused=rf"too thin: {1e3 * thickness:.1g} mm",
        )  # fmt: skip
    needle = box(0.1, 1e-5, 1e-5)
    yield Case("bad_needle.ply", ply(needle), "a needle of 0.01 mm", refused="too thin: 0.005 mm")
    debris = [box(0.004, 0.004, 0.004).moved((0.2 + 0.01 * k, 0, 0)) for k in range(50)]
    yield Case(
        "bad_debris.ply", ply(together([CUBE, *debris], CUBE.volume_m3, CUBE.area_m2)),
        "fifty pieces beside a body", refused="51 bodies that do not touch", bodies=51,
    )  # fmt: skip
