"""Frames, racks and tools: much surface for little volume, mostly Complex."""

import math

from pipeline.geometry.parametric.solids import (
    Solid,
    around_z,
    box,
    circle_points,
    cylinder,
    plate,
    rounded_box,
    torus,
    union,
)


def crate() -> Solid:
    """An open lattice box: four walls of slats on a slatted floor."""
    slats = [box(0.12, 0.008, 0.003).translate((0, y, 0)) for y in _steps(-0.036, 0.036, 5)]
    slats += [box(0.004, 0.08, 0.003).translate((x, 0, 0)) for x in (-0.057, 0.057)]
    for z in (0.008, 0.028, 0.048):
        slats += [box(0.12, 0.003, 0.012).translate((0, y, z)) for y in (-0.0385, 0.0385)]
        slats += [box(0.003, 0.08, 0.012).translate((x, 0, z)) for x in (-0.0585, 0.0585)]
    posts = [
        box(0.006, 0.006, 0.062).translate((x, y, 0))
        for x in (-0.057, 0.057)
        for y in (-0.037, 0.037)
    ]
    return union([*slats, *posts])


def dish_rack() -> Solid:
    """Upright bars on a frame."""
    frame = [box(0.14, 0.006, 0.006).translate((0, y, 0)) for y in (-0.04, 0.04)]
    rungs = [box(0.006, 0.086, 0.006).translate((x, 0, 0)) for x in _steps(-0.067, 0.067, 6)]
    bars = [
        box(0.006, 0.006, 0.05).translate((x, y, 0))
        for x in _steps(-0.067, 0.067, 6)
        for y in (-0.03, 0.03)
    ]
    return union([*frame, *rungs, *bars])


def comb() -> Solid:
    """A back with fine teeth."""
    teeth = [box(0.002, 0.025, 0.004).translate((x, -0.0175, 0)) for x in _steps(-0.06, 0.06, 25)]
    return union([rounded_box(0.13, 0.014, 0.004, 0.0015), *teeth])


def garden_fork() -> Solid:
    """Four prongs, a neck and a handle."""
    prongs = [box(0.05, 0.004, 0.004).translate((0.095, y, 0)) for y in _steps(-0.018, 0.018, 4)]
    head = box(0.012, 0.042, 0.004).translate((0.066, 0, 0))
    return union([*prongs, head, box(0.14, 0.008, 0.006)])


def ladder() -> Solid:
    """Two rails and seven rungs."""
    rails = [box(0.16, 0.006, 0.008).translate((0, y, 0)) for y in (-0.025, 0.025)]
    rungs = [box(0.006, 0.05, 0.006).translate((x, 0, 0.001)) for x in _steps(-0.07, 0.07, 7)]
    return union([*rails, *rungs])


def spoked_wheel() -> Solid:
    """A rim, a hub and eight spokes."""
    spoke = box(0.06, 0.004, 0.006).translate((0.03, 0, -0.003))
    hub = cylinder(0.010, 0.016).translate((0, 0, -0.008))
    return union([torus(0.06, 0.006), hub, around_z(spoke, 8)])


def gear() -> Solid:
    """Twenty teeth around a thin web with a bore."""
    tooth = box(0.012, 0.008, 0.014).translate((0.052, 0, 0))
    ring = cylinder(0.050, 0.014) - cylinder(0.040, 0.020).translate((0, 0, -0.003))
    web = cylinder(0.042, 0.004).translate((0, 0, 0.005)) - cylinder(0.008, 0.02)
    return union([ring, web, around_z(tooth, 20)])


def star() -> Solid:
    """A flat six-pointed star."""
    outer, inner = circle_points(6, 0.06), circle_points(6, 0.025, math.pi / 6)
    outline = [tuple(point) for pair in zip(outer, inner, strict=True) for point in pair]
    return plate([(float(x), float(y)) for x, y in outline], 0.010)


def jack() -> Solid:
    """Three crossed bars with square ends, a child's jack."""
    bar = box(0.09, 0.008, 0.008).translate((0, 0, -0.004))
    end = box(0.012, 0.016, 0.016).translate((0.045, 0, -0.008))
    arm = union([bar, end, end.rotate((0, 0, 180))])
    return union([arm, arm.rotate((0, 0, 90)), arm.rotate((0, 90, 0))])


def cooling_grid() -> Solid:
    """A square grid of bars."""
    along = [box(0.13, 0.004, 0.004).translate((0, y, 0)) for y in _steps(-0.06, 0.06, 8)]
    across = [box(0.004, 0.124, 0.004).translate((x, 0, 0)) for x in _steps(-0.06, 0.06, 8)]
    return union([*along, *across])


def shelf_bracket() -> Solid:
    """Two plates at a right angle with a rib."""
    rib = (
        plate([(0, 0), (0.07, 0), (0, 0.07)], 0.004).rotate((90, 0, 0)).translate((0, 0.002, 0.004))
    )
    upright = box(0.005, 0.03, 0.09).translate((0.0025, 0, 0))
    return union([box(0.09, 0.03, 0.005).translate((0.045, 0, 0)), upright, rib])


def honeycomb() -> Solid:
    """A plate of hexagonal holes."""
    hole = Solid.cylinder(0.04, 0.0095, 0.0095, 6).translate((0, 0, -0.01))
    places = [
        (0.021 * (column + 0.5 * (row % 2)) - 0.0525, 0.0182 * row - 0.0455)
        for row in range(6)
        for column in range(6)
    ]
    return box(0.135, 0.115, 0.018) - union([hole.translate((x, y, 0)) for x, y in places])


def flat_wrench() -> Solid:
    """A handle with an open jaw at each end."""
    jaws = [
        (cylinder(0.018, 0.007) - box(0.022, 0.014, 0.02).translate((0.011, 0, -0.005)))
        .rotate((0, 0, turn))
        .translate((x, 0, 0))
        for x, turn in ((0.065, 0), (-0.065, 180))
    ]
    return union([box(0.11, 0.014, 0.007), *jaws])


def claw_hammer() -> Solid:
    """A handle and a head."""
    handle = box(0.12, 0.018, 0.014)
    head = box(0.024, 0.08, 0.024).translate((0.066, 0, -0.003))
    return union([handle, head])


def spatula() -> Solid:
    """A slotted blade on a long handle."""
    slots = union(
        [box(0.045, 0.005, 0.02).translate((0.065, y, -0.01)) for y in (-0.015, 0, 0.015)]
    )
    return union([box(0.07, 0.06, 0.004).translate((0.065, 0, 0)) - slots, box(0.13, 0.012, 0.006)])


def _steps(first: float, last: float, count: int) -> list[float]:
    return [first + (last - first) * i / (count - 1) for i in range(count)]
