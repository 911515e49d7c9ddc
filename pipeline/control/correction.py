"""The local phase's one step: look at the aim again, and move it where that promises more."""

import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import EvaluateConfig
from pipeline.control.candidates import sample_near
from pipeline.control.clearance import free_of_collision
from pipeline.control.cloud import DepthPicture, merged_cloud
from pipeline.control.ranking import Ranking


def corrected(
    picture: DepthPicture,
    aim: Float[np.ndarray, "4 4"],
    ranking: Ranking,
    config: EvaluateConfig,
    normal_radius_m: float,
    rng: np.random.Generator,
) -> tuple[Float[np.ndarray, "4 4"], float] | None:
    """The pose to aim at now and its q-hat; None where the picture shows nothing to go by.

    The aim itself, as it is seen now, is the first candidate: another must promise more by
    ``correction_gain``, so that noise does not move the gripper to and fro.
    """
    policy = config.policy
    cloud = merged_cloud([picture], policy.correction_voxel_m, policy.above_table_m)
    near = sample_near(
        cloud,
        aim[:3, 3],
        policy.correction_radius_m,
        policy.local_candidates,
        normal_radius_m,
        policy.tilt_max_rad,
        rng,
    )
    free = free_of_collision(near.world_from_contact, cloud.points_m, config.hand)
    # Near the contact the gripper has no room left to swing round.
    alike = near.world_from_contact[:, :3, 2] @ aim[:3, 2] >= np.cos(policy.correction_tilt_rad)
    near = near.take(free & alike)
    if len(near) == 0:
        return None
    quality = ranking([picture], near)
    best = int(np.argmax(quality))
    if quality[best] < quality[0] + policy.correction_gain:
        best = 0
    return near.world_from_contact[best], float(quality[best])
