"""Which gripper poses would make its rigid stem collide with measured points."""

import numpy as np
from jaxtyping import Bool, Float

from pipeline.compiled_code import njit
from pipeline.config.evaluation import HandConfig


def free_of_collision(
    world_from_gripper: Float[np.ndarray, "k 4 4"],
    points_m: Float[np.ndarray, "n 3"],
    hand: HandConfig,
) -> Bool[np.ndarray, " k"]:
    """Whether the stem meets no measured point, at the contact and on the way down to it.

    The stem moves along its own axis, so the volume it sweeps is a longer cylinder.

    Parameters
    ----------
    world_from_gripper
        Poses of the gripper at its contact, shape (k, 4, 4).
    points_m
        Measured points in WCS [m], shape (n, 3).
    hand
        The stem's radius, where it begins above the pad, and the margin kept from points.

    Returns
    -------
    True for each pose that is free, shape (k,).
    """
    return np.asarray(
        _free(
            np.ascontiguousarray(world_from_gripper),
            np.ascontiguousarray(points_m),
            hand.stem_radius_m + hand.margin_m,
            hand.stem_begins_m - hand.margin_m,
        )
    )


@njit()
def _free(
    poses: Float[np.ndarray, "k 4 4"],
    points: Float[np.ndarray, "n 3"],
    radius: float,
    begins: float,
) -> Bool[np.ndarray, " k"]:
    free = np.ones(len(poses), dtype=np.bool_)
    for i in range(len(poses)):
        pose = poses[i]
        for j in range(len(points)):
            x = points[j, 0] - pose[0, 3]
            y = points[j, 1] - pose[1, 3]
            z = points[j, 2] - pose[2, 3]
            along = pose[0, 2] * x + pose[1, 2] * y + pose[2, 2] * z
            if along > begins and x * x + y * y + z * z - along * along < radius * radius:
                free[i] = False
                break
    return free
