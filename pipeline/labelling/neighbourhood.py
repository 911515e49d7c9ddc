"""Sums over the points of a surface that lie within a radius of given points.

Points are sorted into cubic cells whose side is the radius, so all that may be near lies in the 27
cells around. They are added in the order of their indices, which is the order of the picture's
pixels: the sums have the bits that any other search adds up to in that order.
"""

import numpy as np
from jaxtyping import Float, Int

from pipeline.compiled_code import njit

# Cells along the longest side of the points: bounds the memory of cells where the radius is small.
_MOST_CELLS = 64
# Cells are this much wider than the radius: rounding must not put a near point two cells away.
_WIDER = 1 + 1e-9


def sums_within(
    points_m: Float[np.ndarray, "n 3"],
    values: Float[np.ndarray, "n 3"],
    around_m: Float[np.ndarray, "k 3"],
    radius_m: float,
) -> tuple[Float[np.ndarray, "k 3"], Int[np.ndarray, " k"]]:
    """Sum the values of all points within a distance of each given point.

    Parameters
    ----------
    points_m
        The points [m], at least one, shape (n, 3).
    values
        What is summed, shape (n, 3).
    around_m
        Where sums are wanted, in the same frame [m], shape (k, 3).
    radius_m
        Points within this distance count [m].

    Returns
    -------
    Sums, shape (k, 3), and how many points each is of, shape (k,).
    """
    return _sums_within(
        np.ascontiguousarray(points_m),
        np.ascontiguousarray(values),
        np.ascontiguousarray(around_m),
        radius_m,
    )


@njit()
def _sums_within(
    points: Float[np.ndarray, "n 3"],
    values: Float[np.ndarray, "n 3"],
    around: Float[np.ndarray, "k 3"],
    radius: float,
) -> tuple[Float[np.ndarray, "k 3"], Int[np.ndarray, " k"]]:
    """As `sums_within`."""
    count = len(points)
    lower, upper = points[0].copy(), points[0].copy()
    for i in range(count):
        for axis in range(3):
            lower[axis] = min(lower[axis], points[i, axis])
            upper[axis] = max(upper[axis], points[i, axis])
    side = _WIDER * max(radius, (upper - lower).max() / _MOST_CELLS)
    cells = np.ones(3, dtype=np.int64)
    for i in range(count):
        for axis in range(3):
            cells[axis] = max(cells[axis], int((points[i, axis] - lower[axis]) / side) + 1)
    # A counting sort: the points of a cell lie together, by their indices.
    first = np.zeros(cells[0] * cells[1] * cells[2] + 1, dtype=np.int64)
    cell_of = np.empty(count, dtype=np.int64)
    for i in range(count):
        x = int((points[i, 0] - lower[0]) / side)
        y = int((points[i, 1] - lower[1]) / side)
        z = int((points[i, 2] - lower[2]) / side)
        cell_of[i] = (z * cells[1] + y) * cells[0] + x
        first[cell_of[i] + 1] += 1
    for cell in range(len(first) - 1):
        first[cell + 1] += first[cell]
    placed = first[:-1].copy()
    order = np.empty(count, dtype=np.int64)
    places = np.empty((count, 3))
    for i in range(count):
        at = placed[cell_of[i]]
        order[at] = i
        for axis in range(3):
            places[at, axis] = points[i, axis]
        placed[cell_of[i]] += 1

    sums = np.zeros((len(around), 3))
    counts = np.zeros(len(around), dtype=np.int64)
    # A byte a point says whether it is near; read eight at a time, few of them are.
    near = np.zeros(-(-count // 8) * 8, dtype=np.uint8)
    eight = near.view(np.uint64)
    low, high = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    for k in range(len(around)):
        for axis in range(3):
            middle = int(np.floor((around[k, axis] - lower[axis]) / side))
            low[axis] = max(middle - 1, 0)
            high[axis] = min(middle + 1, cells[axis] - 1)
        least, greatest = count, -1
        for z in range(low[2], high[2] + 1):
            for y in range(low[1], high[1] + 1):
                row = (z * cells[1] + y) * cells[0]
                if low[0] > high[0]:
                    continue
                for at in range(first[row + low[0]], first[row + high[0] + 1]):
                    dx = places[at, 0] - around[k, 0]
                    dy = places[at, 1] - around[k, 1]
                    dz = places[at, 2] - around[k, 2]
                    if dx * dx + dy * dy + dz * dz <= radius * radius:
                        i = order[at]
                        near[i] = 1
                        least = min(least, i)
                        greatest = max(greatest, i)
        for word in range(least // 8, greatest // 8 + 1):
            if eight[word] == 0:
                continue
            for i in range(8 * word, 8 * word + 8):
                if near[i] == 1:
                    counts[k] += 1
                    for axis in range(3):
                        sums[k, axis] += values[i, axis]
            eight[word] = 0
    return sums, counts
