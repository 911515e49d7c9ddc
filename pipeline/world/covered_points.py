"""Which points a block of sixteen triangles covers, and how high it is there.

All triangles of a block are compared with a point at once in single precision, by bounds that leave
none out. What may cover the point is decided in double precision by the signs of three products. On
the common edge of two triangles both find the same number with opposite signs, so no point falls
between neighbours: a point on an edge or a corner belongs to all triangles there. A triangle seen
exactly edge on covers nothing; its neighbours do.

Arrays of lanes are flat: sixteen numbers for the sixteen triangles, then sixteen of the next kind.
Of arrays with rows the compiler does not know that they lie apart, and uses no SIMD lanes.
"""

import numpy as np
from jaxtyping import Float, Int

from pipeline.compiled_code import njit
from pipeline.world.point_cells import CELLS
from pipeline.world.triangle_blocks import LANES

# Rounding of bounds in single precision, sixteen operations, as a share of the lengths.
SINGLE = 1e-6
# Rounding of a block's rectangle in double precision, in cells.
_DOUBLE = 1e-9
# Weight of each lane in a sum that names a set of lanes; exact in single precision.
_LANE_BIT = (2.0 ** np.arange(LANES)).astype(np.float32)
# Lane of a power of two by its rest modulo 19, which differs for each power below 2^18.
_LANE_OF = np.zeros(19, dtype=np.int64)
_LANE_OF[[(1 << lane) % 19 for lane in range(LANES)]] = np.arange(LANES)
# Indices are converted to unsigned numbers: numba otherwise tests each for Python's negative ones,
# which made this a third slower.
_at = np.uint64


@njit(error_model="numpy")
def place_triangles(
    corners: Float[np.ndarray, " 144"],
    turn: Float[np.ndarray, "3 4"],
    reach: float,
    seen: Float[np.ndarray, " 144"],
    edges: Float[np.ndarray, " 160"],
    rectangle: Float[np.ndarray, " 64"],
) -> None:
    """Corners of a block's triangles in the frame, and bounds on what each may cover.

    Row by row ``edges`` has x, y and 1's factors of three lines, below zero where a point is
    outside for certain, and a bound above the highest corner.
    """
    ux, uy, uz, tx = turn[0, 0], turn[0, 1], turn[0, 2], turn[0, 3]
    vx, vy, vz, ty = turn[1, 0], turn[1, 1], turn[1, 2], turn[1, 3]
    wx, wy, wz, tz = turn[2, 0], turn[2, 1], turn[2, 2], turn[2, 3]
    for k in range(LANES):
        x, y, z = corners[k], corners[LANES + k], corners[2 * LANES + k]
        a_x, a_y = ux * x + uy * y + uz * z + tx, vx * x + vy * y + vz * z + ty
        a_z = wx * x + wy * y + wz * z + tz
        x, y, z = corners[3 * LANES + k], corners[4 * LANES + k], corners[5 * LANES + k]
        b_x, b_y = ux * x + uy * y + uz * z + tx, vx * x + vy * y + vz * z + ty
        b_z = wx * x + wy * y + wz * z + tz
        x, y, z = corners[6 * LANES + k], corners[7 * LANES + k], corners[8 * LANES + k]
        c_x, c_y = ux * x + uy * y + uz * z + tx, vx * x + vy * y + vz * z + ty
        c_z = wx * x + wy * y + wz * z + tz
        seen[k], seen[LANES + k], seen[2 * LANES + k] = a_x, a_y, a_z
        seen[3 * LANES + k], seen[4 * LANES + k], seen[5 * LANES + k] = b_x, b_y, b_z
        seen[6 * LANES + k], seen[7 * LANES + k], seen[8 * LANES + k] = c_x, c_y, c_z
        rectangle[k], rectangle[LANES + k] = min(min(a_x, b_x), c_x), max(max(a_x, b_x), c_x)
        rectangle[2 * LANES + k], rectangle[3 * LANES + k] = (
            min(min(a_y, b_y), c_y),
            max(max(a_y, b_y), c_y),
        )
        highest = max(max(a_z, b_z), c_z)
        edges[9 * LANES + k] = np.float32(highest + SINGLE * abs(highest))
        # The sign of twice the area turns all lines inwards.
        area = (b_x - a_x) * (c_y - a_y) - (b_y - a_y) * (c_x - a_x)
        sign = 1.0 if area >= 0.0 else -1.0
        n_x, n_y = sign * (b_y - c_y), sign * (c_x - b_x)
        slack = SINGLE * (abs(n_x) * (abs(b_x) + reach) + abs(n_y) * (abs(b_y) + reach))
        edges[k], edges[LANES + k] = n_x, n_y
        edges[2 * LANES + k] = slack - (n_x * b_x + n_y * b_y)
        n_x, n_y = sign * (c_y - a_y), sign * (a_x - c_x)
        slack = SINGLE * (abs(n_x) * (abs(c_x) + reach) + abs(n_y) * (abs(c_y) + reach))
        edges[3 * LANES + k], edges[4 * LANES + k] = n_x, n_y
        edges[5 * LANES + k] = slack - (n_x * c_x + n_y * c_y)
        n_x, n_y = sign * (a_y - b_y), sign * (b_x - a_x)
        slack = SINGLE * (abs(n_x) * (abs(a_x) + reach) + abs(n_y) * (abs(a_y) + reach))
        edges[6 * LANES + k], edges[7 * LANES + k] = n_x, n_y
        edges[8 * LANES + k] = slack - (n_x * a_x + n_y * a_y)


@njit(error_model="numpy")
def around_block(
    rectangle: Float[np.ndarray, " 64"],
    edges: Float[np.ndarray, " 160"],
    count: int,
    lower: Float[np.ndarray, " 2"],
    per_m: float,
    cells: Int[np.ndarray, " 64"],
) -> None:
    """Cells around all triangles of a block, in lane 0; lanes without a triangle cover nothing."""
    left, right, low, high = (
        rectangle[0],
        rectangle[LANES],
        rectangle[2 * LANES],
        rectangle[3 * LANES],
    )
    for k in range(1, count):
        left, right = min(left, rectangle[k]), max(right, rectangle[LANES + k])
        low, high = min(low, rectangle[2 * LANES + k]), max(high, rectangle[3 * LANES + k])
    for k in range(count, LANES):
        edges[9 * LANES + k] = -np.inf
    left, right = (left - lower[0]) * per_m - _DOUBLE, (right - lower[0]) * per_m + _DOUBLE
    low, high = (low - lower[1]) * per_m - _DOUBLE, (high - lower[1]) * per_m + _DOUBLE
    cells[0] = np.int32(min(max(left, 0.0), float(CELLS)))
    cells[LANES] = np.int32(max(min(right, CELLS - 1.0), -1.0) + 1.0)
    cells[2 * LANES] = np.int32(min(max(low, 0.0), float(CELLS)))
    cells[3 * LANES] = np.int32(max(min(high, CELLS - 1.0), -1.0) + 1.0)


@njit(error_model="numpy")
def near_points(
    edges: Float[np.ndarray, " 160"],
    cells: Int[np.ndarray, " 64"],
    rows: Int[np.ndarray, "cells more"],
    x: Float[np.ndarray, " v"],
    y: Float[np.ndarray, " v"],
    so_far: Float[np.ndarray, " v"],
    found_at: Int[np.ndarray, " more"],
    found_lanes: Int[np.ndarray, " more"],
) -> int:
    """Points that a triangle may cover, and which may; returns how many."""
    found = 0
    left, right = _at(cells[0]), _at(cells[LANES])
    if left >= right:
        return 0
    for line in range(cells[2 * LANES], cells[3 * LANES]):
        for point in range(rows[_at(line), left], rows[_at(line), right]):
            i = _at(point)
            lanes = _may_cover(edges, x[i], y[i], so_far[i])
            found_at[_at(found)], found_lanes[_at(found)] = point, lanes
            found += lanes != 0
    return found


# Sums in any order and fused products are safe here: bounds have room, and lanes' bits are exact.
@njit(error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def _may_cover(edges: Float[np.ndarray, " 160"], x: float, y: float, height: float) -> np.uint32:
    """Lanes whose triangle may cover a point and may be higher there, one bit for each."""
    lanes, nought = np.float32(0.0), np.float32(0.0)
    for k in range(LANES):
        near = (
            (edges[k] * x + edges[LANES + k] * y + edges[2 * LANES + k] >= nought)
            & (edges[3 * LANES + k] * x + edges[4 * LANES + k] * y + edges[5 * LANES + k] >= nought)
            & (edges[6 * LANES + k] * x + edges[7 * LANES + k] * y + edges[8 * LANES + k] >= nought)
            & (edges[9 * LANES + k] >= height)
        )
        lanes += _LANE_BIT[k] if near else nought
    return np.uint32(np.int32(lanes))


@njit(error_model="numpy")
def pairs_of(
    found_at: Int[np.ndarray, " more"],
    found_lanes: Int[np.ndarray, " more"],
    found: int,
    pair_at: Int[np.ndarray, " pairs"],
    pair_lane: Int[np.ndarray, " pairs"],
) -> int:
    """Each point with each lane that may cover it; returns how many."""
    pairs = 0
    for number in range(found):
        lanes = found_lanes[_at(number)]
        while lanes != 0:
            bit = lanes & (np.uint32(0) - lanes)
            lanes ^= bit
            pair_at[_at(pairs)] = found_at[_at(number)]
            pair_lane[_at(pairs)] = _LANE_OF[_at(bit % np.uint32(19))]
            pairs += 1
    return pairs


@njit(error_model="numpy")
def heights_on(
    seen: Float[np.ndarray, " 144"],
    x: Float[np.ndarray, " v"],
    y: Float[np.ndarray, " v"],
    pair_at: Int[np.ndarray, " pairs"],
    pair_lane: Int[np.ndarray, " pairs"],
    pairs: int,
    top: float,
    pair_z: Float[np.ndarray, " pairs"],
) -> None:
    """Height of each pair's triangle at its point; -inf where it does not cover it below top."""
    for number in range(pairs):
        i, k = _at(pair_at[_at(number)]), _at(pair_lane[_at(number)])
        a_x, a_y = seen[k] - x[i], seen[LANES + k] - y[i]
        b_x, b_y = seen[3 * LANES + k] - x[i], seen[4 * LANES + k] - y[i]
        c_x, c_y = seen[6 * LANES + k] - x[i], seen[7 * LANES + k] - y[i]
        a_z, b_z, c_z = seen[2 * LANES + k], seen[5 * LANES + k], seen[8 * LANES + k]
        of_a, of_b, of_c = b_x * c_y - b_y * c_x, c_x * a_y - c_y * a_x, a_x * b_y - a_y * b_x
        whole = of_a + of_b + of_c
        z = (of_a * a_z + of_b * b_z + of_c * c_z) / whole
        z = min(max(z, min(min(a_z, b_z), c_z)), max(max(a_z, b_z), c_z))
        inside = (min(min(of_a, of_b), of_c) >= 0.0) | (max(max(of_a, of_b), of_c) <= 0.0)
        pair_z[_at(number)] = z if inside & (whole != 0.0) & (z <= top) else -np.inf
