"""The global point cloud: what several depth images measured, merged and thinned.

Supplement VI: the method merges point clouds of multiple viewpoints into a global one. Points
that fall into one cube of the world become their mean, so that density no longer tells how often
a place was looked at, and noise is averaged.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Integer

from pipeline.world.cameras import PinholeCamera, points_of_depth

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
    age_s
        From its exposure to the moment at which what it shows is acted upon [s].
    """

    depth_m: Float[np.ndarray, "h w"]
    camera: PinholeCamera
    instances: Integer[np.ndarray, "h w"] | None = None
    age_s: float = 0.0


@dataclass(frozen=True, eq=False)
class Cloud:
    """Measured points of the objects.

    Attributes
    ----------
    points_m
        Points in WCS [m], shape (n, 3).
    eye_m
        Position in WCS of the camera that measured each point [m], shape (n, 3).
    """

    points_m: Float[np.ndarray, "n 3"]
    eye_m: Float[np.ndarray, "n 3"]

    def __len__(self) -> int:
        return len(self.points_m)

    def take(self, chosen: Bool[np.ndarray, " n"] | Integer[np.ndarray, " k"]) -> "Cloud":
        """The points at the given indices, or where a mask is true."""
        return Cloud(self.points_m[chosen], self.eye_m[chosen])


def merged_cloud(pictures: Sequence[DepthPicture], voxel_m: float, above_table_m: float) -> Cloud:
    """Merge the objects' points of several pictures into one cloud, one point a cube of the world.

    Parameters
    ----------
    pictures
        Depth images of one scene.
    voxel_m
        Side of a cube whose points become their mean [m].
    above_table_m
        Points lower than this over z = 0 may belong to the table and are left out [m].

    Returns
    -------
    The means, each with the camera position of the first point in its cube.
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
    points, _, _ = points_of_depth(picture.depth_m, picture.camera, every=1, above_m=lowest_m)
    eye = picture.camera.world_from_camera[:3, 3]
    return Cloud(points, np.broadcast_to(eye, points.shape))
