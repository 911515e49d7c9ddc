"""Values by which candidates are ranked: the network's q-hat, or the geometry of a baseline."""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from jaxtyping import Bool, Float

from pipeline.config.grasps import PadConfig, SensingConfig
from pipeline.config.policy import PickerConfig, PolicyConfig
from pipeline.control.candidates import Candidates
from pipeline.control.cloud import DepthPicture
from pipeline.sensing.sub_cloud import merged_sub_clouds

Predict = Callable[
    [Float[np.ndarray, "n g g 3"], Bool[np.ndarray, "n g g"]], Float[np.ndarray, " n"]
]
"""Function of sub clouds in units of r_G and of their seen cells; returns q-hat."""


def join_predictions(network: Predict, analytic: Predict, analytic_share: float) -> Predict:
    """The weighted mean of two q-hats: they err at different grasps.

    Parameters
    ----------
    network
        The network's q-hat.
    analytic
        The analytic baseline's.
    analytic_share
        Weight of the baseline in [0, 1]; the network has the rest.

    Returns
    -------
    The joined q-hat.
    """

    def predict(
        cloud: Float[np.ndarray, "n g g 3"], seen: Bool[np.ndarray, "n g g"]
    ) -> Float[np.ndarray, " n"]:
        told = np.asarray(network(cloud, seen), dtype=np.float64)
        return told + analytic_share * (np.asarray(analytic(cloud, seen)) - told)

    return predict


class Ranking(Protocol):
    """A value in [0, 1] for every candidate, the best highest."""

    def __call__(
        self, pictures: Sequence[DepthPicture], candidates: Candidates, /
    ) -> Float[np.ndarray, " k"]: ...


class NetworkRanking:
    """q-hat of GA-CNN, all candidates in one batch, on the sub cloud of all pictures.

    Each candidate's value is then averaged with its neighbours': the largest of many noisy values
    is too high by chance, and a pose whose neighbours are as good tolerates a millimetre of error.
    """

    def __init__(
        self, predict: Predict, sensing: SensingConfig, radius_m: float, policy: PolicyConfig
    ) -> None:
        self._predict = predict
        self._sensing = sensing
        self._radius_m = radius_m
        self._policy = policy

    def __call__(
        self, pictures: Sequence[DepthPicture], candidates: Candidates, /
    ) -> Float[np.ndarray, " k"]:
        """Predicted quality, smoothed."""
        views = [(picture.depth_m, picture.camera) for picture in pictures]
        cloud, seen = merged_sub_clouds(
            views, candidates.world_from_contact, self._sensing, self._radius_m
        )
        quality = np.asarray(self._predict(cloud, seen), dtype=np.float64)
        return smooth_quality(
            candidates, quality, self._policy.smoothing_m, self._policy.smoothing_tilt_rad
        )


def smooth_quality(
    candidates: Candidates,
    quality: Float[np.ndarray, " k"],
    within_m: float,
    within_rad: float,
) -> Float[np.ndarray, " k"]:
    """Average the quality of each candidate with that of its neighbours.

    The weights are exp(-(distance / within_m)^2).

    Parameters
    ----------
    candidates
        The k candidates.
    quality
        Quality of each, shape (k,).
    within_m
        Radius of the average [m]; 0: no average.
    within_rad
        Only candidates whose approaches differ by less than this angle count [rad].

    Returns
    -------
    The averages, shape (k,).
    """
    if within_m == 0.0 or len(quality) == 0:
        return quality
    place = candidates.world_from_contact[:, :3, 3]
    approach = candidates.world_from_contact[:, :3, 2]
    distance = np.linalg.norm(place[:, None] - place[None], axis=2)
    weight = np.exp(-((distance / within_m) ** 2)) * (approach @ approach.T > np.cos(within_rad))
    return np.asarray((weight @ quality) / weight.sum(axis=1))


class GeometricRanking:
    """The geometric picker: the flattest place for the pad among those at the highest point.

    Flatness is exp(-roughness / `roughness_m`) times the share of the pad's sealing region, r_v,
    that the pictures show. Roughness is the root mean square height of that region about its mean,
    along the approach. Candidates within `band_m` of the highest one are ranked by flatness. All
    others have lower values, which fall with their distance below the highest one.
    """

    def __init__(self, config: PickerConfig, sensing: SensingConfig, pad: PadConfig) -> None:
        self._config = config
        self._sensing = sensing
        self._radius_m = pad.radius_m
        middle = (np.arange(sensing.grid_cells) + 0.5) / sensing.grid_cells - 0.5
        away_m = sensing.grid_side_m * np.hypot(middle[:, None], middle[None])
        self._region = away_m <= pad.seal_radius_m

    def __call__(
        self, pictures: Sequence[DepthPicture], candidates: Candidates, /
    ) -> Float[np.ndarray, " k"]:
        """A value in [0, 1] for every candidate."""
        height = candidates.world_from_contact[:, 2, 3]
        below = height.max() - height
        views = [(picture.depth_m, picture.camera) for picture in pictures]
        cloud, seen = merged_sub_clouds(
            views, candidates.world_from_contact, self._sensing, self._radius_m
        )
        flatness = self._flatness(self._radius_m * cloud[..., 2].astype(np.float64), seen)
        at_the_top = below <= self._config.band_m
        return np.where(
            at_the_top, 0.5 + 0.5 * flatness, 0.5 * np.exp(-below / self._config.fall_m)
        )

    def _flatness(
        self, height_m: Float[np.ndarray, "k g g"], seen: Bool[np.ndarray, "k g g"]
    ) -> Float[np.ndarray, " k"]:
        """Of the sealing region, in [0, 1]; 0 where nothing of it is seen."""
        heights, there = height_m[:, self._region], seen[:, self._region]
        count = np.maximum(there.sum(axis=1), 1)
        mean = (heights * there).sum(axis=1) / count
        roughness_m = np.sqrt(((heights - mean[:, None]) ** 2 * there).sum(axis=1) / count)
        share = there.mean(axis=1)
        return np.asarray(share * np.exp(-roughness_m / self._config.roughness_m))
