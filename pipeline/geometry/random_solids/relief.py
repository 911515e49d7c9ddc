"""Bodies of random solids with shallow relief as wide as a pad: ringed ends and tiled faces.

Two kinds beside those of ``bodies`` and ``household``, drawn where ``objects.solid_kinds`` names
them. Ends of cans, cups, bottles and lids: domed or hollow, with rims and grooves around their
middle. And blocks put together of pieces that lie side by side, some of them a little higher or
askew. A network that had learned the other kinds promised far too much on the base of a cup and on
a field of wooden blocks of its test, from pictures without noise too. These two scans were looked
at when the kinds were made, so they are no blind test of them.
"""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from pipeline.geometry.parametric.solids import ROUND, Section, Solid, box, cylinder, union
from pipeline.geometry.random_solids.bodies import REACH_M, log_uniform

_END_POINTS = 48  # along an end's radius; steps of 1.3 mm at most, less than a groove's width
_LEAST_TILE_M = 0.009  # six such in a row are as long as a pad is wide

Rectangle = tuple[float, float, float, float]  # least x and y, most x and y [m]


def ringed_body(rng: np.random.Generator) -> Solid:
    """A turned body, full or hollow from one side, whose ends have domes, rims and grooves."""
    radius = REACH_M * rng.uniform(0.35, 1.0)
    height = radius * log_uniform(rng, 0.25, 2.2)
    taper = rng.uniform(0.75, 1.0) if rng.random() < 0.4 else 1.0
    top, bottom = _end(radius * taper, rng), _end(radius, rng)
    bottom[:, 1] = np.minimum(-bottom[:, 1], 0.45 * height)
    top[:, 1] = np.maximum(top[:, 1], -0.45 * height) + height
    body = Section([np.vstack([bottom, top[::-1]])]).revolve(ROUND)
    if rng.random() < 0.4:
        wall = rng.uniform(0.0018, 0.005)
        floor = float(top[:, 1].min()) - wall
        if floor > 2 * wall:
            hollow = cylinder(radius - wall, floor + height, radius * taper - wall)
            body = body - hollow.translate((0, 0, -height))
    return body


def _end(radius_m: float, rng: np.random.Generator) -> Float[np.ndarray, "n 2"]:
    """Profile of an end, from its axis to its border: radius, and height over a plane [m]."""
    r = np.linspace(0.0, radius_m, _END_POINTS)
    inside = r / radius_m
    height = np.zeros(_END_POINTS)
    if rng.random() < 0.7:  # a dome or a hollow, up to some part of the radius
        ends_at, bend = rng.uniform(0.5, 1.0), rng.uniform(1.5, 4.0)
        sign = 1.0 if rng.random() < 0.5 else -1.0
        height += sign * _drawn_depth(rng) * (1 - np.minimum(inside / ends_at, 1.0) ** bend)
    if rng.random() < 0.6:  # the middle lies lower than the rim, or higher
        step_at, sign = rng.uniform(0.45, 0.97), 1.0 if rng.random() < 0.25 else -1.0
        width_m = rng.uniform(0.0008, 0.006)
        height += sign * _drawn_depth(rng) / (1 + np.exp((r - step_at * radius_m) / width_m * 4))
    for _ in range(int(rng.integers(0, 4))):  # ridges and grooves around the axis
        at, width_m = rng.uniform(0.05, 1.0) * radius_m, rng.uniform(0.0015, 0.007)
        sign = 1.0 if rng.random() < 0.5 else -1.0
        away = np.minimum(np.abs(r - at) / width_m, 1.0)
        round_top = 0.5 + 0.5 * np.cos(math.pi * away)
        ridge = round_top if rng.random() < 0.6 else np.minimum(2 * round_top, 1.0)
        height += sign * 0.6 * _drawn_depth(rng) * ridge
    rounding = rng.uniform(0.0, 0.006)
    if rounding > 0.001:
        short = np.maximum(r - (radius_m - rounding), 0.0)
        height -= rounding - np.sqrt(np.maximum(rounding**2 - short**2, 0.0))
    height[0] = height[1]
    return np.column_stack([r, height])


def _drawn_depth(rng: np.random.Generator) -> float:
    """How deep a relief is: more often a fraction of a millimetre than several [m]."""
    return log_uniform(rng, 0.0004, 0.006)


def tiled_block(rng: np.random.Generator) -> Solid:
    """A block whose two wide faces are fields of tiles, some higher or askew, with gaps or none."""
    sides = 2 * REACH_M * np.array([1.0, rng.uniform(0.45, 1.0)])
    uneven_m = log_uniform(rng, 0.0002, 0.004)
    gap_m = 0.0 if rng.random() < 0.6 else rng.uniform(0.0003, 0.0025)
    chamfer_m = 0.0 if rng.random() < 0.5 else rng.uniform(0.0003, 0.002)
    askew = rng.uniform(0.0, 0.05) if rng.random() < 0.6 else 0.0
    core_m = REACH_M * rng.uniform(0.12, 0.9)
    parts = [box(float(sides[0] - gap_m), float(sides[1] - gap_m), core_m)]
    for upwards in (True, False):
        for tile in _tiles(sides, rng):
            own = 1.5 * uneven_m + 0.002 + uneven_m * rng.uniform(-1.0, 1.0)
            prism = _prism(tile, gap_m, chamfer_m, own, askew * rng.uniform(-1.0, 1.0, 2))
            if not upwards:
                prism = prism.mirror((0, 0, 1)).translate((0, 0, core_m))
            # Tiles begin within the block, so that all are one.
            parts.append(prism.translate((0, 0, core_m - 0.001 if upwards else 0.001 - core_m)))
    return union(parts)


def _tiles(sides_m: Float[np.ndarray, " 2"], rng: np.random.Generator) -> list[Rectangle]:
    """A rectangle around the origin cut into tiles: rows of bricks, or cut again and again."""
    x, y = (float(side) / 2 for side in sides_m)
    if rng.random() < 0.5:
        rows, columns = int(rng.integers(1, 6)), int(rng.integers(1, 6))
        shift = 0.0 if rng.random() < 0.4 else rng.uniform(0.1, 0.9)
        tiles: list[Rectangle] = []
        for number in range(rows):
            low, high = (-y + 2 * y * (number + end) / rows for end in (0, 1))
            starts = (np.arange(columns) + (shift if number % 2 else 0.0)) / columns
            cuts = np.unique(np.concatenate([[0.0], starts[starts < 1], [1.0]]))
            edges = -x + 2 * x * cuts
            tiles += [(float(a), low, float(b), high) for a, b in pairwise(edges)]
        return tiles
    return _cut((-x, -y, x, y), int(rng.integers(2, 5)), rng)


def _cut(part: Rectangle, times: int, rng: np.random.Generator) -> list[Rectangle]:
    """A rectangle cut in two, and its parts again, so many times; small ones stay whole."""
    x0, y0, x1, y1 = part
    along_x = (x1 - x0) * rng.uniform(0.5, 2.0) > y1 - y0
    low, high = (x0, x1) if along_x else (y0, y1)
    if times == 0 or high - low < 2 * _LEAST_TILE_M or rng.random() < 0.1:
        return [part]
    at = float(np.clip(rng.uniform(low, high), low + _LEAST_TILE_M, high - _LEAST_TILE_M))
    first: Rectangle = (x0, y0, at, y1) if along_x else (x0, y0, x1, at)
    second: Rectangle = (at, y0, x1, y1) if along_x else (x0, at, x1, y1)
    return _cut(first, times - 1, rng) + _cut(second, times - 1, rng)


def _prism(
    tile: Rectangle,
    gap_m: float,
    chamfer_m: float,
    height_m: float,
    slopes: Float[np.ndarray, " 2"],
) -> Solid:
    """A tile on z = 0, smaller by half the gap on each side, its top inclined and chamfered."""
    low, high = np.array(tile[:2]) + gap_m / 2, np.array(tile[2:]) - gap_m / 2
    middle = (low + high) / 2
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    # No corner sinks into the block under the tile.
    rise = np.clip((corners - middle) @ slopes, -0.6 * height_m, None)
    inset = middle + (corners - middle) * (1 - 2 * chamfer_m / (high - low))
    rings = [
        np.column_stack([corners, np.zeros(4)]),
        np.column_stack([corners, height_m + rise - min(chamfer_m, 0.3 * height_m)]),
        np.column_stack([inset, height_m + rise]),
    ]
    return Solid.hull_points(np.vstack(rings))


KINDS: dict[str, tuple[Callable[[np.random.Generator], Solid], float]] = {
    "ringed": (ringed_body, 0.3),
    "tiled": (tiled_block, 0.2),
}
"""Kind → what draws it, and its share beside the others: ``bodies.KINDS`` sum to 1 [1]."""
