"""Pinhole cameras: CCS is x right, y down, z forward; a pixel's centre lies at +0.5."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.config.cameras import (
    CamerasConfig,
    DepthCameraConfig,
    DepthSensor,
    StaticCameraConfig,
    WristCameraConfig,
)
from pipeline.geometry.transforms import invert, look_at, rotate_vectors, transform_points

_TARGET_M = np.array([0.0, 0.0, 0.02])  # the middle of the table, a little above it


@dataclass(frozen=True, eq=False)
class PinholeCamera:
    """A camera C with its pose P_C (S-1.13).

    intrinsics : (3, 3) pixels. world_from_camera : (4, 4) pose of CCS in WCS.
    sensor : how it errs. near_m, far_m : the depths it can measure.
    """

    name: str
    width_px: int
    height_px: int
    intrinsics: Float[np.ndarray, "3 3"]
    world_from_camera: Float[np.ndarray, "4 4"]
    sensor: DepthSensor
    near_m: float
    far_m: float


def scene_cameras(
    config: CamerasConfig, objects_m: Float[np.ndarray, "n 3"], rng: np.random.Generator
) -> tuple[PinholeCamera, ...]:
    """Every viewpoint of a scene: the static ones, then the wrist's above objects of it.

    objects_m : centres of the scene's objects in WCS.
    """
    return (*static_cameras(config.static), *wrist_cameras(config.wrist, objects_m, rng))


def camera_names(config: CamerasConfig) -> list[str]:
    """Names of a scene's viewpoints, in their order."""
    static = [f"static_{number}" for number in range(len(config.static.elevations_rad))]
    return static + [f"wrist_{number}" for number in range(config.wrist.viewpoints)]


def static_cameras(config: StaticCameraConfig) -> tuple[PinholeCamera, ...]:
    """One camera a viewpoint, each looking at the middle of the table."""
    places = zip(config.elevations_rad, config.azimuths_rad, strict=True)
    return tuple(
        camera_at(f"static_{number}", config, _TARGET_M, config.distance_m, elevation, azimuth)
        for number, (elevation, azimuth) in enumerate(places)
    )


def wrist_cameras(
    config: WristCameraConfig, objects_m: Float[np.ndarray, "n 3"], rng: np.random.Generator
) -> tuple[PinholeCamera, ...]:
    """The wrist's viewpoints: each above another object while there are some, from any side."""
    if config.viewpoints == 0 or len(objects_m) == 0:
        return ()
    rounds = -(-config.viewpoints // len(objects_m))
    order = np.concatenate([rng.permutation(len(objects_m)) for _ in range(rounds)])
    elevations = rng.uniform(config.elevation_min_rad, config.elevation_max_rad, config.viewpoints)
    azimuths = rng.uniform(-math.pi, math.pi, config.viewpoints)
    return tuple(
        camera_at(
            f"wrist_{number}",
            config,
            objects_m[order[number]],
            config.distance_m,
            float(elevations[number]),
            float(azimuths[number]),
        )
        for number in range(config.viewpoints)
    )


def camera_at(
    name: str,
    config: DepthCameraConfig,
    target_m: Float[np.ndarray, " 3"],
    distance_m: float,
    elevation_rad: float,
    azimuth_rad: float,
) -> PinholeCamera:
    """A camera that looks at a point in WCS from a distance; elevation above the horizontal."""
    focal_px = config.height_px / 2 / math.tan(config.vertical_fov_rad / 2)
    intrinsics = np.array(
        [
            [focal_px, 0.0, config.width_px / 2],
            [0.0, focal_px, config.height_px / 2],
            [0.0, 0.0, 1.0],
        ]
    )
    towards = np.array(
        [
            math.cos(elevation_rad) * math.cos(azimuth_rad),
            math.cos(elevation_rad) * math.sin(azimuth_rad),
            math.sin(elevation_rad),
        ]
    )
    return PinholeCamera(
        name=name,
        width_px=config.width_px,
        height_px=config.height_px,
        intrinsics=intrinsics,
        world_from_camera=look_at(target_m + distance_m * towards, target_m),
        sensor=config.sensor,
        near_m=config.near_m,
        far_m=config.far_m,
    )


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


def shown_whole(
    camera: PinholeCamera, points_m: Float[np.ndarray, "n 3"], radius_m: float
) -> Bool[np.ndarray, " n"]:
    """Whether the picture does not end within ``radius_m`` of each point in WCS.

    What a picture can show is a pyramid: a ball lies in it where its centre is at least its
    radius inside each of the four faces.
    """
    k = camera.intrinsics
    left, top = k[0, 2] / k[0, 0], k[1, 2] / k[1, 1]
    right = (camera.width_px - k[0, 2]) / k[0, 0]
    bottom = (camera.height_px - k[1, 2]) / k[1, 1]
    inward = np.array([[1.0, 0, left], [-1.0, 0, right], [0, 1.0, top], [0, -1.0, bottom]])
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    in_camera = transform_points(invert(camera.world_from_camera), points_m)
    return np.asarray((in_camera @ inward.T >= radius_m).all(axis=1))


def _on_unit_plane(
    camera: PinholeCamera, rows: Int[np.ndarray, " n"], columns: Int[np.ndarray, " n"]
) -> Float[np.ndarray, "n 3"]:
    """Each pixel's point at depth 1 in CCS."""
    k = camera.intrinsics
    x = (columns + 0.5 - k[0, 2]) / k[0, 0]
    y = (rows + 0.5 - k[1, 2]) / k[1, 1]
    return np.stack([x, y, np.ones_like(x)], axis=1)
