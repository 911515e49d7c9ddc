"""Bodies of random solids that a kitchen and a toy box hold: dishes, grooved blocks, rows.

Three further kinds beside those of ``bodies``, drawn where ``objects.solid_kinds`` names them:
smooth hollows with a rim all around, grooves on every face, things that stand side by side at
unlike heights. Dishes, because a network that had learned the other kinds erred by 0.079 on a plate
of val (run ``more_solids``); the others, because a Rubik's cube and a row of blocks of its test
were among the worst: so these two are no blind test of them.
"""

import math
from collections.abc import Callable

import manifold3d
import numpy as np
from jaxtyping import Float

from pipeline.geometry.parametric.solids import (
    ROUND,
    SMALL_ROUND,
    Section,
    Solid,
    box,
    cylinder,
    rounded_box,
    torus,
    union,
)
from pipeline.geometry.random_solids.bodies import REACH_M, log_uniform

_PROFILE_POINTS = 32  # along a dish's section; steps of 3 mm


def dish(rng: np.random.Generator) -> Solid:
    """A shell whose section is an arc, at times with a flat base, flange, bead or foot ring."""
    wall = REACH_M * log_uniform(rng, 0.03, 0.13)
    middle = _dish_section(rng)
    step = np.gradient(middle, axis=0)
    normal = np.column_stack([-step[:, 1], step[:, 0]])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    below, above = middle - normal * wall / 2, middle + normal * wall / 2
    # On the axis both sides end: the first point's normal is not quite along it.
    below[0, 0] = above[0, 0] = 0.0
    body = Section([np.vstack([below, above[::-1]])], manifold3d.FillRule.NonZero).revolve(ROUND)
    rim, foot = middle[-1], rng.uniform(0.25, 0.7) * middle[-1, 0]
    if rng.random() < 0.3:
        bead = torus(float(rim[0]), wall * rng.uniform(0.55, 1.2))
        body = body + bead.translate((0, 0, float(rim[1])))
    if rng.random() < 0.4:
        height = float(np.interp(foot, middle[:, 0], middle[:, 1]))
        ring = cylinder(foot + wall / 2, height + 2 * wall) - cylinder(
            foot - wall / 2, height + 2 * wall
        )
        body = body + ring.translate((0, 0, -2 * wall))
    if rng.random() < 0.3:
        body = body.scale((1.0, float(rng.uniform(0.55, 1.0)), 1.0))
    return body


def _dish_section(rng: np.random.Generator) -> Float[np.ndarray, "n 2"]:
    """The middle of a dish's wall from its axis to its rim: radius and height."""
    base = REACH_M * rng.uniform(0.0, 0.75)
    depth = REACH_M * log_uniform(rng, 0.12, 1.4)
    turn = np.linspace(0.0, rng.uniform(0.9, math.pi / 2), _PROFILE_POINTS)
    bend = rng.uniform(0.7, 1.4, 2)
    out, up = np.sin(turn) ** bend[0], 1.0 - np.cos(turn) ** bend[1]
    radius = base + (REACH_M - base) * out / out[-1]
    arc = np.column_stack([radius, depth * up / up[-1]])
    section = [np.linspace([0.0, 0.0], arc[0], 8)[:-1]] if base > 0 else []
    section.append(arc)
    if rng.random() < 0.4:
        reach = REACH_M * rng.uniform(0.1, 0.45)
        flange = arc[-1] + reach * np.array([1.0, rng.uniform(0.0, 0.4)])
        section.append(np.linspace(arc[-1], flange, 6)[1:])
    return np.vstack(section)


def grooved_block(rng: np.random.Generator) -> Solid:
    """A block whose faces are cut into fields by grooves: cubes of cubes, bricks, chocolate."""
    sides = 2 * REACH_M * (rng.uniform(0.35, 1.0, 3) if rng.random() < 0.6 else np.ones(3))
    smallest = float(sides.min())
    # Few and shallow enough that convex parts are found in seconds: no lattice.
    counts = np.clip(np.round(sides / (smallest / rng.integers(2, 5))), 1, 5).astype(int)
    width = rng.uniform(0.0006, 0.003)
    depth = rng.uniform(0.0006, 0.003)
    a, b, c = map(float, sides)
    block = box(a, b, c)
    if rng.random() < 0.5:
        block = rounded_box(a, b, c, smallest * rng.uniform(0.02, 0.15))
    core = box(a - 2 * depth, b - 2 * depth, c - 2 * depth).translate((0, 0, depth))
    slabs = []
    for axis in rng.permutation(3)[: rng.integers(1, 4)]:
        size = 1.1 * sides
        size[axis] = width
        slab = box(float(size[0]), float(size[1]), float(size[2]))
        slab = slab.translate((0, 0, float(c - size[2]) / 2))
        for number in range(1, counts[axis]):
            place = np.zeros(3)
            place[axis] = (number / counts[axis] - 0.5) * sides[axis]
            slabs.append(slab.translate((float(place[0]), float(place[1]), float(place[2]))))
    return block - (union(slabs) - core) if slabs else block


def row(rng: np.random.Generator) -> Solid:
    """Blocks, rods or posts side by side on a base, alike or at heights of their own."""
    counts = (int(rng.integers(2, 8)), 1 if rng.random() < 0.5 else int(rng.integers(2, 5)))
    pitch = 2 * REACH_M / max(counts) * np.array([1.0, rng.uniform(0.6, 1.4)])
    if counts[1] == 1:
        pitch[1] = REACH_M * rng.uniform(0.3, 1.6)
    kind = int(rng.integers(3))
    size = pitch * rng.uniform(0.82, 0.99, 2)
    if kind != 1 and rng.random() < 0.3:
        size = 1.01 * pitch  # no gaps; posts would still touch along a line only
    height = REACH_M * rng.uniform(0.25, 1.2)
    uneven = rng.uniform(0.0, 0.35) if rng.random() < 0.6 else 0.0
    parts = []
    for i in range(counts[0]):
        for j in range(counts[1]):
            own = height * (1.0 + uneven * rng.uniform(-1.0, 1.0))
            part = _post(kind, float(size[0]), float(size[1]), float(own))
            x, y = (i - (counts[0] - 1) / 2) * pitch[0], (j - (counts[1] - 1) / 2) * pitch[1]
            parts.append(part.translate((float(x), float(y), 0.0)))
    base = height * (1.0 - uneven) * rng.uniform(0.25, 0.9)
    # The base ends within the outermost things, so that all are one.
    reach = (np.array(counts) - 1) * pitch + size * (rng.uniform(0.2, 0.9) if kind else 1.0)
    return union([*parts, box(float(reach[0]), max(float(reach[1]), 0.2 * float(size[1])), base)])


def _post(kind: int, size_x: float, size_y: float, height: float) -> Solid:
    """One thing of a row, standing on z = 0: a block, a post, or a rod that lies along y."""
    if kind == 0:
        return box(size_x, size_y, height)
    if kind == 1:
        return cylinder(1.0, height).scale((size_x / 2, size_y / 2, 1.0))
    round_top = min(size_x, height) / 2
    lying = cylinder(1.0, size_y, segments=SMALL_ROUND).rotate((90, 0, 0))
    lying = lying.scale((size_x / 2, 1.0, round_top)).translate((0, size_y / 2, height - round_top))
    return box(size_x, size_y, height - round_top) + lying


KINDS: dict[str, tuple[Callable[[np.random.Generator], Solid], float]] = {
    "dish": (dish, 0.5),
    "grooved": (grooved_block, 0.25),
    "row": (row, 0.25),
}
"""Kind → what draws it, and its share beside the others: ``bodies.KINDS`` sum to 1 [1]."""
