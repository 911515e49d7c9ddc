"""What the cameras measured around each labelled grasp: S-1.13 - S-1.15."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.config import RunConfig
from pipeline.sensing.depth_noise import disturb
from pipeline.sensing.sub_cloud import merged_sub_clouds
from pipeline.world.cameras import PinholeCamera
from pipeline.world.view import CameraView

Picture = tuple[Float[np.ndarray, "_ _"], PinholeCamera]
"""Measured depth [m], 0 where nothing was measured, and the camera that took it."""


def measured_pictures(
    views: Sequence[CameraView], disturbed: bool, rng: np.random.Generator
) -> list[Picture]:
    """S-1.13 - S-1.15: the cameras' depth images, with their sensors' noise if ``disturbed``."""
    return [(disturb(view, rng) if disturbed else view.depth_m, view.camera) for view in views]


def clouds_around(
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
    """S-1.14, S-1.15: Transform and Desample, from all pictures for some, from one for the rest.

    Parameters
    ----------
    world_from_contact
        Where each cloud is cut, shape (n, 4, 4).
    picture
        Of the view that proposed the grasps.
    pictures
        Of all views of the scene, for ``grasps.merged_share`` of the clouds.
    config
        Sections sensing, grasps and gripper.
    rng
        Draws which clouds are merged.

    Returns
    -------
    Clouds in units of r_G, shape (n, g, g, 3); the cells that hold a measured point, shape
    (n, g, g); and from how many pictures each was cut, shape (n,).
    """
    merged = rng.random(len(world_from_contact)) < config.grasps.merged_share
    cells = config.sensing.grid_cells
    cloud = np.empty((len(merged), cells, cells, 3), dtype=np.float32)
    mask = np.empty((len(merged), cells, cells), dtype=np.bool_)
    for rows, seen in ((merged, pictures), (~merged, [picture])):
        cloud[rows], mask[rows] = merged_sub_clouds(
            seen, world_from_contact[rows], config.sensing, config.gripper.pad.radius_m
        )
    return cloud, mask, np.where(merged, len(pictures), 1)
