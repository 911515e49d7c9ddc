"""Skins of random solids: marks raised and sunk into the surface, then a smooth warp of space.

A warp x → x + v(x) whose v changes by less than its argument does (a contraction) moves no two
points onto each other: a closed surface stays closed and never cuts itself, however thin.
"""

import math

import numpy as np
from jaxtyping import Float

from pipeline.geometry.parametric.solids import SMALL_ROUND, Solid, box, cylinder, union

# Bound of the sum of amplitude times wave number: under 1 the warp is one to one; at 0.6 a surface
# still turns by 31 degrees at most.
_MOST_SLOPE = 0.6
_MOST_MARKS = 40


def mark(body: Solid, rng: np.random.Generator) -> Solid:
    """The body with dents, holes, studs or bars on its surface, of one kind and one size.

    Parameters
    ----------
    body
        Some 0.1 m long.
    rng
        Draws what, how large, how many and where.

    Returns
    -------
    The marked body; of several pieces where a mark cut it through.
    """
    arrays = body.to_mesh64()
    vertices = np.array(arrays.vert_properties)[:, :3]
    corners = vertices[np.array(arrays.tri_verts).astype(np.int64)]
    places, normals = _points_on(corners, int(rng.integers(1, _MOST_MARKS + 1)), rng)
    radius = float(rng.uniform(0.0015, 0.012)) / math.sqrt(1 + len(places) / 10)
    kind, depth = rng.integers(3), radius * float(rng.uniform(0.15, 1.0))
    if kind == 0:
        part = Solid.sphere(radius, SMALL_ROUND).translate((0, 0, radius - depth))
    elif kind == 1:
        part = cylinder(radius, 2 * depth, segments=SMALL_ROUND).translate((0, 0, -depth))
    else:
        length = radius * float(rng.uniform(1.0, 5.0))
        part = box(2 * length, radius, 2 * depth).translate((0, 0, -depth))
    marks = union(
        [
            part.transform(_frame(place, normal, float(rng.uniform(0, 2 * math.pi))))
            for place, normal in zip(places, normals, strict=True)
        ]
    )
    return body + marks if rng.random() < 0.4 else body - marks


def _points_on(
    corners: Float[np.ndarray, "m 3 3"], count: int, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Points spread over triangles by area, with their normals."""
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    at = rng.choice(len(corners), size=count, p=area / area.sum())
    a, b = np.sort(rng.random((2, count)), axis=0)
    weights = np.column_stack([a, b - a, 1 - b])
    return np.einsum("nk,nkd->nd", weights, corners[at]), cross[at] / area[at, None]


def _frame(
    place: Float[np.ndarray, " 3"], normal: Float[np.ndarray, " 3"], turn: float
) -> Float[np.ndarray, "3 4"]:
    """Frame of a mark on the surface, z along the outward normal: 3 rows, origin last."""
    side = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    side /= np.linalg.norm(side)
    up = np.cross(normal, side)
    x = math.cos(turn) * side + math.sin(turn) * up
    return np.column_stack([x, np.cross(normal, x), normal, place])


def warp(
    points_m: Float[np.ndarray, "n 3"],
    wavelengths_m: tuple[float, float],
    slope: float,
    rng: np.random.Generator,
) -> Float[np.ndarray, "n 3"]:
    """Move points by a sum of random waves; nearby ones alike, and no two onto each other.

    Parameters
    ----------
    points_m
        Shape (n, 3) [m].
    wavelengths_m
        Shortest and longest wave [m].
    slope
        Sum over the waves of amplitude times wave number, under 1 [1].
    rng
        Draws the waves.

    Returns
    -------
    The moved points, shape (n, 3) [m].
    """
    count = 12
    shortest, longest = np.log(wavelengths_m)
    numbers = 2 * math.pi / np.exp(rng.uniform(shortest, longest, count))  # [rad/m]
    along, moved = rng.normal(size=(2, count, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    moved /= np.linalg.norm(moved, axis=1)[:, None]
    amplitudes = slope * rng.dirichlet(np.ones(count)) / numbers
    phases = points_m @ (along * numbers[:, None]).T + rng.uniform(0, 2 * math.pi, count)
    return np.asarray(points_m + np.sin(phases) @ (moved * amplitudes[:, None]))


def bent_and_rough(
    points_m: Float[np.ndarray, "n 3"], rng: np.random.Generator
) -> Float[np.ndarray, "n 3"]:
    """Points of a body bent as a whole, and its skin made uneven, each at times or not at all.

    Parameters
    ----------
    points_m
        Of the surface, shape (n, 3) [m].
    rng
        Draws both.

    Returns
    -------
    The moved points, shape (n, 3) [m].
    """
    if rng.random() < 0.4:
        points_m = warp(points_m, (0.08, 0.3), float(rng.uniform(0.1, _MOST_SLOPE)), rng)
    if rng.random() < 0.65:
        # Log-uniform: most skins are nearly smooth, as scans of smooth things are.
        slope = float(np.exp(rng.uniform(math.log(0.02), math.log(0.4))))
        points_m = warp(points_m, (0.008, 0.05), slope, rng)
    return points_m
