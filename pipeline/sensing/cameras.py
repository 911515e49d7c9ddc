"""Pinhole cameras: CCS is x right, y down, z forward; a pixel's centre lies at +0.5."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.config.scenes import CameraConfig
from pipeline.geometry.transforms import look_at, rotate_vectors, transform_points

_TARGET_M = np.array([0.0, 0.0, 0.02])  # the middle of the table, a little above it


@dataclass(frozen=True, eq=False)
class PinholeCamera:
    """A camera C with its pose P_C (S-1.13).

    intrinsics : (3, 3) pixels. world_from_camera : (4, 4) pose of CCS in WCS.
    """

    name: str
    width_px: int
    height_px: int
    intrinsics: Float[np.ndarray, "3 3"]
    world_from_camera: Float[np.ndarray, "4 4"]


def cameras_of(config: CameraConfig) -> tuple[PinholeCamera, ...]:
    """One camera a viewpoint, each looking at the middle of the table."""
    focal_px = config.height_px / 2 / math.tan(config.vertical_fov_rad / 2)
    intrinsics = np.array(
        [
            [focal_px, 0.0, config.width_px / 2],
            [0.0, focal_px, config.height_px / 2],
            [0.0, 0.0, 1.0],
        ]
    )
    cameras = []
    for number, (elevation, azimuth) in enumerate(
        zip(config.elevations_rad, config.azimuths_rad, strict=True)
    ):
        towards = np.array(
            [
                math.cos(elevation) * math.cos(azimuth),
                math.cos(elevation) * math.sin(azimuth),
                math.sin(elevation),
            ]
        )
        pose = look_at(_TARGET_M + config.distance_m * towards, _TARGET_M)
        name = f"static_{number}"
        cameras.append(PinholeCamera(name, config.width_px, config.height_px, intrinsics, pose))
    return tuple(cameras)


def pixel_rays(
    camera: PinholeCamera, mask: Bool[np.ndarray, "h w"]
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "n 3"]]:
    """The camera's centre and the unit ray through each chosen pixel, in WCS, row by row."""
    rows, columns = np.nonzero(mask)
    rays = _on_unit_plane(camera, rows, columns)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return camera.world_from_camera[:3, 3], rotate_vectors(camera.world_from_camera, rays)


def points_of_depth(
    depth_m: Float[np.ndarray, "h w"], camera: PinholeCamera, every: int
) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, " n"], Int[np.ndarray, " n"]]:
    """Measured points in WCS with their rows and columns; of ``every`` pixel a side."""
    chosen = np.zeros(depth_m.shape, dtype=bool)
    chosen[::every, ::every] = True
    rows, columns = np.nonzero(chosen & (depth_m > 0))
    points = (
        _on_unit_plane(camera, rows, columns) * depth_m[rows, columns].astype(np.float64)[:, None]
    )
    return transform_points(camera.world_from_camera, points), rows, columns


def _on_unit_plane(
    camera: PinholeCamera, rows: Int[np.ndarray, " n"], columns: Int[np.ndarray, " n"]
) -> Float[np.ndarray, "n 3"]:
    """Each pixel's point at depth 1 in CCS."""
    k = camera.intrinsics
    x = (columns + 0.5 - k[0, 2]) / k[0, 0]
    y = (rows + 0.5 - k[1, 2]) / k[1, 1]
    return np.stack([x, y, np.ones_like(x)], axis=1)
