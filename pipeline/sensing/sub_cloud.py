"""Transform and Desample (S-1.14, S-1.15): a depth image → an organised grid around a contact.

The grid is a square in the contact's xy-plane; y grows with the row, x with the column. A
cell holds what the pad would meet in it first: the mean of the measured points over it that
are within ``layer_m`` of the highest, and nothing where none was measured. At an edge the
mean's x and y so tell how much of the cell the upper surface covers, which a mean of both
surfaces would not.

Points more than ``grid_depth_m`` below the contact are left out: the pad cannot reach them
(H = 30 mm). Upwards the grid is as high as the way on which the label looks for obstacles.
"""

import itertools
from collections.abc import Sequence

import numba
import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.config.grasps import SensingConfig
from pipeline.geometry.transforms import invert
from pipeline.world.cameras import PinholeCamera, pixel_slopes, project_local

_TILE = 8  # pixels a side: of tiles beside the box no pixel is looked at
_BLOCK = 16  # clouds whose points are held at a time: they stay in the cache
_ROUNDING_M = 1e-9  # far more than rounding moves a point, far less than a cell


def sub_clouds(
    depth_m: Float[np.ndarray, "h w"],
    camera: PinholeCamera,
    world_from_contact: Float[np.ndarray, "b 4 4"],
    config: SensingConfig,
    radius_m: float,
) -> tuple[Float[np.ndarray, "b g g 3"], Bool[np.ndarray, "b g g"]]:
    """Cut the organised cloud around each contact out of one depth picture.

    Parameters
    ----------
    depth_m
        Depth along the camera's z [m], 0 where nothing was measured, shape (h, w).
    camera
        Where the picture was taken from.
    world_from_contact
        Frame of each contact, z out of the surface, shape (b, 4, 4).
    config
        Size of the grid.
    radius_m
        r_G [m].

    Returns
    -------
    Points in the contact's frame in units of r_G, shape (b, g, g, 3); and the cells that hold a
    measured point, shape (b, g, g).
    """
    return merged_sub_clouds([(depth_m, camera)], world_from_contact, config, radius_m)


def merged_sub_clouds(
    pictures: Sequence[tuple[Float[np.ndarray, "_ _"], PinholeCamera]],
    world_from_contact: Float[np.ndarray, "b 4 4"],
    config: SensingConfig,
    radius_m: float,
) -> tuple[Float[np.ndarray, "b g g 3"], Bool[np.ndarray, "b g g"]]:
    """Cut the organised clouds out of several depth pictures together (Supplement VI).

    Parameters
    ----------
    pictures
        Depth [m], 0 where nothing was measured, and camera of each picture.
    world_from_contact
        Frame of each contact, z out of the surface, shape (b, 4, 4).
    config
        Size of the grid.
    radius_m
        r_G [m].

    Returns
    -------
    As `sub_clouds`.
    """
    count, cells = len(world_from_contact), config.grid_cells
    box = (config.grid_side_m / 2, config.grid_depth_m, config.grid_height_m)
    seen_by = []
    for depth_m, camera in pictures:
        pose = np.ascontiguousarray(invert(camera.world_from_camera) @ world_from_contact)
        depth = np.ascontiguousarray(depth_m, dtype=np.float64)
        windows = _windows(depth.shape, camera.intrinsics, pose, box)
        slopes = pixel_slopes(camera.intrinsics, depth.shape)
        most = _most_pixels(windows)
        room = (np.empty((most, 3)), np.empty(most, dtype=np.int32))
        seen_by.append(((depth, *_tile_depths(depth, windows), *slopes), pose, windows, room))
    tops = np.full((count, cells, cells), -np.inf)
    sums = np.zeros((count, cells, cells, 4))
    for start in range(0, count, _BLOCK):
        rows = slice(start, start + _BLOCK)
        ends = [
            _collect(*picture, pose[rows], windows[rows], box, tops[rows], *room)
            for picture, pose, windows, room in seen_by
        ]
        for (*_, room), end in zip(seen_by, ends, strict=True):
            _add(*room, end, config.layer_m, tops[rows], sums[rows])
    cloud = np.zeros((count, cells, cells, 3), dtype=np.float32)
    seen = np.zeros((count, cells, cells), dtype=np.bool_)
    _means(sums, radius_m, cloud, seen)
    return cloud, seen


def _most_pixels(windows: Int[np.ndarray, "b 4"]) -> int:
    """The most pixels that the windows of a block hold together."""
    left, right, top, bottom = windows.T
    pixels = np.maximum(right - left + 1, 0) * np.maximum(bottom - top + 1, 0)
    blocks = np.add.reduceat(pixels, np.arange(0, len(pixels), _BLOCK)) if len(pixels) else [0]
    return int(max(blocks))


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _tile_depths(
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


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _collect(
    depth: Float[np.ndarray, "h w"],
    least: Float[np.ndarray, "th tw"],
    greatest: Float[np.ndarray, "th tw"],
    x: Float[np.ndarray, " w"],
    y: Float[np.ndarray, " h"],
    camera_from_contact: Float[np.ndarray, "b 4 4"],
    windows: Int[np.ndarray, "b 4"],
    box: tuple[float, float, float],
    tops: Float[np.ndarray, "b g g"],
    points: Float[np.ndarray, "most 3"],
    cell_of: Int[np.ndarray, " most"],
) -> Int[np.ndarray, " ends"]:
    """Find the points of one depth image in each box, row by row of its pixels, and their cells.

    Raises each cell's top to its highest point. Returns where each box's points begin, and where
    the last one's end.
    """
    cells = tops.shape[1]
    count = len(camera_from_contact)
    scale = cells / (2.0 * box[0])
    first = np.zeros(count + 1, dtype=np.int64)
    inside = np.zeros(least.shape[1], dtype=np.bool_)
    at = 0
    for b in range(count):
        pose = camera_from_contact[b]
        highest = tops[b].reshape(cells * cells)
        left, right, top, bottom = windows[b]
        origin = _origin(pose)
        for tile_row in range(top // _TILE, bottom // _TILE + 1):
            rows = (max(top, tile_row * _TILE), min(bottom, tile_row * _TILE + _TILE - 1))
            for tile in range(left // _TILE, right // _TILE + 1):
                columns = (max(left, tile * _TILE), min(right, tile * _TILE + _TILE - 1))
                near, far = least[tile_row, tile], greatest[tile_row, tile]
                inside[tile] = near <= far and _may_meet(
                    near,
                    far,
                    x[columns[0]],
                    x[columns[1]],
                    y[rows[0]],
                    y[rows[1]],
                    pose,
                    origin,
                    box,
                )
            for row in range(rows[0], rows[1] + 1):
                down = _of_row(y[row], pose)
                for tile in range(left // _TILE, right // _TILE + 1):
                    if not inside[tile]:
                        continue
                    for column in range(
                        max(left, tile * _TILE), min(right, tile * _TILE + _TILE - 1) + 1
                    ):
                        z = depth[row, column]
                        if z > 0.0:
                            point = _placed(z, x[column], pose, down, origin)
                            cell = _cell(point, box, scale, cells)
                            if cell < 0:
                                continue
                            if point[2] > highest[cell]:
                                highest[cell] = point[2]
                            points[at, 0], points[at, 1], points[at, 2] = point
                            cell_of[at] = cell
                            at += 1
        first[b + 1] = at
    return first


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _may_meet(
    near: float,
    far: float,
    x_0: float,
    x_1: float,
    y_0: float,
    y_1: float,
    pose: Float[np.ndarray, "4 4"],
    origin: tuple[float, float, float],
    box: tuple[float, float, float],
) -> bool:
    """Whether any point of pixels between these slopes and depths may lie in the box.

    Each axis by itself: a point is z (u, v, 1) turned, linear in u and v for each z.
    """
    half, depth, height = box
    lows, highs = (-half, -half, -depth), (half, half, height)
    for axis in range(3):
        u, v, w = pose[0, axis], pose[1, axis], pose[2, axis]
        low = min(u * x_0, u * x_1) + min(v * y_0, v * y_1) + w
        high = max(u * x_0, u * x_1) + max(v * y_0, v * y_1) + w
        if max(high * near, high * far) - origin[axis] < lows[axis] - _ROUNDING_M:
            return False
        if min(low * near, low * far) - origin[axis] > highs[axis] + _ROUNDING_M:
            return False
    return True


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _add(
    points: Float[np.ndarray, "most 3"],
    cell_of: Int[np.ndarray, " most"],
    first: Int[np.ndarray, " ends"],
    layer: float,
    tops: Float[np.ndarray, "b g g"],
    sums: Float[np.ndarray, "b g g 4"],
) -> None:
    """Add the points near the top of their cell, and their number, to the cell's sums."""
    cells = sums.shape[1]
    for b in range(len(sums)):
        highest = tops[b].reshape(cells * cells)
        of_cell = sums[b].reshape(cells * cells, 4)
        for at in range(first[b], first[b + 1]):
            cell = cell_of[at]
            if points[at, 2] >= highest[cell] - layer:
                of_cell[cell, 0] += points[at, 0]
                of_cell[cell, 1] += points[at, 1]
                of_cell[cell, 2] += points[at, 2]
                of_cell[cell, 3] += 1.0


def _windows(
    shape: tuple[int, int],
    intrinsics: Float[np.ndarray, "3 3"],
    camera_from_contact: Float[np.ndarray, "b 4 4"],
    box: tuple[float, float, float],
) -> Int[np.ndarray, "b 4"]:
    """First and last column, first and last row that each box's eight corners project between."""
    half, depth, height = box
    corners = np.array(list(itertools.product((-half, half), (-half, half), (-depth, height))))
    pixels = project_local(
        intrinsics,
        corners @ camera_from_contact[:, :3, :3].transpose(0, 2, 1)
        + camera_from_contact[:, None, :3, 3],
    )
    first, last = np.floor(pixels.min(axis=1)), np.floor(pixels.max(axis=1))
    behind = np.isnan(first)  # a corner behind the camera: anywhere in the picture
    size = np.array([shape[1], shape[0]])
    first = np.where(behind, 0.0, np.clip(first, 0, size))
    last = np.where(behind, size - 1.0, np.clip(last, -1, size - 1))
    return np.stack([first[:, 0], last[:, 0], first[:, 1], last[:, 1]], axis=1).astype(np.int64)


# A pixel's point in CCS is z (u, v, 1), with u the slope of its column and v of its row. In the
# contact's axes, R^T (z (u, v, 1) - t), only the term in u changes along a row.


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _origin(pose: Float[np.ndarray, "4 4"]) -> tuple[float, float, float]:
    """R^T t."""
    x, y, z = pose[0, 3], pose[1, 3], pose[2, 3]
    return (
        pose[0, 0] * x + pose[1, 0] * y + pose[2, 0] * z,
        pose[0, 1] * x + pose[1, 1] * y + pose[2, 1] * z,
        pose[0, 2] * x + pose[1, 2] * y + pose[2, 2] * z,
    )


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _of_row(v: float, pose: Float[np.ndarray, "4 4"]) -> tuple[float, float, float]:
    """R^T (0, v, 1) of a row."""
    return (
        pose[1, 0] * v + pose[2, 0],
        pose[1, 1] * v + pose[2, 1],
        pose[1, 2] * v + pose[2, 2],
    )


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _placed(
    z: float,
    u: float,
    pose: Float[np.ndarray, "4 4"],
    down: tuple[float, float, float],
    origin: tuple[float, float, float],
) -> tuple[float, float, float]:
    """A pixel's point from the contact, in the contact's axes."""
    return (
        z * (pose[0, 0] * u + down[0]) - origin[0],
        z * (pose[0, 1] * u + down[1]) - origin[1],
        z * (pose[0, 2] * u + down[2]) - origin[2],
    )


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _cell(
    point: tuple[float, float, float], box: tuple[float, float, float], scale: float, cells: int
) -> int:
    """Index of the cell a point lies in, row by row; -1 outside the box."""
    half, depth, height = box
    x, y, z = point
    if z < -depth or z > height or abs(x) >= half or abs(y) >= half:
        return -1
    # Rounding may carry a point just inside the border over it.
    row = min(int((y + half) * scale), cells - 1)
    return row * cells + min(int((x + half) * scale), cells - 1)


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _means(
    sums: Float[np.ndarray, "b g g 4"],
    radius: float,
    cloud: Float[np.ndarray, "b g g 3"],
    seen: Bool[np.ndarray, "b g g"],
) -> None:
    count, cells = sums.shape[:2]
    for b in range(count):
        for i in range(cells):
            for j in range(cells):
                if sums[b, i, j, 3] > 0.0:
                    seen[b, i, j] = True
                    for axis in range(3):
                        cloud[b, i, j, axis] = sums[b, i, j, axis] / sums[b, i, j, 3] / radius
