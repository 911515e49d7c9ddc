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

from pipeline.compiled_code import njit, unsigned
from pipeline.world.point_cells import CELLS
from pipeline.world.triangle_blocks import LANES

# Rounding of bounds in single precision, sixteen operations, as a share of the lengths.
SINGLE = 1e-6
# Rounding of a point's place among cells, as a share of a cell.
_CELL = 1e-4
# Weight of each lane in a sum that names a set of lanes; exact in single precision.
_LANE_BIT = (2.0 ** np.arange(LANES)).astype(np.float32)
# Lane of a power of two by its rest modulo 19, which differs for each power below 2^18.
_LANE_OF = np.zeros(19, dtype=np.int64)
_LANE_OF[[(1 << lane) % 19 for lane in range(LANES)]] = np.arange(LANES)


# Sums in any order and fused products are safe in bounds: they have room.
@njit(error_model="numpy", fastmath={"contract", "reassoc", "nsz", "nnan"})
def bound_triangles(
    corners: Float[np.ndarray, " 144"],
    turn: Float[np.ndarray, " 12"],
    reach: np.float32,
    slack: np.float32,
    edges: Float[np.ndarray, " 160"],
    sides: Float[np.ndarray, " 80"],
) -> None:
    """Bounds on what a block's triangles may cover, all in single precision.

    Row by row ``edges`` has x, y and 1's factors of three lines, below zero where a point is
    outside for certain, and a bound above the highest corner. ``sides`` has the lowest and highest
    x, the lowest and highest y, and the highest z of each triangle. Corners are known to within
    ``slack``, which moves a line by no more than twelve times that times the triangle's sides: for
    three if both ends move, and for as much again as twice the area may have if its sign is wrong.
    """
    ux, uy, uz, tx = turn[0], turn[1], turn[2], turn[3]
    vx, vy, vz, ty = turn[4], turn[5], turn[6], turn[7]
    wx, wy, wz, tz = turn[8], turn[9], turn[10], turn[11]
    one, single, twelve = np.float32(1.0), np.float32(SINGLE), np.float32(12.0)
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
        left, right = min(min(a_x, b_x), c_x), max(max(a_x, b_x), c_x)
        low, high = min(min(a_y, b_y), c_y), max(max(a_y, b_y), c_y)
        top = max(max(a_z, b_z), c_z) + slack
        sides[k], sides[LANES + k] = left, right
        sides[2 * LANES + k], sides[3 * LANES + k] = low, high
        sides[4 * LANES + k], edges[9 * LANES + k] = top, top
        apart = twelve * slack * (right - left + high - low + slack)
        # The sign of twice the area turns all lines inwards.
        area = (b_x - a_x) * (c_y - a_y) - (b_y - a_y) * (c_x - a_x)
        sign = one if area >= np.float32(0.0) else -one
        n_x, n_y = sign * (b_y - c_y), sign * (c_x - b_x)
        room = single * (abs(n_x) * (abs(b_x) + reach) + abs(n_y) * (abs(b_y) + reach)) + apart
        edges[k], edges[LANES + k] = n_x, n_y
        edges[2 * LANES + k] = room - (n_x * b_x + n_y * b_y)
        n_x, n_y = sign * (c_y - a_y), sign * (a_x - c_x)
        room = single * (abs(n_x) * (abs(c_x) + reach) + abs(n_y) * (abs(c_y) + reach)) + apart
        edges[3 * LANES + k], edges[4 * LANES + k] = n_x, n_y
        edges[5 * LANES + k] = room - (n_x * c_x + n_y * c_y)
        n_x, n_y = sign * (a_y - b_y), sign * (b_x - a_x)
        room = single * (abs(n_x) * (abs(a_x) + reach) + abs(n_y) * (abs(a_y) + reach)) + apart
        edges[6 * LANES + k], edges[7 * LANES + k] = n_x, n_y
        edges[8 * LANES + k] = room - (n_x * a_x + n_y * a_y)


@njit(error_model="numpy")
def place_triangles(
    corners: Float[np.ndarray, " 144"],
    turn: Float[np.ndarray, "3 4"],
    seen: Float[np.ndarray, " 144"],
) -> None:
    """Corners of a block's triangles in the frame, in double precision."""
    ux, uy, uz, tx = turn[0, 0], turn[0, 1], turn[0, 2], turn[0, 3]
    vx, vy, vz, ty = turn[1, 0], turn[1, 1], turn[1, 2], turn[1, 3]
    wx, wy, wz, tz = turn[2, 0], turn[2, 1], turn[2, 2], turn[2, 3]
    for k in range(LANES):
        x, y, z = corners[k], corners[LANES + k], corners[2 * LANES + k]
        seen[k] = ux * x + uy * y + uz * z + tx
        seen[LANES + k] = vx * x + vy * y + vz * z + ty
        seen[2 * LANES + k] = wx * x + wy * y + wz * z + tz
        x, y, z = corners[3 * LANES + k], corners[4 * LANES + k], corners[5 * LANES + k]
        seen[3 * LANES + k] = ux * x + uy * y + uz * z + tx
        seen[4 * LANES + k] = vx * x + vy * y + vz * z + ty
        seen[5 * LANES + k] = wx * x + wy * y + wz * z + tz
        x, y, z = corners[6 * LANES + k], corners[7 * LANES + k], corners[8 * LANES + k]
        seen[6 * LANES + k] = ux * x + uy * y + uz * z + tx
        seen[7 * LANES + k] = vx * x + vy * y + vz * z + ty
        seen[8 * LANES + k] = wx * x + wy * y + wz * z + tz


@njit(error_model="numpy", fastmath={"reassoc", "nsz", "nnan"})
def around_block(
    sides: Float[np.ndarray, " 80"], slack: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Left, right, low, high and top of a rectangle around all triangles of a block [m]."""
    left, right, low, high = sides[0], sides[LANES], sides[2 * LANES], sides[3 * LANES]
    top = sides[4 * LANES]
    for k in range(LANES):
        left, right = min(left, sides[k]), max(right, sides[LANES + k])
        low, high = min(low, sides[2 * LANES + k]), max(high, sides[3 * LANES + k])
        top = max(top, sides[4 * LANES + k])
    return left - slack, right + slack, low - slack, high + slack, top


@njit(error_model="numpy")
def points_within(
    around: tuple[np.float32, np.float32, np.float32, np.float32, np.float32],
    lower: Float[np.ndarray, " 2"],
    per_m: float,
    rows: Int[np.ndarray, "cells more"],
    x: Float[np.ndarray, " v"],
    y: Float[np.ndarray, " v"],
    so_far: Float[np.ndarray, " v"],
    point_at: Int[np.ndarray, " more"],
) -> int:
    """Points in a rectangle that have nothing higher than its top yet; returns how many."""
    left, right, low, high, top = around
    # A cell more than the rectangle touches costs little, a cell too few would lose points.
    first = np.int64(min(max((left - lower[0]) * per_m - _CELL, 0.0), float(CELLS)))
    last = np.int64(max(min((right - lower[0]) * per_m + _CELL, CELLS - 1.0), -1.0) + 1.0)
    bottom = np.int64(min(max((low - lower[1]) * per_m - _CELL, 0.0), float(CELLS)))
    end = np.int64(max(min((high - lower[1]) * per_m + _CELL, CELLS - 1.0), -1.0) + 1.0)
    count = 0
    if first >= last:
        return 0
    for line in range(bottom, end):
        for point in range(
            rows[unsigned(line), unsigned(first)], rows[unsigned(line), unsigned(last)]
        ):
            i = unsigned(point)
            point_at[unsigned(count)] = point
            count += (
                (x[i] >= left)
                & (x[i] <= right)
                & (y[i] >= low)
                & (y[i] <= high)
                & (so_far[i] <= top)
            )
    return count


@njit(error_model="numpy")
def near_points(
    edges: Float[np.ndarray, " 160"],
    x: Float[np.ndarray, " v"],
    y: Float[np.ndarray, " v"],
    so_far: Float[np.ndarray, " v"],
    point_at: Int[np.ndarray, " more"],
    points: int,
    found_lanes: Int[np.ndarray, " more"],
) -> int:
    """Which of some points a triangle may cover, moved to the front, and which may; returns how
    many."""
    found = 0
    for number in range(points):
        point = point_at[unsigned(number)]
        i = unsigned(point)
        lanes = _may_cover(edges, x[i], y[i], so_far[i])
        point_at[unsigned(found)], found_lanes[unsigned(found)] = point, lanes
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
        lanes = found_lanes[unsigned(number)]
        while lanes != 0:
            bit = lanes & (np.uint32(0) - lanes)
            lanes ^= bit
            pair_at[unsigned(pairs)] = found_at[unsigned(number)]
            pair_lane[unsigned(pairs)] = _LANE_OF[unsigned(bit % np.uint32(19))]
            pairs += 1
    return pairs


@njit(error_model="numpy")
def draw_pairs(
    seen: Float[np.ndarray, " 144"],
    order: Int[np.ndarray, " v"],
    x: Float[np.ndarray, " v"],
    y: Float[np.ndarray, " v"],
    pair_at: Int[np.ndarray, " pairs"],
    pair_lane: Int[np.ndarray, " pairs"],
    pairs: int,
    top: float,
    number: int,
    height: Float[np.ndarray, " v"],
    body: Int[np.ndarray, " v"],
    so_far: Float[np.ndarray, " v"],
) -> None:
    """Height and body at each pair's point, where its triangle covers it below top and above what
    is there.

    One pair after the other: in SIMD lanes its eleven look-ups would be gathered, which takes
    longer than all of its arithmetic.
    """
    for pair in range(pairs):
        i, k = unsigned(pair_at[unsigned(pair)]), unsigned(pair_lane[unsigned(pair)])
        a_x, a_y = seen[k] - x[i], seen[LANES + k] - y[i]
        b_x, b_y = seen[3 * LANES + k] - x[i], seen[4 * LANES + k] - y[i]
        c_x, c_y = seen[6 * LANES + k] - x[i], seen[7 * LANES + k] - y[i]
        a_z, b_z, c_z = seen[2 * LANES + k], seen[5 * LANES + k], seen[8 * LANES + k]
        of_a, of_b, of_c = b_x * c_y - b_y * c_x, c_x * a_y - c_y * a_x, a_x * b_y - a_y * b_x
        whole = of_a + of_b + of_c
        z = (of_a * a_z + of_b * b_z + of_c * c_z) / whole
        z = min(max(z, min(min(a_z, b_z), c_z)), max(max(a_z, b_z), c_z))
        inside = (min(min(of_a, of_b), of_c) >= 0.0) | (max(max(of_a, of_b), of_c) <= 0.0)
        point = unsigned(order[i])
        if inside & (whole != 0.0) & (z <= top) & (z > height[point]):
            height[point], so_far[i] = z, np.float32(z)
            body[point] = number
