"""The local phase's memory: what the wrist's camera saw on the way down, and how it moves.

Pictures that still stand are looked at together with the newest, for one alone is noisy and sees
one side; the velocity of what passes by carries the aim along, and leads it where the camera is
too near to see it.
"""

import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import EvaluateConfig
from pipeline.control.cloud import DepthPicture, merged_cloud
from pipeline.control.correction import LOOK_M, corrected
from pipeline.control.looked_through import looked_through
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
        self._pictures: list[DepthPicture] = []
        self.start_over()

    def start_over(self) -> None:
        """Another place is aimed at: how the last one moved says nothing of it."""
        self._motion = Motion(1.0 / self._config.policy.rate_hz)

    def remember(self, picture: DepthPicture) -> None:
        """A picture of the wrist's camera from before."""
        self._pictures.append(picture)

    def look(self, picture: DepthPicture, aim: Pose) -> tuple[Pose, float] | None:
        """The pose to aim at now and its q-hat; None where there is nothing to go by."""
        self._motion.see(merged_cloud([picture]).points_m, aim[:3, 3])
        self._pictures = [*self._that_stand(picture, aim), picture]
        return corrected(
            self._pictures, aim, self._ranking, self._config, self._normal_radius_m, self._rng
        )

    def met(self, aim: Pose, here: Pose) -> Pose:
        """Where the aim will be when the pad, now here, gets there."""
        left_m = max(float((here[:3, 3] - aim[:3, 3]) @ aim[:3, 2]), 0.0)
        return self._after(left_m / self._config.policy.speed_m_s, aim)

    def passed_on(self, aim: Pose) -> Pose:
        """The aim one control period later."""
        self._motion.passed()
        return self._after(1.0 / self._config.policy.rate_hz, aim)

    def _after(self, time_s: float, aim: Pose) -> Pose:
        later = aim.copy()
        later[:3, 3] += self._motion.velocity_m_s * time_s
        return later

    def _that_stand(self, picture: DepthPicture, aim: Pose) -> list[DepthPicture]:
        """The last pictures, unless what they show has moved since."""
        policy = self._config.policy
        last = self._pictures[-policy.pictures_kept :] if policy.pictures_kept else []
        if not last:
            return []
        cloud = merged_cloud(last)
        near = np.linalg.norm(cloud.points_m - aim[:3, 3], axis=1) <= LOOK_M
        gone = looked_through(cloud.points_m[near], picture)
        return last if gone <= policy.gone_share else []
