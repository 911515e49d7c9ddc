"""Centre of mass of an object that broke away from the pad, and contacts nearer to it.

Supplement VI: the wrench serves to «minimize the moments on the gripper base during grasping». A
pad bears far less moment than pull, so a heavy object must be held near its centre of mass. That is
computed from the wrench during the first tug, as no picture shows it.
"""

import numpy as np
from jaxtyping import Float

from pipeline.config.policy import PolicyConfig
from pipeline.control.candidates import Candidates
from pipeline.control.cloud import Cloud
from pipeline.control.robot import Reading
from pipeline.control.wrench_monitor import line_of_load


def load_place_m(felt: Reading, base_above_pad_m: float) -> Float[np.ndarray, " 2"]:
    """Horizontal place of the load's centre of mass, from the wrench.

    It is where the line of action of the force at the base is at the height of the pad.

    Parameters
    ----------
    felt
        Pose and wrench while the object pulled.
    base_above_pad_m
        Distance from the pad to the base, where the wrench is measured [m].

    Returns
    -------
    x and y in WCS [m], shape (2,).
    """
    pose = felt.world_from_gripper
    on_line = np.array([0.0, 0.0, base_above_pad_m]) + line_of_load(felt.wrench)
    point = pose[:3, :3] @ on_line + pose[:3, 3]
    pull = pose[:3, :3] @ felt.wrench[:3]
    along = (pose[2, 3] - point[2]) / pull[2]
    return np.asarray(point[:2] + along * pull[:2])


def top_of_column_m(
    cloud: Cloud, place_m: Float[np.ndarray, " 2"], radius_m: float
) -> Float[np.ndarray, " 3"] | None:
    """The highest point measured within a radius of a vertical line; None where there is none."""
    near = np.linalg.norm(cloud.points_m[:, :2] - place_m, axis=1) <= radius_m
    if not near.any():
        return None
    column = cloud.points_m[near]
    return np.asarray(column[np.argmax(column[:, 2])])


def worth_with_lever(
    quality: Float[np.ndarray, " k"],
    candidates: Candidates,
    place_m: Float[np.ndarray, " 2"],
    lever_m: float,
    config: PolicyConfig,
) -> Float[np.ndarray, " k"]:
    """q-hat, reduced with the distance from the load's centre of mass; 0 where it is hardly nearer.

    Parameters
    ----------
    quality
        q-hat of each candidate, shape (k,).
    candidates
        Contacts to choose among.
    place_m
        Horizontal place of the load's centre of mass in WCS [m], shape (2,).
    lever_m
        Horizontal lever of the contact that did not hold [m].
    config
        How much nearer a new contact must be, and the radius over which the value falls: the moment
        that a pad bears grows with its radius.

    Returns
    -------
    Value of each candidate in [0, 1], shape (k,).
    """
    aside = np.linalg.norm(candidates.world_from_contact[:, :2, 3] - place_m, axis=1)
    fall = np.exp(-((aside / config.regrasp_radius_m) ** 2))
    return np.where(aside <= config.regrasp_nearer * lever_m, quality * fall, 0.0)
