"""The global point cloud: what several depth images measured, merged and thinned.

Supplement VI: the method merges point clouds of multiple viewpoints into a global one. Points
that fall into one cube of the world become their mean, so that density no longer tells how often
a place was looked at, and noise is averaged.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
from jaxtyping import Bool, Float, Integer

from pipeline.world.cameras import PinholeCamera

_CUBES_A_SIDE = 1 << 20  # cubes are numbered within ± 1.5 km


@dataclass(frozen=True, eq=False)
class DepthPicture:
    """A depth image and the camera that took it, with its pose in WCS.

    Attributes
    ----------
    depth_m
        (h, w); what is not above zero, NaN included, was not measured.
    instances
        Which object each pixel shows by its colour, 0 for none; None where nothing segments the
        pictures.
    """

    depth_m: Float[np.ndarray, "h w"]
    camera: PinholeCamera
    instances: Integer[np.ndarray, "h w"] | None = None


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points of the objects in WCS. eye_m : (n, 3) where the camera stood that saw each."""

    points_m: Float[np.ndarray, "n 3"]
    eye_m: Float[np.ndarray, "n 3"]

    def __len__(self) -> int:
        return len(self.points_m)

    def take(self, chosen: Bool[np.ndarray, " n"] | Integer[np.ndarray, " k"]) -> "Cloud":
        """Some of the points."""
        return Cloud(self.points_m[chosen], self.eye_m[chosen])


def merged_cloud(pictures: Sequence[DepthPicture], voxel_m: float, above_table_m: float) -> Cloud:
    """The objects' points of all pictures, one a cube; without the table's.

    Parameters
    ----------
    pictures
        Depth images of one scene.
    voxel_m
        Side of a cube of the world whose points become their mean [m].
    above_table_m
        Points lower than this over z = 0 may be the table and are left out [m].
    """
    parts = [_measured(picture, above_table_m) for picture in pictures]
    points = np.concatenate([part.points_m for part in parts])
    eyes = np.concatenate([part.eye_m for part in parts])
    if len(points) == 0:
        return Cloud(points, eyes)
    cubes = np.floor(points / voxel_m).astype(np.int64) + _CUBES_A_SIDE // 2
    key = (cubes[:, 0] * _CUBES_A_SIDE + cubes[:, 1]) * _CUBES_A_SIDE + cubes[:, 2]
    _, first, owner = np.unique(key, return_index=True, return_inverse=True)
    counts = np.bincount(owner)
    means = np.stack(
        [np.bincount(owner, weights=points[:, axis]) / counts for axis in range(3)], axis=1
    )
    return Cloud(means, eyes[first])


def _measured(picture: DepthPicture, lowest_m: float) -> Cloud:
    camera = picture.camera
    depth = np.ascontiguousarray(picture.depth_m, dtype=np.float64)
    points = _points(depth, camera.intrinsics, camera.world_from_camera, lowest_m)
    return Cloud(points, np.broadcast_to(camera.world_from_camera[:3, 3], points.shape))


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _points(
    depth: Float[np.ndarray, "h w"],
    k: Float[np.ndarray, "3 3"],
    pose: Float[np.ndarray, "4 4"],
    lowest_m: float,
) -> Float[np.ndarray, "n 3"]:
    """Measured points in WCS that lie higher than ``lowest_m``."""
    found = np.empty((depth.size, 3))
    count = 0
    for row in range(depth.shape[0]):
        y = (row + 0.5 - k[1, 2]) / k[1, 1]
        for column in range(depth.shape[1]):
            z = depth[row, column]
            if not (z > 0.0 and z < np.inf):
                continue
            x = (column + 0.5 - k[0, 2]) / k[0, 0]
            height = z * (pose[2, 0] * x + pose[2, 1] * y + pose[2, 2]) + pose[2, 3]
            if height > lowest_m:
                for axis in range(2):
                    found[count, axis] = (
                        z * (pose[axis, 0] * x + pose[axis, 1] * y + pose[axis, 2]) + pose[axis, 3]
                    )
                found[count, 2] = height
                count += 1
    return found[:count]
