"""The support that the frames of one scene show, and whether their poses agree on it."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from loguru import logger

from pipeline.camera.frame import Frame
from pipeline.camera.support import Support, level_support
from pipeline.camera.support_search import UP_IN_CAMERA, find_support
from pipeline.config import RunConfig
from pipeline.errors import PictureError
from pipeline.geometry.transforms import frame_from_z, invert, transform_points
from pipeline.world.cameras import points_of_depth

EVERY_PX = 2  # every second pixel a side is enough to find planes
WORLD_UP = np.array([0.0, 0.0, 1.0])  # of a world whose z is up


def support_of(frames: Sequence[Frame], config: RunConfig, rng: np.random.Generator) -> Support:
    """What objects stand on in pictures of one scene.

    Parameters
    ----------
    frames
        The pictures.
    config
        The run's configuration; ``predict.support`` matters.
    rng
        Draws the points that planes are fitted to.

    Returns
    -------
    The support.

    Raises
    ------
    PictureError
        There is none; the error names the first picture.
    """
    settings = config.predict.support
    if settings.height_m is not None:
        return level_support(settings.height_m)
    points, eyes, ahead = [], [], []
    for frame in frames:
        found, _, _ = points_of_depth(frame.depth_m, frame.camera, EVERY_PX)
        points.append(found)
        pose = frame.camera.world_from_camera
        eyes.append(np.broadcast_to(pose[:3, 3], found.shape))
        ahead.append(np.broadcast_to(pose[:3, 2], found.shape))
    posed = frames[0].posed
    up = WORLD_UP if posed else UP_IN_CAMERA
    try:
        return find_support(
            np.concatenate(points),
            np.concatenate(eyes),
            np.concatenate(ahead),
            up,
            posed,
            settings,
            rng,
        )
    except PictureError as error:
        raise PictureError(f"{frames[0].name}: {error.what}", error.remedy) from error


def support_beside_masks(
    frames: Sequence[Frame], config: RunConfig, rng: np.random.Generator
) -> Support | None:
    """The support; None where there is none and every frame has a mask of its own."""
    try:
        return support_of(frames, config, rng)
    except PictureError:
        if all(not frame.allowed.all() for frame in frames):
            return None
        raise


def upright(frame: Frame) -> Float[np.ndarray, "4 4"]:
    """For a scene without a support: a frame of the world, z up, below all that was measured."""
    points, _, _ = points_of_depth(frame.depth_m, frame.camera, EVERY_PX)
    up = WORLD_UP if frame.posed else UP_IN_CAMERA
    lowest = float((points @ up).min()) - 1.0
    return frame_from_z(up * lowest, up)


def frames_that_agree(
    frames: Sequence[Frame], config: RunConfig, rng: np.random.Generator
) -> list[Frame]:
    """Frames whose poses fit together, by the support that each shows; others are warned of.

    Merged frames whose poses do not fit show every surface twice, and what is a floor in one of
    them seems to stand on the floor of the other.

    Parameters
    ----------
    frames
        Pictures of one scene; the first is kept in any case.
    config
        The run's configuration; ``predict.poses_agree_m`` bounds how far supports lie apart.
    rng
        Draws the points that planes are fitted to.

    Returns
    -------
    The frames to merge. One that shows no support, or has no pose, cannot be judged and is kept.
    """
    known = all(frame.posed for frame in frames) and config.predict.support.height_m is None
    if len(frames) == 1 or not known:
        return list(frames)
    kept = [frames[0]]
    first = _seen_alone(frames[0], config, rng)
    for frame in frames[1:]:
        own = _seen_alone(frame, config, rng)
        if first is not None and own is not None and len(own.outline_m):
            middle = np.append(own.outline_m.mean(axis=0), 0.0)[None]
            in_world = transform_points(own.world_from_support, middle)
            in_first = transform_points(invert(first.world_from_support), in_world)
            off_m = abs(float(in_first[0, 2]))
            if off_m > config.predict.poses_agree_m:
                logger.warning(
                    "{} is left out: the support that it shows lies {:.0f} mm off that of {}, so "
                    "their poses do not fit together",
                    frame.name,
                    1e3 * off_m,
                    frames[0].name,
                )
                continue
        kept.append(frame)
    return kept


def _seen_alone(frame: Frame, config: RunConfig, rng: np.random.Generator) -> Support | None:
    """The support of one frame; None where it shows none."""
    try:
        return support_of([frame], config, rng)
    except PictureError:
        return None
