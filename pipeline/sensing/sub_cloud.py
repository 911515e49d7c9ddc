"""Transform and Desample (S-1.14, S-1.15): a depth image → an organised grid around a contact.

The grid is a square in the contact's xy-plane; y grows with the row, x with the column. A
cell holds the mean of the measured points over it, and nothing where none was measured.
Points farther than ``grid_depth_m`` from the contact along z are left out: the pad cannot
reach them (H = 30 mm) and they would only blur the cell's mean.
"""

from collections.abc import Sequence

import numba
import numpy as np
from jaxtyping import Bool, Float

from pipeline.config.grasps import SensingConfig
from pipeline.geometry.transforms import invert
from pipeline.sensing.cameras import PinholeCamera


def sub_clouds(
    depth_m: Float[np.ndarray, "h w"],
    camera: PinholeCamera,
    world_from_contact: Float[np.ndarray, "b 4 4"],
    config: SensingConfig,
    radius_m: float,
) -> tuple[Float[np.ndarray, "b g g 3"], Bool[np.ndarray, "b g g"]]:
    """Clouds in units of r_G (``radius_m``) and the cells that hold a measured point."""
    return merged_sub_clouds([(depth_m, camera)], world_from_contact, config, radius_m)


def merged_sub_clouds(
    pictures: Sequence[tuple[Float[np.ndarray, "h w"], PinholeCamera]],
    world_from_contact: Float[np.ndarray, "b 4 4"],
    config: SensingConfig,
    radius_m: float,
) -> tuple[Float[np.ndarray, "b g g 3"], Bool[np.ndarray, "b g g"]]:
    """The same from the points of several depth images together (Supplement VI)."""
    count, cells = len(world_from_contact), config.grid_cells
    sums = np.zeros((count, cells, cells, 4))
    for depth_m, camera in pictures:
        _add(
            np.ascontiguousarray(depth_m, dtype=np.float64),
            camera.intrinsics,
            np.ascontiguousarray(invert(camera.world_from_camera) @ world_from_contact),
            config.grid_side_m,
            config.grid_depth_m,
            sums,
        )
    cloud = np.zeros((count, cells, cells, 3), dtype=np.float32)
    seen = np.zeros((count, cells, cells), dtype=np.bool_)
    _means(sums, radius_m, cloud, seen)
    return cloud, seen


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _add(
    depth: Float[np.ndarray, "h w"],
    k: Float[np.ndarray, "3 3"],
    camera_from_contact: Float[np.ndarray, "b 4 4"],
    side: float,
    reach: float,
    sums: Float[np.ndarray, "b g g 4"],
) -> None:
    """Add the points of one depth image, and their number, to their cells' sums."""
    height, width = depth.shape
    cells = sums.shape[1]
    half = side / 2
    for b in range(len(camera_from_contact)):
        pose = camera_from_contact[b]
        # The window that the box's eight corners project into.
        left, right, top, bottom = width, -1, height, -1
        behind = False
        for corner in range(8):
            px = half if corner & 1 else -half
            py = half if corner & 2 else -half
            pz = reach if corner & 4 else -reach
            x = pose[0, 0] * px + pose[0, 1] * py + pose[0, 2] * pz + pose[0, 3]
            y = pose[1, 0] * px + pose[1, 1] * py + pose[1, 2] * pz + pose[1, 3]
            z = pose[2, 0] * px + pose[2, 1] * py + pose[2, 2] * pz + pose[2, 3]
            if z <= 0.0:
                behind = True
                break
            column = int(np.floor(k[0, 0] * x / z + k[0, 2]))
            row = int(np.floor(k[1, 1] * y / z + k[1, 2]))
            left, right = min(left, column), max(right, column)
            top, bottom = min(top, row), max(bottom, row)
        if behind:
            left, right, top, bottom = 0, width - 1, 0, height - 1
        for row in range(max(top, 0), min(bottom, height - 1) + 1):
            for column in range(max(left, 0), min(right, width - 1) + 1):
                z = depth[row, column]
                if not z > 0.0:
                    continue
                dx = z * (column + 0.5 - k[0, 2]) / k[0, 0] - pose[0, 3]
                dy = z * (row + 0.5 - k[1, 2]) / k[1, 1] - pose[1, 3]
                dz = z - pose[2, 3]
                gx = pose[0, 0] * dx + pose[1, 0] * dy + pose[2, 0] * dz
                gy = pose[0, 1] * dx + pose[1, 1] * dy + pose[2, 1] * dz
                gz = pose[0, 2] * dx + pose[1, 2] * dy + pose[2, 2] * dz
                if abs(gz) > reach:
                    continue
                i = int(np.floor((gy + half) / side * cells))
                j = int(np.floor((gx + half) / side * cells))
                if 0 <= i < cells and 0 <= j < cells:
                    sums[b, i, j, 0] += gx
                    sums[b, i, j, 1] += gy
                    sums[b, i, j, 2] += gz
                    sums[b, i, j, 3] += 1.0


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
