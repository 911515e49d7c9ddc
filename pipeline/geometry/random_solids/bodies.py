"""Bodies of random solids: eight kinds, each drawn from a random stream, some 0.1 m long.

Sizes are of no importance, as every object is rescaled; proportions are. Shares and bounds are
our choice: they spread the solids over the three classes of NSVR, and over what a pad of 25 mm
meets on things of 60 to 160 mm: curvature, edges, rims, steps, ribs, holes.
"""

import math
from collections.abc import Callable
from itertools import pairwise

import manifold3d
import numpy as np
from jaxtyping import Float

from pipeline.geometry.parametric.solids import (
    ROUND,
    SMALL_ROUND,
    Section,
    Solid,
    box,
    circle_points,
    cylinder,
    rounded_box,
    sweep,
    union,
)

REACH_M = 0.06  # half of a body's longest side, about
_PROFILE_POINTS = 40  # along a smooth outline; steps of 3 mm


def log_uniform(rng: np.random.Generator, least: float, most: float) -> float:
    """A positive number between two bounds, as often in each equal factor between them."""
    return math.exp(rng.uniform(math.log(least), math.log(most)))


def compact_body(rng: np.random.Generator) -> Solid:
    """A superquadric: from box over ellipsoid to double cone, stretched."""
    exponents = rng.uniform(0.15, 1.6, 2)
    reach = REACH_M * rng.uniform(0.35, 1.0, 3)
    unit = np.array(Solid.sphere(1.0, ROUND).to_mesh64().vert_properties)[:, :3]
    level = np.hypot(unit[:, 0], unit[:, 1])
    around = np.arctan2(unit[:, 1], unit[:, 0])
    across = _power(level, exponents[0])
    points = np.column_stack(
        [
            across * _power(np.cos(around), exponents[1]),
            across * _power(np.sin(around), exponents[1]),
            _power(unit[:, 2], exponents[0]),
        ]
    )
    return Solid.hull_points(points * reach) if exponents.max() <= 1 else _moved(points * reach)


def _moved(points: Float[np.ndarray, "n 3"]) -> Solid:
    """The ball of `ROUND` segments with its vertices moved, one for one."""
    return Solid.sphere(1.0, ROUND).warp_batch(lambda _: points)


def _power(value: Float[np.ndarray, " n"], exponent: float) -> Float[np.ndarray, " n"]:
    """Power of the magnitude, with the sign kept."""
    return np.asarray(np.sign(value) * np.abs(value) ** exponent)


def lump(rng: np.random.Generator) -> Solid:
    """A ball whose radius swells and shrinks by broad waves: fruit, stones, figures."""
    waves = rng.integers(2, 7)
    normals = rng.normal(size=(waves, 3)) * rng.uniform(0.8, 2.6, (waves, 1))
    phases = rng.uniform(0, 2 * math.pi, waves)
    swell = rng.uniform(0.1, 0.5) * rng.dirichlet(np.ones(waves))
    reach = REACH_M * rng.uniform(0.5, 1.0, 3)

    def shape(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        radius = 1.0 + np.sin(points @ normals.T + phases) @ swell
        return np.asarray(points * radius[:, None] * reach)

    return Solid.sphere(1.0, ROUND).warp_batch(shape)


def revolved_body(rng: np.random.Generator) -> Solid:
    """A smooth or stepped profile turned about z: bottles, cans, knobs, spools."""
    height = REACH_M * rng.uniform(0.3, 2.0)
    reach = REACH_M * rng.uniform(0.3, 0.9)
    if rng.random() < 0.5:
        along = np.linspace(0.0, 1.0, _PROFILE_POINTS)
        knots = rng.uniform(0.3, 1.0, rng.integers(2, 6))
        radius = reach * np.interp(along, np.linspace(0, 1, len(knots)), knots)
        radius = np.convolve(np.pad(radius, 4, mode="edge"), np.ones(9) / 9, mode="valid")
        outline = np.column_stack([radius, height * along])
    else:
        steps = int(rng.integers(1, 5))
        ends = np.linspace(0, height, steps + 1)
        radii = reach * rng.uniform(0.4, 1.0, steps)
        outline = np.column_stack(
            [np.repeat(radii, 2), np.column_stack([ends[:-1], ends[1:]]).reshape(-1)]
        )
    closed = np.vstack([[0.0, 0.0], outline, [0.0, height]])
    return Section([closed]).revolve(ROUND)


def random_outline(rng: np.random.Generator) -> Section:
    """A flat outline: a wavy or regular polygon, a rounded rectangle, or joined bars."""
    kind = rng.integers(4)
    if kind == 0:
        angle = np.linspace(0, 2 * math.pi, ROUND, endpoint=False)
        orders = rng.integers(1, 7, 3)
        radius = 1.0 + np.sin(angle[:, None] * orders + rng.uniform(0, 6.3, 3)) @ (
            rng.uniform(0.0, 0.28, 3)
        )
        points = circle_points(ROUND, 1.0) * radius[:, None]
    elif kind == 1:
        points = circle_points(int(rng.integers(3, 9)), 1.0, rng.uniform(0, math.pi))
    else:
        bars = 1 if kind == 2 else int(rng.integers(2, 5))
        sections = []
        for _ in range(bars):
            sides = rng.uniform(0.25, 1.0, 2) * 2
            sections.append(Section.square(tuple(sides), center=True))
        placed = [sections[0]]
        for each in sections[1:]:
            shift = rng.uniform(-0.6, 0.6, 2)
            placed.append(each.rotate(float(rng.choice([0.0, 90.0, 45.0]))).translate(shift))
        joined = Section.batch_boolean(placed, manifold3d.OpType.Add)
        corner = rng.uniform(0.0, 0.12)
        rounded = joined.offset(-corner, manifold3d.JoinType.Round).offset(
            corner, manifold3d.JoinType.Round, circular_segments=SMALL_ROUND
        )
        return (rounded if not rounded.is_empty() else joined).scale((REACH_M, REACH_M))
    stretch = rng.uniform(0.4, 1.0, 2)
    return Section([points * stretch * REACH_M], manifold3d.FillRule.NonZero)


def extruded_body(rng: np.random.Generator) -> Solid:
    """An outline drawn up, at times tapered or twisted: blocks, bars, nuts, brackets."""
    height = REACH_M * rng.uniform(0.2, 1.8)
    top = tuple(rng.uniform(0.5, 1.0, 2)) if rng.random() < 0.4 else (1.0, 1.0)
    twist = float(rng.uniform(-60, 60)) if rng.random() < 0.25 else 0.0
    return random_outline(rng).extrude(height, 12, twist, top)


def _primitive(rng: np.random.Generator) -> Solid:
    """One simple part, centred."""
    kind = rng.integers(5)
    a, b, c = REACH_M * rng.uniform(0.25, 1.0, 3)
    if kind == 0:
        return box(a * 1.6, b * 1.6, c * 1.6).translate((0, 0, -c * 0.8))
    if kind == 1:
        smallest = min(a, b, c)
        sides = (a * 1.7, b * 1.7, c * 1.7)
        part = rounded_box(*sides, smallest * rng.uniform(0.08, 0.7))
        return part.translate((0, 0, -sides[2] / 2))
    if kind == 2:
        return cylinder(a * 0.7, c * 2).translate((0, 0, -c))
    if kind == 3:
        return cylinder(a * 0.8, c * 2, a * 0.8 * rng.uniform(0.2, 0.9)).translate((0, 0, -c))
    return Solid.sphere(1.0, ROUND).scale((a, b, c))


def _turned(part: Solid, rng: np.random.Generator) -> Solid:
    """Turned as things mostly are, by quarters, or freely."""
    if rng.random() < 0.6:
        return part.rotate(tuple(90.0 * rng.integers(0, 4, 3)))
    return part.rotate(tuple(rng.uniform(0, 360, 3)))


def joined_body(rng: np.random.Generator) -> Solid:
    """Two to five simple parts that overlap, at times less one or two more."""
    parts = [_turned(_primitive(rng), rng)]
    for _ in range(int(rng.integers(1, 5))):
        # About a point of the surface of what is there already: so they overlap.
        corners = np.array(union(parts).to_mesh64().vert_properties)[:, :3]
        place = 0.9 * corners[rng.integers(len(corners))]
        part = _turned(_primitive(rng), rng).scale(tuple([float(rng.uniform(0.35, 1.0))] * 3))
        parts.append(part.translate(tuple(place)))
    body = union(parts)
    for _ in range(int(rng.integers(0, 3))):
        corners = np.array(body.to_mesh64().vert_properties)[:, :3]
        place = corners[rng.integers(len(corners))]
        cut = _turned(_primitive(rng), rng).scale(tuple([float(rng.uniform(0.2, 0.6))] * 3))
        body = body - cut.translate(tuple(place))
    return body


def hollow_body(rng: np.random.Generator) -> Solid:
    """A wall around a hollow that is open above: cups, bowls, boxes, tubes."""
    wall = rng.uniform(0.0015, 0.007)
    height = REACH_M * rng.uniform(0.3, 1.8)
    top = float(rng.uniform(0.8, 1.7))
    outline = random_outline(rng) if rng.random() < 0.5 else Section.circle(REACH_M * 0.7, ROUND)
    inner = outline.offset(-wall, manifold3d.JoinType.Round)
    outer = outline.extrude(height, 8, 0.0, (top, top))
    if inner.is_empty():
        return outer
    floor = -0.01 if rng.random() < 0.15 else wall
    hollow = inner.extrude(height, 8, 0.0, (top, top)).translate((0, 0, floor))
    body = outer - hollow
    if rng.random() < 0.3:
        reach = REACH_M * 0.7 * (1 + top) / 2
        handle = sweep(
            _half_ring(height * 0.3) + np.array([reach - 0.004, 0.0, height / 2]),
            rng.uniform(0.003, 0.007),
        )
        body = body + (handle - outline.extrude(height, 8, 0.0, (top, top)))
    return body


def _half_ring(radius: float) -> Float[np.ndarray, "n 3"]:
    """Half a circle in the plane y = 0, on the side of +x."""
    turn = np.linspace(-math.pi / 2, math.pi / 2, SMALL_ROUND)
    return np.column_stack([radius * np.cos(turn), np.zeros_like(turn), radius * np.sin(turn)])


def studded_plate(rng: np.random.Generator) -> Solid:
    """A plate or block with a field of pegs, ribs, holes or slots: fine structure."""
    sides = REACH_M * rng.uniform(0.7, 1.0, 2) * 2
    thick = rng.uniform(0.003, 0.03)
    plate = box(float(sides[0]), float(sides[1]), float(thick))
    pitch = rng.uniform(0.007, 0.03)
    size = pitch * rng.uniform(0.2, 0.8)
    high = rng.uniform(0.001, 0.012)
    counts = np.maximum((sides - size) // pitch, 1).astype(int)
    places = [
        ((i - (counts[0] - 1) / 2) * pitch, (j - (counts[1] - 1) / 2) * pitch)
        for i in range(counts[0])
        for j in range(counts[1])
    ]
    raised = rng.random() < 0.6
    through = rng.random() < 0.5
    depth = high if raised else (thick * 1.2 if through else min(high, thick * 0.7))
    if rng.random() < 0.35:  # ribs or slots along y
        part = box(float(size), float(sides[1]) * rng.uniform(0.7, 0.95), float(depth) * 2)
        places = [(x, 0.0) for x in sorted({x for x, _ in places})]
    elif rng.random() < 0.5:
        part = cylinder(size / 2, depth * 2, segments=SMALL_ROUND)
    else:
        part = box(float(size), float(size), float(depth) * 2)
    field = union([part.translate((x, y, thick - depth)) for x, y in places])
    return plate + field if raised else plate - field


def rod_body(rng: np.random.Generator) -> Solid:
    """A bent bar, most with a head at one end: tools, handles, hooks."""
    count = int(rng.integers(3, 6))
    steps = rng.normal(size=(count, 3)) * [1.0, 0.35, 0.15]
    steps[:, 0] = np.abs(steps[:, 0]) + 0.4
    knots = np.cumsum(steps, axis=0)
    knots *= 2 * REACH_M / np.ptp(knots[:, 0])
    thick = rng.uniform(0.006, 0.018)
    flat = rng.uniform(0.3, 1.0)
    ball = Solid.sphere(1.0, SMALL_ROUND)
    if rng.random() < 0.4:
        ball = box(2.0, 2.0, 2.0).translate((0, 0, -1.0))
    widths = thick * rng.uniform(0.6, 1.3, count)
    ends = [
        ball.scale((width, width, width * flat)).translate(tuple(knot))
        for width, knot in zip(widths, knots, strict=True)
    ]
    spans = [Solid.batch_hull([a, b]) for a, b in pairwise(ends)]
    if rng.integers(3):
        head = _turned(_primitive(rng), rng).scale(tuple([float(rng.uniform(0.3, 0.6))] * 3))
        spans.append(head.translate(tuple(knots[0])))
    return union(spans)


KINDS: dict[str, tuple[Callable[[np.random.Generator], Solid], float]] = {
    "compact": (compact_body, 0.09),
    "lump": (lump, 0.11),
    "revolved": (revolved_body, 0.10),
    "extruded": (extruded_body, 0.13),
    "joined": (joined_body, 0.18),
    "hollow": (hollow_body, 0.15),
    "studded": (studded_plate, 0.13),
    "rod": (rod_body, 0.11),
}
"""Kind → what draws it, and its share of all solids [1]."""
