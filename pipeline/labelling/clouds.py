"""Point clouds that the cameras measured around each labelled grasp: S-1.13 - S-1.15."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.config import RunConfig
from pipeline.sensing.depth_noise import disturb
from pipeline.sensing.sub_cloud import cut_into
from pipeline.world.cameras import PinholeCamera
from pipeline.world.view import CameraView

Picture = tuple[Float[np.ndarray, "_ _"], PinholeCamera]
"""Measured depth [m], 0 where nothing was measured, and the camera that took it."""


def measure_pictures(
    views: Sequence[CameraView], disturbed: bool, rng: np.random.Generator
) -> list[Picture]:
    """Depth pictures of the views (S-1.13), with the sensors' noise (S-1.15) if ``disturbed``."""
    return [(disturb(view, rng) if disturbed else view.depth_m, view.camera) for view in views]


def cut_clouds(
    world_from_contact: Float[np.ndarray, "n 4 4"],
    picture: Picture,
    pictures: Sequence[Picture],
    config: RunConfig,
    rng: np.random.Generator,
) -> tuple[
    Float[np.ndarray, "n g g 3"],
    Bool[np.ndarray, "n g g"],
    Int[np.ndarray, " n"],
]:
    """Cut a cloud around each contact (Transform, Desample; S-1.14, S-1.15).

    A random part of the clouds is cut from all pictures of the scene, the others from one.

    Parameters
    ----------
    world_from_contact
        Frame of each contact, shape (n, 4, 4); the cloud is cut around its origin.
    picture
        Picture of the view in which the grasps were proposed.
    pictures
        Pictures of all views of the scene; ``grasps.merged_share`` of the clouds use them all.
    config
        Sections sensing, grasps and gripper.
    rng
        Draws which clouds are merged.

    Returns
    -------
    Clouds in units of r_G, shape (n, g, g, 3); the cells that hold a measured point, shape
    (n, g, g); and the number of pictures that each was cut from, shape (n,).
    """
    merged = rng.random(len(world_from_contact)) < config.grasps.merged_share
    cells = config.sensing.grid_cells
    cloud = np.empty((len(merged), cells, cells, 3), dtype=np.float32)
    mask = np.empty((len(merged), cells, cells), dtype=np.bool_)
    radius_m = config.gripper.pad.radius_m
    for rows, seen in ((merged, pictures), (~merged, [picture])):
        chosen = np.flatnonzero(rows)
        cut_into(seen, world_from_contact, config.sensing, radius_m, chosen, cloud, mask)
    return cloud, mask, np.where(merged, len(pictures), 1)
