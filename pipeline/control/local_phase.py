"""The local phase: what the wrist's camera sees on the way down corrects the aim.

The velocity of what passes by carries the aim along, and leads it where the camera is too near to
see it any more.
"""

import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import EvaluateConfig
from pipeline.control.cloud import DepthPicture, merged_cloud
from pipeline.control.correction import corrected
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
        self._normal_radius_m = normal_radius_m
        self._rng = rng
        self.start_over()

    def start_over(self) -> None:
        """Another place is aimed at: how the last one moved says nothing of it."""
        policy = self._config.policy
        self._motion = Motion(
            1.0 / policy.rate_hz, policy.shown_share * policy.look_m, policy.motion
        )

    @property
    def moves(self) -> bool:
        """Whether what is aimed at passes by."""
        return bool(self._motion.velocity_m_s.any())

    def look(self, picture: DepthPicture, aim: Pose) -> tuple[Pose, float] | None:
        """The pose to aim at now and its q-hat; None where there is nothing to go by."""
        policy = self._config.policy
        cloud = merged_cloud([picture], policy.voxel_m, policy.above_table_m)
        self._motion.see(cloud.points_m, aim[:3, 3])
        return corrected(
            picture,
            aim,
            self._ranking,
            self._config,
            self._normal_radius_m,
            self._rng,
        )

    def met(self, aim: Pose, here: Pose) -> Pose:
        """Where the aim will be when the pad, now here, gets there."""
        return self._after(way_left_m(aim, here) / self._config.policy.speed_m_s, aim)

    def passed_on(self, aim: Pose) -> Pose:
        """The aim one control period later."""
        self._motion.passed()
        return self._after(1.0 / self._config.policy.rate_hz, aim)

    def _after(self, time_s: float, aim: Pose) -> Pose:
        later = aim.copy()
        later[:3, 3] += self._motion.velocity_m_s * time_s
        return later


def way_left_m(aim: Pose, here: Pose) -> float:
    """How far the pad, now here, still is from the aim, along its approach."""
    return max(float((here[:3, 3] - aim[:3, 3]) @ aim[:3, 2]), 0.0)
