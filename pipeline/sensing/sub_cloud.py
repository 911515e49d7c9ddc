"""Transform and Desample (S-1.14, S-1.15): a depth image → an organised grid around a contact.

The grid is a square in the contact's xy-plane; y grows with the row, x with the column. A
cell holds what the pad would meet in it first: the mean of the measured points over it that
are within ``layer_m`` of the highest, and nothing where none was measured. At an edge the
mean's x and y so tell how much of the cell the upper surface covers, which a mean of both
surfaces would not.

Points more than ``grid_depth_m`` below the contact are left out: the pad cannot reach them
(H = 30 mm). Upwards the grid is as high as the way on which the label looks for obstacles.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.config.grasps import SensingConfig
from pipeline.geometry.transforms import invert
from pipeline.sensing.points_in_boxes import (
    add_points,
    collect_points,
    tile_depths,
    windows_of,
    write_means,
)
from pipeline.world.cameras import PinholeCamera, pixel_slopes

_BLOCK = 16  # clouds whose points are held at a time: they stay in the cache


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
    cloud = np.empty((count, cells, cells, 3), dtype=np.float32)
    seen = np.empty((count, cells, cells), dtype=np.bool_)
    cut_into(pictures, world_from_contact, config, radius_m, np.arange(count), cloud, seen)
    return cloud, seen


def cut_into(
    pictures: Sequence[tuple[Float[np.ndarray, "_ _"], PinholeCamera]],
    world_from_contact: Float[np.ndarray, "n 4 4"],
    config: SensingConfig,
    radius_m: float,
    chosen: Int[np.ndarray, " b"],
    cloud: Float[np.ndarray, "n g g 3"],
    seen: Bool[np.ndarray, "n g g"],
) -> None:
    """`merged_sub_clouds` of some of many contacts, written in their places.

    Parameters
    ----------
    pictures
        Depth [m], 0 where nothing was measured, and camera of each picture.
    world_from_contact
        Frame of each contact, shape (n, 4, 4).
    config
        Size of the grid.
    radius_m
        r_G [m].
    chosen
        The contacts whose clouds are cut, shape (b,).
    cloud
        The clouds are written here, in single precision, shape (n, g, g, 3).
    seen
        The cells that hold a point are written here, shape (n, g, g).
    """
    cells = config.grid_cells
    box = (config.grid_side_m / 2, config.grid_depth_m, config.grid_height_m)
    seen_by = []
    for depth_m, camera in pictures:
        pose = np.ascontiguousarray(invert(camera.world_from_camera) @ world_from_contact[chosen])
        depth = np.ascontiguousarray(depth_m, dtype=np.float64)
        windows = windows_of(depth.shape, camera.intrinsics, pose, box)
        slopes = pixel_slopes(camera.intrinsics, depth.shape)
        most = _most_pixels(windows)
        room = (np.empty((most + 1, 4)), np.empty(most + 1, dtype=np.int32))
        seen_by.append(((depth, *tile_depths(depth, windows), *slopes), pose, windows, room))
    # A cell more than there are takes what lies in none.
    tops = np.empty((_BLOCK, cells * cells + 1))
    sums = np.empty((_BLOCK, cells * cells, 4))
    for start in range(0, len(chosen), _BLOCK):
        rows = slice(start, start + _BLOCK)
        tops.fill(-np.inf)
        sums.fill(0.0)
        ends = [
            collect_points(*picture, pose[rows], windows[rows], box, cells, tops, *room)
            for picture, pose, windows, room in seen_by
        ]
        for (*_, room), end in zip(seen_by, ends, strict=True):
            add_points(*room, end, config.layer_m, tops, sums)
        write_means(sums, radius_m, chosen[rows], cloud, seen)


def _most_pixels(windows: Int[np.ndarray, "b 4"]) -> int:
    """The most pixels that the windows of a block hold together."""
    left, right, top, bottom = windows.T
    pixels = np.maximum(right - left + 1, 0) * np.maximum(bottom - top + 1, 0)
    blocks = np.add.reduceat(pixels, np.arange(0, len(pixels), _BLOCK)) if len(pixels) else [0]
    return int(max(blocks))
