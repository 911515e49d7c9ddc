"""The local phase: pictures of the wrist's camera during the approach correct the aim.

The measured velocity of a moving object moves the aim along with it, also when the camera is too
near to see the object any more.
"""

import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import EvaluateConfig
from pipeline.control.cloud import DepthPicture, merged_cloud
from pipeline.control.correction import correct_aim
from pipeline.control.motion import Motion
from pipeline.control.ranking import Ranking

Pose = Float[np.ndarray, "4 4"]


class LocalPhase:
    """One approach, from the standoff to the contact."""

    def __init__(
        self,
        ranking: Ranking,
        config: EvaluateConfig,
        normal_radius_m: float,
        rng: np.random.Generator,
    ) -> None:
        self._ranking = ranking
        self._config = config
        self._default_radius_m = normal_radius_m
        self._rng = rng
        self.start_over()

    def start_over(self, normal_radius_m: float = 0.0) -> None:
        """Forget the motion measured so far, because another place is aimed at.

        Normals are measured over the radius by which the place was found [m]; 0: over the usual.
        """
        self._normal_radius_m = normal_radius_m or self._default_radius_m
        policy = self._config.policy
        self._motion = Motion(
            1.0 / policy.rate_hz, policy.shown_share * policy.look_m, policy.motion
        )

    @property
    def moves(self) -> bool:
        """Whether the object aimed at was measured to move."""
        return bool(self._motion.velocity_m_s.any())

    def look(self, picture: DepthPicture, aim: Pose, gain: float) -> tuple[Pose, float] | None:
        """The pose to aim at after a new picture, and its q-hat; None without any candidate.

        The picture shows where an object in motion was at the exposure; the aim is where it is now.
        Another contact must promise ``gain`` more than the present one.
        """
        policy = self._config.policy
        cloud = merged_cloud([picture], policy.voxel_m, policy.above_table_m)
        self._motion.see(cloud.points_m, aim[:3, 3])
        found = correct_aim(
            picture,
            self._after(-picture.age_s, aim),
            self._ranking,
            self._config,
            self._normal_radius_m,
            self._rng,
            gain,
        )
        return None if found is None else (self._after(picture.age_s, found[0]), found[1])

    def predict_meeting(self, aim: Pose, here: Pose) -> Pose:
        """Where the aim will be when the pad, now at ``here``, reaches it."""
        return self._after(way_left_m(aim, here) / self._config.policy.speed_m_s, aim)

    def advance_aim(self, aim: Pose) -> Pose:
        """Count one control period and return where the aim is after it."""
        self._motion.count_period()
        return self._after(1.0 / self._config.policy.rate_hz, aim)

    def _after(self, time_s: float, aim: Pose) -> Pose:
        later = aim.copy()
        later[:3, 3] += self._motion.velocity_m_s * time_s
        return later


def way_left_m(aim: Pose, here: Pose) -> float:
    """Distance from the pad at ``here`` to the aim along the approach axis [m], at least 0."""
    return max(float((here[:3, 3] - aim[:3, 3]) @ aim[:3, 2]), 0.0)
