"""How far a score of grasps, q or another, says what the referee finds them to bear."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.stats import rankdata, spearmanr

from pipeline.config.agreement import AgreementConfig

FEWEST_OF_AN_OBJECT = 20  # a rank correlation of fewer grasps is mostly chance


def spearman(score: Float[np.ndarray, " n"], borne_n: Float[np.ndarray, " n"]) -> float | None:
    """Rank correlation; None where either is constant or there are under three."""
    if len(score) < 3 or np.ptp(score) == 0 or np.ptp(borne_n) == 0:
        return None
    return float(spearmanr(score, borne_n).statistic)


def weighted_spearman(
    score: Float[np.ndarray, " n"],
    borne_n: Float[np.ndarray, " n"],
    weights: Float[np.ndarray, " n"],
) -> float | None:
    """`spearman` with each grasp counted as often as its weight says."""
    if spearman(score, borne_n) is None:
        return None
    ranks = []
    for values in (score, borne_n):
        _, group = np.unique(values, return_inverse=True)
        held = np.bincount(group, weights)
        ranks.append((np.cumsum(held) - held / 2)[group])
    covariance = np.cov(ranks, aweights=weights)
    return float(covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1]))


def spearman_within(
    score: Float[np.ndarray, " n"], borne_n: Float[np.ndarray, " n"], objects: Int[np.ndarray, " n"]
) -> float | None:
    """Median over objects of `spearman` among the grasps of one; None without one of enough."""
    found = []
    for one in np.unique(objects):
        own = objects == one
        if own.sum() >= FEWEST_OF_AN_OBJECT:
            found.append(spearman(score[own], borne_n[own]))
    known = [value for value in found if value is not None]
    return float(np.median(known)) if known else None


def auroc(score: Float[np.ndarray, " n"], holds: Bool[np.ndarray, " n"]) -> float | None:
    """Chance that a grasp that holds scores over one that does not, ties half; None without both.

    Parameters
    ----------
    score
        Shape (n,).
    holds
        Shape (n,).

    Returns
    -------
    In [0, 1], or None.
    """
    good = int(holds.sum())
    bad = len(holds) - good
    if not good or not bad:
        return None
    ranks = rankdata(score)
    return float((ranks[holds].sum() - good * (good + 1) / 2) / (good * bad))


def agreement(
    score: Float[np.ndarray, " n"],
    borne_n: Float[np.ndarray, " n"],
    objects: Int[np.ndarray, " n"],
    weights: Float[np.ndarray, " n"],
    loads_n: Sequence[float],
    resamples: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Figures of one score.

    Parameters
    ----------
    score
        Shape (n,); NaN where a grasp has none: it is left out.
    borne_n
        What the referee finds, shape (n,) [N].
    objects
        Index of each grasp's object, shape (n,).
    weights
        How many labelled grasps each stands for, shape (n,).
    loads_n
        Weights to be borne [N].
    resamples
        Bootstrap samples over objects, for the 95 % interval of Spearman's coefficient.
    rng
        Draws them.

    Returns
    -------
    ``grasps``, ``spearman``, ``spearman_interval``, ``auroc`` by load; ``spearman_as_labelled``
    with the weights, and ``spearman_within_objects``.
    """
    known = np.isfinite(score)
    score, borne_n, objects, weights = score[known], borne_n[known], objects[known], weights[known]
    found = []
    members = [np.flatnonzero(objects == one) for one in np.unique(objects)]
    for _ in range(resamples if members else 0):
        rows = np.concatenate([members[i] for i in rng.integers(len(members), size=len(members))])
        value = spearman(score[rows], borne_n[rows])
        if value is not None:
            found.append(value)
    return {
        "grasps": len(score),
        "spearman": spearman(score, borne_n),
        "spearman_interval": np.quantile(found, [0.025, 0.975]).tolist() if found else None,
        "spearman_as_labelled": weighted_spearman(score, borne_n, weights),
        "spearman_within_objects": spearman_within(score, borne_n, objects),
        "auroc": {f"{load:g}": auroc(score, borne_n >= load) for load in loads_n},
    }


def figures_of(
    scores: Mapping[str, Float[np.ndarray, " n"]],
    found: Mapping[str, Float[np.ndarray, " n"]],
    objects: Int[np.ndarray, " n"],
    weights: Float[np.ndarray, " n"],
    config: AgreementConfig,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Headline figures of all scores.

    Parameters
    ----------
    scores
        By name, "q" among them, each of shape (n,).
    found
        ``borne_n`` and ``straight_n`` of `judging.Judged`, shape (n,) [N].
    objects
        Index of each grasp's object, shape (n,).
    weights
        How many labelled grasps each stands for, shape (n,).
    config
        Loads, and how many bootstrap samples.
    rng
        Draws them.

    Returns
    -------
    ``grasps``, ``objects``, ``spearman`` and ``auroc`` of q; ``scores`` and ``straight_pull``
    with `agreement` of every score; ``by_tenth`` with `borne_by_tenth`.
    """
    borne_n = found["borne_n"]
    against = {
        load: {
            name: agreement(
                score, found[load], objects, weights, config.loads_n, config.resamples, rng
            )
            for name, score in scores.items()
        }
        for load in ("borne_n", "straight_n")
    }
    return {
        "grasps": len(objects),
        "objects": len(np.unique(objects)),
        "spearman": against["borne_n"]["q"]["spearman"],
        "auroc": against["borne_n"]["q"]["auroc"],
        "scores": against["borne_n"],
        "straight_pull": against["straight_n"],
        "by_tenth": {name: borne_by_tenth(score, borne_n) for name, score in scores.items()},
    }


def varied(
    scores: Mapping[str, Float[np.ndarray, " n"]],
    as_configured_n: Float[np.ndarray, " n"],
    borne_n: Mapping[str, Float[np.ndarray, " n"]],
    config: AgreementConfig,
) -> dict[str, Any]:
    """`agreement` of every score as configured, and under each variation; the median beside it.

    Parameters
    ----------
    scores
        By name, each of shape (n,).
    as_configured_n
        What each grasp bears as configured, shape (n,) [N].
    borne_n
        Variation → what each grasp bears with it, shape (n,) [N].
    config
        Loads.

    Returns
    -------
    By variation: ``median_borne_n``, and ``scores`` with the figures of each.
    """
    each = {"as configured": as_configured_n, **borne_n}
    every, even = np.zeros(len(as_configured_n), dtype=np.int64), np.ones(len(as_configured_n))
    none = np.random.default_rng(0)  # draws nothing: no interval is asked for
    return {
        name: {
            "median_borne_n": float(np.median(values)) if len(values) else None,
            "scores": {
                score: agreement(predicted, values, every, even, config.loads_n, 0, none)
                for score, predicted in scores.items()
            },
        }
        for name, values in each.items()
    }


def borne_by_tenth(
    score: Float[np.ndarray, " n"], borne_n: Float[np.ndarray, " n"]
) -> list[dict[str, Any]]:
    """What grasps of each tenth of a score in [0, 1] bear: count, and quartiles in newtons."""
    known = np.isfinite(score)
    tenth = np.clip((10 * score[known]).astype(np.int64), 0, 9)
    rows = []
    for number in range(10):
        own = borne_n[known][tenth == number]
        quartiles = np.quantile(own, [0.25, 0.5, 0.75]).tolist() if len(own) else [None] * 3
        rows.append({"tenth": number, "count": len(own), "quartiles_n": quartiles})
    return rows


def most_apart(
    score: Float[np.ndarray, " n"], borne_n: Float[np.ndarray, " n"], wanted: int
) -> Int[np.ndarray, " k"]:
    """Where score and referee disagree most by rank: half overrated first, then underrated."""
    apart = rankdata(score) - rankdata(borne_n)
    order = np.argsort(-apart, kind="stable")
    half = min(wanted, len(order)) // 2
    return np.concatenate([order[:half], order[::-1][:half]])
