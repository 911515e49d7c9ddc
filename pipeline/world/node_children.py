"""The children of a node of triangle blocks: where their boxes lie under the points, and in which
order they are walked.

Arrays of lanes are flat: sixteen numbers for the sixteen children, then sixteen of the next kind.
"""

import numpy as np
from jaxtyping import Float, Int

from pipeline.compiled_code import njit, unsigned
from pipeline.world.point_cells import CELLS
from pipeline.world.triangle_blocks import LANES


@njit(error_model="numpy")
def place_children(
    boxes: Float[np.ndarray, " 96"],
    turn: Float[np.ndarray, "3 4"],
    centre: Float[np.ndarray, " 3"],
    slack_m: float,
    lower: Float[np.ndarray, " 2"],
    per_m: float,
    cells: Int[np.ndarray, " 64"],
    low_high: Float[np.ndarray, " 32"],
) -> None:
    """Rectangle of cells and range of z around each child's box in the frame."""
    slack, slack_cells = np.float32(slack_m), np.float32(slack_m * per_m)
    ax, ay, az = (
        np.float32(turn[0, 0] * per_m),
        np.float32(turn[0, 1] * per_m),
        np.float32(turn[0, 2] * per_m),
    )
    bx, by, bz = (
        np.float32(turn[1, 0] * per_m),
        np.float32(turn[1, 1] * per_m),
        np.float32(turn[1, 2] * per_m),
    )
    cx, cy, cz = np.float32(turn[2, 0]), np.float32(turn[2, 1]), np.float32(turn[2, 2])
    from_x = np.float32(
        (
            turn[0, 0] * centre[0]
            + turn[0, 1] * centre[1]
            + turn[0, 2] * centre[2]
            + turn[0, 3]
            - lower[0]
        )
        * per_m
    )
    from_y = np.float32(
        (
            turn[1, 0] * centre[0]
            + turn[1, 1] * centre[1]
            + turn[1, 2] * centre[2]
            + turn[1, 3]
            - lower[1]
        )
        * per_m
    )
    from_z = np.float32(
        turn[2, 0] * centre[0] + turn[2, 1] * centre[1] + turn[2, 2] * centre[2] + turn[2, 3]
    )
    nought, one = np.float32(0.0), np.float32(1.0)
    columns, last = np.float32(CELLS), np.float32(CELLS - 1)
    for k in range(LANES):
        x, hx = boxes[k], boxes[3 * LANES + k]
        y, hy = boxes[LANES + k], boxes[4 * LANES + k]
        z, hz = boxes[2 * LANES + k], boxes[5 * LANES + k]
        mx = ax * x + ay * y + az * z + from_x
        my = bx * x + by * y + bz * z + from_y
        mz = cx * x + cy * y + cz * z + from_z
        ex = abs(ax) * hx + abs(ay) * hy + abs(az) * hz + slack_cells
        ey = abs(bx) * hx + abs(by) * hy + abs(bz) * hz + slack_cells
        ez = abs(cx) * hx + abs(cy) * hy + abs(cz) * hz + slack
        low_high[k] = mz - ez
        low_high[LANES + k] = mz + ez
        cells[k] = np.int32(min(max(mx - ex, nought), columns))
        cells[LANES + k] = np.int32(max(min(mx + ex, last), -one) + one)
        cells[2 * LANES + k] = np.int32(min(max(my - ey, nought), columns))
        cells[3 * LANES + k] = np.int32(max(min(my + ey, last), -one) + one)


@njit(error_model="numpy")
def rank_by_top(
    top: float,
    within: Int[np.ndarray, "more more"],
    cells: Int[np.ndarray, " 64"],
    low_high: Float[np.ndarray, " 32"],
    children: int,
    keys: Int[np.ndarray, " 16"],
    rank: Int[np.ndarray, " 16"],
) -> int:
    """Write each child's place into ``rank``: the higher its highest z, the later its place.

    Children whose cells hold no point, or that lie wholly above ``top``, have places after all
    others. Returns how many the others are. Each child is compared with every other one, which SIMD
    lanes do sooner than one insertion after another.
    """
    bits = low_high.view(np.int32)
    kept = 0
    for k in range(LANES):
        # Whole numbers in the order of the heights; the lane in the last bits makes all differ.
        key = bits[LANES + k]
        key ^= (key >> np.int32(31)) & np.int32(0x7FFFFFFF)
        keys[k] = (key & np.int32(-LANES)) | np.int32(k)
        rank[k] = 0
    for k in range(LANES):
        if k < children and low_high[k] <= top and _points_in(within, cells, k) > 0:
            kept += 1
        else:
            keys[k] = np.int32(0x7FFFFFF0) | np.int32(k)
    for other in range(LANES):
        key = keys[other]
        for k in range(LANES):
            rank[k] += np.int32(key < keys[k])
    return kept


@njit(error_model="numpy")
def _points_in(within: Int[np.ndarray, "more more"], cells: Int[np.ndarray, " 64"], k: int) -> int:
    """Points in the rectangle of cells of lane k; 0 where the rectangle is empty."""
    left, right, low, high = (
        unsigned(cells[k]),
        unsigned(cells[LANES + k]),
        unsigned(cells[2 * LANES + k]),
        unsigned(cells[3 * LANES + k]),
    )
    if left >= right or low >= high:
        return 0
    return int(within[high, right] - within[low, right] - within[high, left] + within[low, left])
