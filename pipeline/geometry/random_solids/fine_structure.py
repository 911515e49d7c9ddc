"""Bodies of random solids with structure finer than a pad: thin wings, narrow holes and slits.

Two kinds beside those of ``bodies``, ``household`` and ``relief``, drawn where
``objects.solid_kinds`` names them: toy aeroplanes, propellers and brackets, whose parts a pad
overhangs; and bodies with a few holes and slits some millimetres wide, through which a pad leaks.
Holes narrower than a cell of the network's input are not seen in it.
"""

from collections.abc import Callable

import numpy as np

from pipeline.geometry.parametric.solids import (
    ROUND,
    SMALL_ROUND,
    Solid,
    box,
    cylinder,
    rounded_box,
    union,
)
from pipeline.geometry.random_solids.bodies import (
    REACH_M,
    compact_body,
    extruded_body,
    log_uniform,
    revolved_body,
)
from pipeline.geometry.random_solids.relief import ringed_body

_FROM_Z = ((0.0, 90.0, 0.0), (90.0, 0.0, 0.0), (0.0, 0.0, 0.0))  # lays z along x, y, z [degrees]


def winged_body(rng: np.random.Generator) -> Solid:
    """A long hull with thin plates through it: wings, fins, blades."""
    long_m = 2 * REACH_M
    wide, high = (float(side) for side in long_m * rng.uniform(0.08, 0.3, 2))
    if rng.random() < 0.6:
        hull = Solid.sphere(1.0, ROUND).scale((long_m / 2, wide / 2, high / 2))
    else:
        corner = min(wide, high) * rng.uniform(0.1, 0.45)
        hull = rounded_box(long_m, wide, high, corner).translate((0, 0, -high / 2))
    parts = [hull]
    for _ in range(int(rng.integers(1, 4))):
        wing = _wing(long_m, rng)
        tilt = rng.uniform(-25.0, 25.0) if rng.random() < 0.5 else 0.0
        # A pair of wings, or a fin on any side.
        pair = rng.random() < 0.75
        rolls = (90.0 + tilt, -90.0 - tilt) if pair else (rng.uniform(0.0, 360.0),)
        at = rng.uniform(-0.35, 0.35) * long_m
        parts += [wing.rotate((roll, 0, 0)).translate((at, 0, 0)) for roll in rolls]
    return union(parts)


def _wing(long_m: float, rng: np.random.Generator) -> Solid:
    """A thin plate in the plane y = 0 that rises from z = 0; its tip may be narrower, and swept."""
    span, chord = long_m * rng.uniform(0.2, 0.5), long_m * rng.uniform(0.1, 0.35)
    thick, tip = log_uniform(rng, 0.0015, 0.006), chord * rng.uniform(0.4, 1.0)
    swept = rng.uniform(-0.5, 0.5) * chord
    corners = [
        (x * side / 2 + shift, y * thick / 2, z)
        for z, side, shift in ((0.0, chord, 0.0), (span, tip, swept))
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    return Solid.hull_points(np.array(corners))


def drilled_body(rng: np.random.Generator) -> Solid:
    """A body with a few narrow holes or slits, through it or blind."""
    bodies = (compact_body, extruded_body, revolved_body, ringed_body, _slab)
    body = bodies[int(rng.integers(len(bodies)))](rng)
    low, high = np.array(body.bounding_box()).reshape(2, 3)
    middle, reach = (low + high) / 2, (high - low) / 2
    for _ in range(int(rng.integers(1, 9))):
        axis = int(rng.integers(3))
        beside = np.where(np.arange(3) == axis, 0.0, 0.75 * reach * rng.uniform(-1.0, 1.0, 3))
        # From one end to the other, or from within to one end.
        starts = -1.1 if rng.random() < 0.5 else rng.uniform(-0.5, 0.95)
        tool = _drill(float((1.1 - starts) * reach[axis]), rng).translate(
            (0, 0, float(starts * reach[axis]))
        )
        if rng.random() < 0.5:
            tool = tool.rotate((180, 0, 0))
        tool = tool.rotate(_FROM_Z[axis])
        cut = body - tool.translate(tuple(float(each) for each in middle + beside))
        if len(cut.decompose()) == 1:  # a slit may part a thin body
            body = cut
    return body


def _drill(long_m: float, rng: np.random.Generator) -> Solid:
    """What is taken out: a narrow rod or slat that stands on z = 0."""
    width = log_uniform(rng, 0.0015, 0.007)
    if rng.random() < 0.6:
        return cylinder(width / 2, long_m, segments=SMALL_ROUND)
    slat = box(width, width * log_uniform(rng, 1.5, 10.0), long_m)
    return slat.rotate((0, 0, rng.uniform(0.0, 180.0)))


def _slab(rng: np.random.Generator) -> Solid:
    """A board or a block."""
    sides = 2 * REACH_M * np.array([1.0, rng.uniform(0.4, 1.0), log_uniform(rng, 0.05, 0.6)])
    return box(*(float(side) for side in sides))


KINDS: dict[str, tuple[Callable[[np.random.Generator], Solid], float]] = {
    "winged": (winged_body, 0.2),
    "drilled": (drilled_body, 0.25),
}
"""Kind → what draws it, and its share beside the others: ``bodies.KINDS`` sum to 1 [1]."""
