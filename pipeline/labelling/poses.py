"""Labels at given poses on given surfaces: S-1.07 - S-1.12."""

import numpy as np
from jaxtyping import Float, Int

from pipeline.config.grasps import GripperConfig
from pipeline.gripper import LabelBatch, label_batch, pad_of
from pipeline.labelling.heights import pad_heights
from pipeline.world.raycasting import Surfaces

ROUND = 512  # grasps labelled at once: bounds the memory of their rays


def label_poses(
    world_from_gripper: Float[np.ndarray, "n 4 4"],
    body_id: Int[np.ndarray, " n"],
    surfaces: Surfaces,
    config: GripperConfig,
    clearance_m: float,
) -> LabelBatch:
    """Label grasps: find the heights under the pad by rays, then call `label_batch`.

    Parameters
    ----------
    world_from_gripper
        Pose of each grasp in the frame of ``surfaces``, shape (n, 4, 4): origin anywhere on the
        approach, +z out of the object.
    body_id
        The body that each grasp is to hold, as ``surfaces`` numbers it, shape (n,). Other bodies
        under the pad support it but are not sealed.
    surfaces
        The true surfaces.
    config
        The gripper.
    clearance_m
        Height above the origin at which rays begin [m]; they miss everything higher.

    Returns
    -------
    One row a grasp.
    """
    pad = pad_of(config.pad)
    parts = []
    for start in range(0, max(len(world_from_gripper), 1), ROUND):
        rows = slice(start, start + ROUND)
        heights, below = pad_heights(world_from_gripper[rows], surfaces, pad, clearance_m)
        parts.append(label_batch(pad, config, heights, below == body_id[rows, None]))
    return LabelBatch.join(parts)
