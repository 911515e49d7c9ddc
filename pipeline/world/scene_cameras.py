"""Where the cameras of a scene stand (S-1.13): beside the table, and on the wrist above objects."""

import math

import numpy as np
from jaxtyping import Float

from pipeline.config.cameras import CamerasConfig, StaticCameraConfig, WristCameraConfig
from pipeline.world.cameras import PinholeCamera, camera_at

_TARGET_M = np.array([0.0, 0.0, 0.02])  # a little above the middle of the table


def scene_cameras(
    config: CamerasConfig, objects_m: Float[np.ndarray, "n 3"], rng: np.random.Generator
) -> tuple[PinholeCamera, ...]:
    """All cameras of a scene (S-1.13): the static ones, then those of the wrist above its objects.

    Parameters
    ----------
    config
        Static and wrist cameras.
    objects_m
        Centres of the scene's objects in WCS [m], shape (n, 3).
    rng
        Draws the wrist's viewpoints.

    Returns
    -------
    Cameras with their poses.
    """
    return (*static_cameras(config.static), *wrist_cameras(config.wrist, objects_m, rng))


def camera_names(config: CamerasConfig) -> list[str]:
    """Names of the cameras that `scene_cameras` returns, in the same order."""
    static = [f"static_{number}" for number in range(len(config.static.elevations_rad))]
    return static + [f"wrist_{number}" for number in range(config.wrist.viewpoints)]


def static_cameras(config: StaticCameraConfig) -> tuple[PinholeCamera, ...]:
    """The cameras beside the table; each looks at the middle of the table."""
    places = zip(config.elevations_rad, config.azimuths_rad, strict=True)
    return tuple(
        camera_at(f"static_{number}", config, _TARGET_M, config.distance_m, elevation, azimuth)
        for number, (elevation, azimuth) in enumerate(places)
    )


def wrist_cameras(
    config: WristCameraConfig, objects_m: Float[np.ndarray, "n 3"], rng: np.random.Generator
) -> tuple[PinholeCamera, ...]:
    """Viewpoints of the wrist camera, each looking at one object from a random side.

    No object is looked at twice before every object was looked at once.

    Parameters
    ----------
    config
        Number of viewpoints, distance, and range of elevations.
    objects_m
        Centres of the scene's objects in WCS [m], shape (n, 3).
    rng
        Draws objects, elevations and azimuths.

    Returns
    -------
    Cameras with their poses; none where there are no objects.
    """
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
