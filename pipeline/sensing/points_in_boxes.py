"""The measured points of a depth picture that lie in boxes around contacts, cell by cell, compiled.

Each box is looked for among the pixels that its corners project between, and there among tiles
whose depths may meet it.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.compiled_code import njit

_TILE = 8  # pixels a side: of tiles beside the box no pixel is looked at
_ROUNDING_M = 1e-9  # far more than rounding moves a point, far less than a cell


class _Row(NamedTuple):
    """Points of neighbouring pixels of a row, in a contact's axes, and their cells."""

    x: Float[np.ndarray, " w"]
    y: Float[np.ndarray, " w"]
    z: Float[np.ndarray, " w"]
    cell: Int[np.ndarray, " w"]


@njit()
def tile_depths(
    depth: Float[np.ndarray, "h w"], windows: Int[np.ndarray, "b 4"]
) -> tuple[Float[np.ndarray, "th tw"], Float[np.ndarray, "th tw"]]:
    """Least and greatest measured depth of each tile that a window touches: inf and 0 of none."""
    height, width = depth.shape
    down, across = -(-height // _TILE), -(-width // _TILE)
    least = np.full((down, across), np.inf)
    greatest = np.zeros((down, across))
    left, right, top, bottom = width, -1, height, -1
    for b in range(len(windows)):
        left, right = min(left, windows[b, 0]), max(right, windows[b, 1])
        top, bottom = min(top, windows[b, 2]), max(bottom, windows[b, 3])
    for row in range(max(top, 0) // _TILE * _TILE, min((bottom // _TILE + 1) * _TILE, height)):
        for column in range(
            max(left, 0) // _TILE * _TILE, min((right // _TILE + 1) * _TILE, width)
        ):
            z = depth[row, column]
            if z > 0.0:
                i, j = row // _TILE, column // _TILE
                least[i, j] = min(least[i, j], z)
                greatest[i, j] = max(greatest[i, j], z)
    return least, greatest


@njit()
def collect_points(
    depth: Float[np.ndarray, "h w"],
    least: Float[np.ndarray, "th tw"],
    greatest: Float[np.ndarray, "th tw"],
    x: Float[np.ndarray, " w"],
    y: Float[np.ndarray, " h"],
    camera_from_contact: Float[np.ndarray, "b 4 4"],
    windows: Int[np.ndarray, "b 4"],
    box: tuple[float, float, float],
    cells: int,
    tops: Float[np.ndarray, "block g2"],
    points: Float[np.ndarray, "most 4"],
    cell_of: Int[np.ndarray, " most"],
) -> Int[np.ndarray, " ends"]:
    """Find the points of one depth image in each box, row by row of its pixels, and their cells.

    Raises each cell's top to its highest point. Returns where each box's points begin, and where
    the last one's end.
    """
    count = len(camera_from_contact)
    scale = cells / (2.0 * box[0])
    first = np.zeros(count + 1, dtype=np.int64)
    inside = np.zeros(least.shape[1], dtype=np.bool_)
    lows, highs = np.empty((3, least.shape[1])), np.empty((3, least.shape[1]))
    begins = np.empty(least.shape[1], dtype=np.int64)
    ends = np.empty(least.shape[1], dtype=np.int64)
    width = depth.shape[1]
    here = _Row(np.empty(width), np.empty(width), np.empty(width), np.empty(width, np.int32))
    at = 0
    for b in range(count):
        pose = camera_from_contact[b]
        highest = tops[b]
        left, right, top, bottom = windows[b]
        first[b + 1] = at
        if left > right or top > bottom:
            continue
        origin = _origin(pose)
        first_tile, last_tile = left // _TILE, right // _TILE
        for tile in range(first_tile, last_tile + 1):
            x_0, x_1 = x[max(left, tile * _TILE)], x[min(right, tile * _TILE + _TILE - 1)]
            for axis in range(3):
                u = pose[0, axis]
                lows[axis, tile], highs[axis, tile] = min(u * x_0, u * x_1), max(u * x_0, u * x_1)
        for tile_row in range(top // _TILE, bottom // _TILE + 1):
            rows = (max(top, tile_row * _TILE), min(bottom, tile_row * _TILE + _TILE - 1))
            tiles = slice(first_tile, last_tile + 1)
            _may_meet(
                least[tile_row, tiles],
                greatest[tile_row, tiles],
                lows,
                highs,
                first_tile,
                y[rows[0]],
                y[rows[1]],
                pose,
                origin,
                box,
                inside[tiles],
            )
            runs = _runs(inside, left, right, begins, ends)
            for row in range(rows[0], rows[1] + 1):
                down = _of_row(y[row], pose)
                for run in range(runs):
                    columns = slice(begins[run], ends[run])
                    _place(
                        depth[row, columns], x[columns], pose, down, origin, box, scale, cells, here
                    )
                    # Every pixel is written, and the next over it where it lies in no cell:
                    # branches that none can foresee cost more.
                    for i in range(ends[run] - begins[run]):
                        cell = here.cell[i]
                        highest[cell] = max(highest[cell], here.z[i])
                        points[at, 0] = here.x[i]
                        points[at, 1] = here.y[i]
                        points[at, 2] = here.z[i]
                        points[at, 3] = 1.0
                        cell_of[at] = cell
                        at += cell < cells * cells
        first[b + 1] = at
    return first


@njit()
def _may_meet(
    near: Float[np.ndarray, " tiles"],
    far: Float[np.ndarray, " tiles"],
    lows: Float[np.ndarray, "3 tw"],
    highs: Float[np.ndarray, "3 tw"],
    first: int,
    y_0: float,
    y_1: float,
    pose: Float[np.ndarray, "4 4"],
    origin: tuple[float, float, float],
    box: tuple[float, float, float],
    inside: Bool[np.ndarray, " tiles"],
) -> None:
    """Whether any point of each tile of a row, between two slopes y, may lie in the box.

    Each axis by itself: a point is z (u, v, 1) turned, linear in u and v for each z. `lows` and
    `highs` are the least and greatest of the term in u.
    """
    half, depth, height = box
    for tile in range(len(inside)):
        inside[tile] = near[tile] <= far[tile]
    for axis in range(3):
        least = (-depth if axis == 2 else -half) - _ROUNDING_M + origin[axis]
        greatest = (height if axis == 2 else half) + _ROUNDING_M + origin[axis]
        v, w = pose[1, axis], pose[2, axis]
        low, high = min(v * y_0, v * y_1) + w, max(v * y_0, v * y_1) + w
        of_axis, to_axis = lows[axis, first:], highs[axis, first:]
        for tile in range(len(inside)):
            from_ = of_axis[tile] + low
            to = to_axis[tile] + high
            reaches = max(to * near[tile], to * far[tile]) >= least
            begins = min(from_ * near[tile], from_ * far[tile]) <= greatest
            inside[tile] = inside[tile] & reaches & begins


@njit()
def add_points(
    points: Float[np.ndarray, "most 4"],
    cell_of: Int[np.ndarray, " most"],
    first: Int[np.ndarray, " ends"],
    layer: float,
    tops: Float[np.ndarray, "block g2"],
    sums: Float[np.ndarray, "block g2 4"],
) -> None:
    """Add the points near the top of their cell, and their number, to the cell's sums."""
    for b in range(len(first) - 1):
        highest = tops[b]
        of_cell = sums[b]
        for at in range(first[b], first[b + 1]):
            cell = cell_of[at]
            # A point too low is added as zeros: a branch that none can foresee costs more.
            near = 1.0 if points[at, 2] >= highest[cell] - layer else 0.0
            for c in range(4):
                of_cell[cell, c] += near * points[at, c]


@njit()
def windows_of(
    shape: tuple[int, int],
    intrinsics: Float[np.ndarray, "3 3"],
    camera_from_contact: Float[np.ndarray, "b 4 4"],
    box: tuple[float, float, float],
) -> Int[np.ndarray, "b 4"]:
    """First and last column, first and last row that each box's eight corners project between."""
    half, depth, height = box
    windows = np.empty((len(camera_from_contact), 4), dtype=np.int64)
    for b in range(len(camera_from_contact)):
        pose = camera_from_contact[b]
        for axis in range(2):
            focal, middle, size = intrinsics[axis, axis], intrinsics[axis, 2], shape[1 - axis]
            least, greatest = np.inf, -np.inf
            behind = False
            for x in (-half, half):
                for y in (-half, half):
                    for z in (-depth, height):
                        away = pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z + pose[2, 3]
                        aside = pose[axis, 0] * x + pose[axis, 1] * y + pose[axis, 2] * z
                        behind |= away <= 0.0
                        if away > 0.0:
                            pixel = focal * (aside + pose[axis, 3]) / away + middle
                            least, greatest = min(least, pixel), max(greatest, pixel)
            if behind:  # a corner behind the camera: anywhere in the picture
                least, greatest = 0.0, size - 1.0
            windows[b, 2 * axis] = int(np.floor(min(max(least, 0.0), float(size))))
            windows[b, 2 * axis + 1] = int(np.floor(min(max(greatest, -1.0), size - 1.0)))
    return windows


# A pixel's point in CCS is z (u, v, 1), with u the slope of its column and v of its row. In the
# contact's axes, R^T (z (u, v, 1) - t), only the term in u changes along a row.


@njit()
def _origin(pose: Float[np.ndarray, "4 4"]) -> tuple[float, float, float]:
    """R^T t."""
    x, y, z = pose[0, 3], pose[1, 3], pose[2, 3]
    return (
        pose[0, 0] * x + pose[1, 0] * y + pose[2, 0] * z,
        pose[0, 1] * x + pose[1, 1] * y + pose[2, 1] * z,
        pose[0, 2] * x + pose[1, 2] * y + pose[2, 2] * z,
    )


@njit()
def _of_row(v: float, pose: Float[np.ndarray, "4 4"]) -> tuple[float, float, float]:
    """R^T (0, v, 1) of a row."""
    return (
        pose[1, 0] * v + pose[2, 0],
        pose[1, 1] * v + pose[2, 1],
        pose[1, 2] * v + pose[2, 2],
    )


@njit()
def _place(
    depth: Float[np.ndarray, " k"],
    u: Float[np.ndarray, " k"],
    pose: Float[np.ndarray, "4 4"],
    down: tuple[float, float, float],
    origin: tuple[float, float, float],
    box: tuple[float, float, float],
    scale: float,
    cells: int,
    here: _Row,
) -> None:
    """Points of neighbouring pixels from the contact, in its axes, and their cells.

    The cell of a point in none is one more than there are. Without a branch, so that the loop runs
    in SIMD lanes.
    """
    half, reach, height = box
    a_0, a_1, a_2 = pose[0, 0], pose[0, 1], pose[0, 2]
    d_0, d_1, d_2 = down
    o_0, o_1, o_2 = origin
    last, none = np.int32(cells - 1), np.int32(cells * cells)
    x_of, y_of, z_of, cell_of = here.x, here.y, here.z, here.cell
    for i in range(len(depth)):
        far = depth[i]
        x = far * (a_0 * u[i] + d_0) - o_0
        y = far * (a_1 * u[i] + d_1) - o_1
        z = far * (a_2 * u[i] + d_2) - o_2
        x_of[i] = x
        y_of[i] = y
        z_of[i] = z
        within = (far > 0.0) & (z >= -reach) & (z <= height) & (abs(x) < half) & (abs(y) < half)
        # Rounding may carry a point just inside the border over it.
        row = min(np.int32((y + half) * scale), last)
        column = min(np.int32((x + half) * scale), last)
        cell_of[i] = np.int32(row * np.int32(cells) + column) if within else none


@njit()
def _runs(
    inside: Bool[np.ndarray, " tw"],
    left: int,
    right: int,
    begins: Int[np.ndarray, " tw"],
    ends: Int[np.ndarray, " tw"],
) -> int:
    """Columns from left to right that lie in tiles inside, as runs of neighbours; how many runs."""
    count = 0
    for tile in range(left // _TILE, right // _TILE + 1):
        if not inside[tile]:
            continue
        begin, end = max(left, tile * _TILE), min(right, tile * _TILE + _TILE - 1) + 1
        if count > 0 and ends[count - 1] == begin:
            ends[count - 1] = end
        else:
            begins[count], ends[count] = begin, end
            count += 1
    return count


@njit()
def write_means(
    sums: Float[np.ndarray, "block g2 4"],
    radius: float,
    chosen: Int[np.ndarray, " b"],
    cloud: Float[np.ndarray, "n g g 3"],
    seen: Bool[np.ndarray, "n g g"],
) -> None:
    """Mean point of each cell in units of r_G, of a block of contacts, in their places."""
    cells = seen.shape[1]
    for b in range(len(chosen)):
        n = chosen[b]
        for i in range(cells):
            for j in range(cells):
                of_cell = sums[b, i * cells + j]
                seen[n, i, j] = of_cell[3] > 0.0
                for axis in range(3):
                    mean = of_cell[axis] / of_cell[3] / radius if of_cell[3] > 0.0 else 0.0
                    cloud[n, i, j, axis] = mean
