"""One step of the local phase: compare the aim with contacts near it and take the best."""

import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import EvaluateConfig
from pipeline.control.candidates import sample_near
from pipeline.control.clearance import free_of_collision
from pipeline.control.cloud import DepthPicture, merged_cloud
from pipeline.control.ranking import Ranking


def correct_aim(
    picture: DepthPicture,
    aim: Float[np.ndarray, "4 4"],
    ranking: Ranking,
    config: EvaluateConfig,
    normal_radius_m: float,
    rng: np.random.Generator,
    gain: float,
) -> tuple[Float[np.ndarray, "4 4"], float] | None:
    """Choose the pose to aim at after a new picture of the wrist's camera.

    The measured point nearest to the aim is the first candidate. Another one is taken only where
    its quality is higher by ``gain``, so that noise alone does not move the gripper.

    Parameters
    ----------
    picture
        Depth image of the surroundings of the aim.
    aim
        world_from_contact aimed at so far, shape (4, 4).
    ranking
        Gives the quality of each candidate.
    config
        Bounds of the correction, and the rigid parts of the gripper.
    normal_radius_m
        Radius over which a contact's normal is measured [m].
    rng
        Generator of the candidates.
    gain
        What another contact must promise more [1]; inf: none is taken.

    Returns
    -------
    world_from_contact, shape (4, 4), and its q-hat; None where no candidate is left.
    """
    policy = config.policy
    # A steep aim is corrected among steep contacts.
    is_steep = aim[2, 2] < np.cos(policy.tilt_max_rad)
    cloud = merged_cloud([picture], policy.correction_voxel_m, policy.above_table_m)
    near = sample_near(
        cloud,
        aim[:3, 3],
        policy.correction_radius_m,
        policy.local_candidates,
        normal_radius_m,
        policy.steepest_rad if is_steep else policy.tilt_max_rad,
        rng,
        policy.lean_rad if is_steep else 0.0,
    )
    free = free_of_collision(near.world_from_contact, cloud.points_m, config.hand)
    # Near the contact the gripper has no room left to swing round.
    alike = near.world_from_contact[:, :3, 2] @ aim[:3, 2] >= np.cos(policy.correction_tilt_rad)
    near = near.take(free & alike)
    if len(near) == 0:
        return None
    quality = ranking([picture], near)
    best = int(np.argmax(quality))
    if quality[best] < quality[0] + gain:
        best = 0
    return near.world_from_contact[best], float(quality[best])
