"""Points of a plane sorted into square cells, so that rectangles find the points in them."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from pipeline.compiled_code import njit
from pipeline.read_only import read_only

# Cells a side of the square around the points: some 2 mm for the pad of Table I. More cells cost
# more rows a rectangle, fewer cost more points beside it.
CELLS = 24


@dataclass(frozen=True, eq=False)
class PointCells:
    """Points sorted into square cells, row by row.

    Attributes
    ----------
    order
        Number of each point before they were sorted, shape (v,).
    x_m, y_m
        Their coordinates, sorted [m], shape (v,).
    near_x_m, near_y_m
        The same in single precision.
    lower_m
        Corner of the first cell [m], shape (2,).
    per_m
        Cells a metre.
    rows
        First point, so sorted, of each cell, shape (24, 25); of a row's end in the last column.
    within
        Points in all cells of lower row and column, shape (25, 25).
    reach_m
        Largest coordinate of a point [m].
    """

    order: Int[np.ndarray, " v"]
    x_m: Float[np.ndarray, " v"]
    y_m: Float[np.ndarray, " v"]
    near_x_m: Float[np.ndarray, " v"]
    near_y_m: Float[np.ndarray, " v"]
    lower_m: Float[np.ndarray, " 2"]
    per_m: float
    rows: Int[np.ndarray, "24 25"]
    within: Int[np.ndarray, "25 25"]
    reach_m: float


def cells_of(points_xy_m: Float[np.ndarray, "v 2"]) -> PointCells:
    """Sort points into cells; those of the last few sets of points are kept.

    Parameters
    ----------
    points_xy_m
        At least one point [m], shape (v, 2).

    Returns
    -------
    The cells.
    """
    return _cells_of(np.ascontiguousarray(points_xy_m, dtype=np.float64).tobytes())


@lru_cache(maxsize=16)
def _cells_of(points: bytes) -> PointCells:
    """`cells_of` of an array's bytes."""
    xy = np.frombuffer(points, dtype=np.float64).reshape(-1, 2)
    order, lower, per_m, rows, within = _sorted_into_cells(xy)
    x, y = xy[order].T
    return PointCells(
        order=read_only(order),
        x_m=read_only(x.copy()),
        y_m=read_only(y.copy()),
        near_x_m=read_only(x.astype(np.float32)),
        near_y_m=read_only(y.astype(np.float32)),
        lower_m=read_only(lower),
        per_m=per_m,
        rows=read_only(rows),
        within=read_only(within),
        reach_m=float(np.abs(xy).max()),
    )


@njit(error_model="numpy")
def _sorted_into_cells(
    points: Float[np.ndarray, "v 2"],
) -> tuple[
    Int[np.ndarray, " v"],
    Float[np.ndarray, " 2"],
    float,
    Int[np.ndarray, "cells more"],
    Int[np.ndarray, "more more"],
]:
    """Fields order, lower_m, per_m, rows and within of `PointCells`."""
    lower, upper = points[0].copy(), points[0].copy()
    for i in range(len(points)):
        for axis in range(2):
            lower[axis] = min(lower[axis], points[i, axis])
            upper[axis] = max(upper[axis], points[i, axis])
    side = max(upper[0] - lower[0], upper[1] - lower[1])
    per_m = CELLS / side if side > 0.0 else 1.0
    cell = np.empty((len(points), 2), dtype=np.int64)
    number = np.zeros((CELLS, CELLS), dtype=np.int32)
    for i in range(len(points)):
        for axis in range(2):
            cell[i, axis] = min(CELLS - 1, int((points[i, axis] - lower[axis]) * per_m))
        number[cell[i, 1], cell[i, 0]] += 1
    rows = np.empty((CELLS, CELLS + 1), dtype=np.int32)
    within = np.zeros((CELLS + 1, CELLS + 1), dtype=np.int32)
    start = 0
    for y in range(CELLS):
        in_row = 0
        for x in range(CELLS):
            rows[y, x] = start + in_row
            in_row += number[y, x]
            within[y + 1, x + 1] = within[y, x + 1] + in_row
        start += in_row
        rows[y, CELLS] = start
    filled = rows.copy()
    order = np.empty(len(points), dtype=np.int64)
    for i in range(len(points)):
        order[filled[cell[i, 1], cell[i, 0]]] = i
        filled[cell[i, 1], cell[i, 0]] += 1
    return order, lower, per_m, rows, within
