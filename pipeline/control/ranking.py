"""What makes a candidate good: the network's q-hat, or the plain geometry of a baseline."""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from jaxtyping import Bool, Float

from pipeline.config.grasps import SensingConfig
from pipeline.control.candidates import Candidates
from pipeline.control.cloud import DepthPicture
from pipeline.sensing.sub_cloud import merged_sub_clouds

_LIKE_COSINE = 0.95  # approaches within 18 degrees

Predict = Callable[
    [Float[np.ndarray, "n g g 3"], Bool[np.ndarray, "n g g"]], Float[np.ndarray, " n"]
]
"""q-hat of sub clouds, in units of r_G, and of the cells that are seen."""


class Ranking(Protocol):
    """A value in [0, 1] for every candidate, the best highest."""

    def __call__(
        self, pictures: Sequence[DepthPicture], candidates: Candidates, /
    ) -> Float[np.ndarray, " k"]: ...


class NetworkRanking:
    """q-hat of GA-CNN, all candidates in one batch, on the sub cloud of all pictures.

    Each candidate's value is then averaged with its neighbours': the best of many noisy values
    is a lucky one, and a pose whose neighbours are as good forgives a millimetre.
    """

    def __init__(
        self, predict: Predict, sensing: SensingConfig, radius_m: float, smoothing_m: float
    ) -> None:
        self._predict = predict
        self._sensing = sensing
        self._radius_m = radius_m
        self._smoothing_m = smoothing_m

    def __call__(
        self, pictures: Sequence[DepthPicture], candidates: Candidates, /
    ) -> Float[np.ndarray, " k"]:
        """Predicted quality, smoothed."""
        views = [(picture.depth_m, picture.camera) for picture in pictures]
        cloud, seen = merged_sub_clouds(
            views, candidates.world_from_contact, self._sensing, self._radius_m
        )
        quality = np.asarray(self._predict(cloud, seen), dtype=np.float64)
        return smoothed(candidates, quality, self._smoothing_m)


def smoothed(
    candidates: Candidates, quality: Float[np.ndarray, " k"], within_m: float
) -> Float[np.ndarray, " k"]:
    """Mean over neighbours, weighted by exp(-(distance / within)^2); like approaches alone."""
    if within_m == 0.0 or len(quality) == 0:
        return quality
    place = candidates.world_from_contact[:, :3, 3]
    approach = candidates.world_from_contact[:, :3, 2]
    distance = np.linalg.norm(place[:, None] - place[None], axis=2)
    weight = np.exp(-((distance / within_m) ** 2)) * (approach @ approach.T > _LIKE_COSINE)
    return np.asarray((weight @ quality) / weight.sum(axis=1))


HIGHEST_BAND_M = 0.015
_ROUGH_M = 0.001


def flattest_at_the_top(
    pictures: Sequence[DepthPicture], candidates: Candidates, /
) -> Float[np.ndarray, " k"]:
    """The geometric picker: the flattest patch among those at the highest point.

    exp(-roughness over 1 mm) for candidates within 15 mm of the highest one, less than any of
    these for all others, the higher the better.
    """
    height = candidates.world_from_contact[:, 2, 3]
    below = height.max() - height
    flatness = np.exp(-candidates.roughness_m / _ROUGH_M)
    return np.where(below <= HIGHEST_BAND_M, 0.5 + 0.5 * flatness, 0.5 * np.exp(-below / 0.1))
