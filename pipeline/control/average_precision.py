"""Average precision of ranked contacts, as SuctionNet-1Billion defines it.

Cao, Fang, Liu, Lu, «SuctionNet-1Billion: A Large-Scale Benchmark for Suction Grasping», IEEE
Robotics and Automation Letters 6(4), 2021, and its evaluation, graspnet/suctionnetAPI. Contacts of
one scene are thinned by non-maximum suppression, of each object the best ten are kept, and of those
the best fifty are judged. Precision at k is the share of good ones among the best k; where there
are fewer than k, what is missing counts as bad. AP_s is its mean over k from 1 to 50 where a
contact is good from a score s on, and AP the mean of AP_s over s = 0.2, 0.4, 0.6, 0.8. There the
score is seal times wrench of its own model; here it is q on the true surfaces.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.config.evaluation import PrecisionConfig


@dataclass(frozen=True)
class AveragePrecision:
    """How well contacts are ranked in one scene, or in the mean over several.

    Attributes
    ----------
    by_threshold
        s → AP_s, in [0, 1].
    judged
        Contacts that were judged, at most ``top``.
    """

    by_threshold: dict[float, float]
    judged: float

    @property
    def mean(self) -> float:
        """AP: the mean over all thresholds."""
        return float(np.mean(list(self.by_threshold.values())))


def average_precision(
    places_m: Float[np.ndarray, "k 3"],
    object_index: Int[np.ndarray, " k"],
    value: Float[np.ndarray, " k"],
    quality: Float[np.ndarray, " k"],
    config: PrecisionConfig,
) -> AveragePrecision:
    """Rank the contacts of one scene by a value, and judge the best by their q.

    Parameters
    ----------
    places_m
        Contacts in WCS [m], shape (k, 3).
    object_index
        The object that each lies on, shape (k,).
    value
        What they are ranked by, the best highest, shape (k,); of equals the first comes first.
    quality
        q of each on the true surfaces, shape (k,).
    config
        Distance of the suppression, numbers kept, thresholds.

    Returns
    -------
    AP_s of each threshold.
    """
    kept = best_of_each(object_index, suppress_near(places_m, value, config.apart_m), config)
    ranked = quality[kept[: config.top]]
    return AveragePrecision(
        {
            threshold: float(precision_by_rank(ranked >= threshold, config.top).mean())
            for threshold in config.thresholds
        },
        float(len(ranked)),
    )


def suppress_near(
    places_m: Float[np.ndarray, "k 3"], value: Float[np.ndarray, " k"], within_m: float
) -> Int[np.ndarray, " j"]:
    """Non-maximum suppression: a contact is left out where a better one that is kept is near.

    Parameters
    ----------
    places_m
        Contacts [m], shape (k, 3).
    value
        The best highest, shape (k,); of equals the first counts as better.
    within_m
        Nearer than this is near [m]. Approaches do not count: SuctionNet suppresses within 181°.

    Returns
    -------
    Indices of those that are kept, the best first.
    """
    kept: list[int] = []
    for index in np.argsort(-value, kind="stable").tolist():
        away_m = np.linalg.norm(places_m[kept] - places_m[index], axis=1)
        if not (away_m < within_m).any():
            kept.append(index)
    return np.array(kept, dtype=np.int64)


def best_of_each(
    object_index: Int[np.ndarray, " k"], ranked: Int[np.ndarray, " j"], config: PrecisionConfig
) -> Int[np.ndarray, " i"]:
    """Keep the best contacts of every object.

    Parameters
    ----------
    object_index
        The object that each of k contacts lies on, shape (k,).
    ranked
        Indices of contacts, the best first, shape (j,).
    config
        How many of each object.

    Returns
    -------
    Those that are kept, in the same order.
    """
    taken: dict[int, int] = {}
    kept = []
    for index in ranked.tolist():
        of = int(object_index[index])
        taken[of] = taken.get(of, 0) + 1
        if taken[of] <= config.most_an_object:
            kept.append(index)
    return np.array(kept, dtype=np.int64)


def precision_by_rank(good: Bool[np.ndarray, " j"], top: int) -> Float[np.ndarray, " top"]:
    """Share of good ones among the best k, for k from 1 to ``top``; missing ones are bad.

    Parameters
    ----------
    good
        Whether each is good, the best first, shape (j,), j at most ``top``.
    top
        Greatest k.

    Returns
    -------
    The shares, shape (top,).
    """
    padded = np.zeros(top, dtype=np.float64)
    padded[: len(good)] = good
    return np.asarray(np.cumsum(padded) / np.arange(1, top + 1))


def mean_over_scenes(scenes: Sequence[AveragePrecision]) -> AveragePrecision:
    """The mean over scenes, at least one; every scene counts alike."""
    return AveragePrecision(
        {
            threshold: float(np.mean([scene.by_threshold[threshold] for scene in scenes]))
            for threshold in scenes[0].by_threshold
        },
        float(np.mean([scene.judged for scene in scenes])),
    )
