"""Forward kinematics once more, written down another way: what the arm's tests hold it against."""

import math

import numpy as np

from pipeline.geometry.iiwa14 import AXES


def flange_pose(q_rad: np.ndarray) -> np.ndarray:
    """base_from_flange in closed form: the product of the seven Denavit-Hartenberg matrices."""
    pose = np.eye(4)
    for axis, q in zip(AXES, q_rad, strict=True):
        c, s = math.cos(q), math.sin(q)
        ca, sa = math.cos(axis.alpha_rad), math.sin(axis.alpha_rad)
        pose = pose @ np.array(
            [
                [c, -s * ca, s * sa, 0.0],
                [s, c * ca, -c * sa, 0.0],
                [0.0, sa, ca, axis.d_m],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )
    return pose
