"""Polygons of more than three corners: concave, with holes, doubled, bent and crossed."""

import math
from collections.abc import Iterator

import numpy as np

from tests.geometry.corpus.case import Case
from tests.geometry.corpus.obj_dialects import obj
from tests.geometry.corpus.off_dialects import Off, off
from tests.geometry.corpus.ply_dialects import Ply, ply
from tests.geometry.corpus.solids import BOX, NOTCHED_OUTLINE, Outline, Solid, prism, shoelace


def star(points: int, inner: float, outer: float) -> Outline:
    """A star's outline."""
    return [
        (
            (inner if k % 2 else outer) * math.cos(k * math.pi / points),
            (inner if k % 2 else outer) * math.sin(k * math.pi / points),
        )
        for k in range(2 * points)
    ]


def comb(teeth: int) -> Outline:
    """A back with teeth: half of its corners are concave."""
    outline = [(0.0, 0.0), (0.1, 0.0)]
    width = 0.1 / (2 * teeth - 1)
    for k in reversed(range(teeth)):
        outline += [((2 * k + 1) * width, 0.06), (2 * k * width, 0.06)]
        if k:
            outline += [(2 * k * width, 0.02), ((2 * k - 1) * width, 0.02)]
    outline[2] = (0.1, 0.06)
    return outline


OUTLINES = {
    "arrow": [(0, 0), (0.1, 0.04), (0, 0.08), (0.03, 0.04)],
    "l": [(0, 0), (0.1, 0), (0.1, 0.03), (0.03, 0.03), (0.03, 0.1), (0, 0.1)],
    "star": star(5, 0.02, 0.06),
    "cog": star(24, 0.045, 0.05),
    "comb": comb(6),
    "spiral": [
        (0, 0), (0.1, 0), (0.1, 0.1), (0.02, 0.1), (0.02, 0.04), (0.06, 0.04), (0.06, 0.06),
        (0.04, 0.06), (0.04, 0.08), (0.08, 0.08), (0.08, 0.02), (0, 0.02),
    ],
    "in_line": [
        (0, 0), (0.02, 0), (0.05, 0), (0.1, 0), (0.1, 0.05), (0.1, 0.1), (0.05, 0.025),
        (0.025, 0.0625), (0, 0.1), (0, 0.05),
    ],
    "disc": [(0.05 * math.cos(k * math.pi / 50), 0.05 * math.sin(k * math.pi / 50))
             for k in range(100)],
}  # fmt: skip


def with_hole() -> Solid:
    """A plate with a square hole: each cap is one polygon that runs to the hole and back."""
    outer = [(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)]
    inner = [(0.03, 0.03), (0.03, 0.06), (0.06, 0.06), (0.06, 0.03)]
    height = 0.02
    corners = [(x, y, z) for z in (0.0, height) for x, y in outer + inner]
    ring = [0, 1, 2, 3, 0, 4, 5, 6, 7, 4]
    sides = [
        polygon
        for start in (0, 4)
        for i in range(4)
        for polygon in [(start + i, start + (i + 1) % 4, start + (i + 1) % 4 + 8, start + i + 8)]
    ]
    area = 0.01 - 0.0009
    return Solid(
        np.array(corners),
        (tuple(ring[::-1]), tuple(i + 8 for i in ring), *sides),
        area * height,
        2 * area + (0.4 + 0.12) * height,
    )


def tilted(solid: Solid) -> Solid:
    """Turned so that no polygon lies along an axis."""
    a, b = 0.7, -1.1
    about_z = np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, math.cos(b), -math.sin(b)], [0, math.sin(b), math.cos(b)]])
    return solid.turned(about_x @ about_z)


def cases() -> Iterator[Case]:
    """Each outline as a prism, at several first corners and in three formats."""
    for turn in range(5):
        outline: Outline = NOTCHED_OUTLINE[turn:] + NOTCHED_OUTLINE[:turn]
        solid = tilted(prism(outline, 0.05))
        what = f"a concave cap, first corner {turn}"
        yield Case(f"polygon_notched_{turn}.obj", obj(solid), what, solid)
        yield Case(f"polygon_notched_{turn}.off", off(solid), what, solid)
        yield Case(f"polygon_notched_{turn}.ply", ply(solid), what, solid)
    for name, outline in OUTLINES.items():
        assert shoelace(outline) > 0
        solid = tilted(prism(outline, 0.03))
        yield Case(f"polygon_{name}.obj", obj(solid), f"caps: {name}", solid)
    solid = with_hole()
    yield Case("polygon_hole.obj", obj(solid), "a hole reached by a doubled edge", solid)
    yield Case("polygon_hole.ply", ply(solid, Ply(form="ascii")), "the same in a text PLY", solid)
    doubled = Solid(
        solid.corners_m[[*range(8), 0, 4, *range(8, 16), 8, 12]],
        (
            (9, 7, 6, 5, 4, 8, 3, 2, 1, 0),
            (10, 11, 12, 13, 18, 14, 15, 16, 17, 19),
            *(tuple(i + 2 if i > 7 else i for i in side) for side in solid.polygons[2:]),
        ),
        solid.volume_m3,
        solid.area_m2,
    )
    yield Case(
        "polygon_hole_doubled.off", off(doubled, Off()), "the doubled edge has vertices of its own",
        doubled,
    )  # fmt: skip
    yield from _bent_and_crossed()


def _bent_and_crossed() -> Iterator[Case]:
    hexagon = prism(
        [(0.05 * math.cos(a), 0.05 * math.sin(a)) for a in np.arange(6) * np.pi / 3], 0.04
    )
    bent = hexagon.corners_m.copy()
    bent[6, 2] += 0.02
    yield Case(
        "bad_bent.obj", obj(Solid(bent, hexagon.polygons, 1, 1)),
        "a hexagon with a corner 20 mm above the others", refused=r"face 2 is not flat: .*9.9%",
    )  # fmt: skip
    rounded = Solid(np.round(tilted(hexagon).corners_m, 6), hexagon.polygons,
                    hexagon.volume_m3, hexagon.area_m2)  # fmt: skip
    yield Case(
        "polygon_rounded.obj", obj(rounded), "corners written to six decimals", hexagon,
        tolerance=1e-4,
    )  # fmt: skip
    twisted = BOX.corners_m.copy()
    twisted[6] += (0.0, 0.0, 0.001)
    # Whichever way the bent sides are cut, the solid has between these volumes.
    yield Case(
        "polygon_twisted.obj", obj(Solid(twisted, BOX.polygons, 1, 1)),
        "quadrilaterals a little bent", Solid(twisted, (), BOX.volume_m3, BOX.area_m2),
        recorded="not flat", tolerance=0.02,
    )  # fmt: skip
    for name, order in (("bow", (0, 2, 1, 3)), ("bow_cap", (4, 6, 5, 7))):
        crossed = [p if set(p) != set(order) else order for p in BOX.polygons]
        yield Case(
            f"bad_{name}.obj", obj(Solid(BOX.corners_m, tuple(crossed), 1, 1)),
            "a quadrilateral that crosses itself", refused="face [12] crosses itself",
        )  # fmt: skip
    pentagram = prism([(0.05 * math.cos(2 * a), 0.05 * math.sin(2 * a))
                       for a in np.arange(5) * 2 * np.pi / 5], 0.04)  # fmt: skip
    yield Case(
        "bad_pentagram.ply", ply(pentagram), "a pentagram drawn in one line",
        refused="face [12] crosses itself",
    )  # fmt: skip
