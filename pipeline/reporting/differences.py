"""How much two runs differ, and how much of it chance alone would give.

Grasps of one clutter are not independent, so clutters are what is drawn and exchanged here.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Integer, Shaped
from scipy.stats import permutation_test

BINS = 100  # of q in [0, 1]: distances are exact to a hundredth of the range
RESAMPLES = 2000  # p and the ends of intervals move by about a hundredth
PAIRED_RESAMPLES = 9999  # p of paired objects is told to 1 in 10 000
CHANCE = 0.05  # what is rarer under chance alone is called a difference; the usual level


@dataclass(frozen=True)
class Labels:
    """Labels of one run; arrays of one length n.

    Attributes
    ----------
    quality
        q, shape (n,).
    clutter
        Number of the clutter, shape (n,).
    groups
        Name of a grouping ("class", "level", "object") → the group of each grasp, shape (n,).
    """

    quality: Float[np.ndarray, " n"]
    clutter: Integer[np.ndarray, " n"]
    groups: Mapping[str, Shaped[np.ndarray, " n"]]


@dataclass(frozen=True)
class Distance:
    """How far two distributions of labels are apart.

    Attributes
    ----------
    group
        What was compared, as "class basic"; "all" for everything.
    grasps
        Of either side.
    mean
        Mean q of either side.
    distance
        Wasserstein-1 distance of the distributions of q, in units of q.
    interval
        Where 95 % of the distances lie when clutters of either side are drawn anew. It begins
        above 0 for equal sides, since drawing anew sets them apart too.
    by_chance
        Distance that exchanging clutters between the sides stays under in 95 of 100 cases; None
        where a side has fewer than two clutters.
    p
        Share of such exchanges that give at least this distance; None likewise.
    """

    group: str
    grasps: tuple[int, int]
    mean: tuple[float, float]
    distance: float
    interval: tuple[float, float]
    by_chance: float | None
    p: float | None

    @property
    def is_chance(self) -> bool:
        """Whether chance alone explains it, as far as these clutters tell."""
        return self.p is None or self.p > CHANCE


@dataclass(frozen=True)
class ErrorChange:
    """How the mean error over the objects that both runs tested changed.

    Attributes
    ----------
    objects
        Tested by both.
    mean
        Mean over them of mean |q̂ − q|, of either side.
    p
        Of the mean difference, under exchange of the sides object by object; None of fewer than
        two objects.
    """

    objects: int
    mean: tuple[float, float]
    p: float | None


def label_distances(
    ours: Labels, theirs: Labels, rng_of: Callable[[str], np.random.Generator]
) -> list[Distance]:
    """Compare the labels of two runs: all of them, then group by group.

    Parameters
    ----------
    ours
        The labels of either run.
    theirs
        The same of the other run.
    rng_of
        Gives the generator for a group's name.

    Returns
    -------
    One entry for all, and one for each group that both have.
    """
    found = [label_distance("all", ours, theirs, rng_of("all"))]
    for grouping in ours.groups:
        mine, other = ours.groups[grouping], theirs.groups[grouping]
        for value in sorted(set(mine.tolist()) & set(other.tolist())):
            name = f"{grouping} {value}"
            sides = (part_of(ours, mine == value), part_of(theirs, other == value))
            found.append(label_distance(name, *sides, rng_of(name)))
    return found


def part_of(labels: Labels, wanted: Shaped[np.ndarray, " n"]) -> Labels:
    """Some of the labels, their groups left behind."""
    return Labels(labels.quality[wanted], labels.clutter[wanted], {})


def label_distance(group: str, ours: Labels, theirs: Labels, rng: np.random.Generator) -> Distance:
    """Compare two sets of labels.

    Parameters
    ----------
    group
        What is compared.
    ours
        Labels, at least one each.
    theirs
        The same of the other run.
    rng
        Draws and exchanges clutters.

    Returns
    -------
    The distance, and what chance gives.
    """
    mine, other = counts_by_clutter(ours), counts_by_clutter(theirs)
    distance = float(distances(mine.sum(axis=0)[None], other.sum(axis=0)[None])[0])
    drawn = distances(_drawn_anew(mine, rng), _drawn_anew(other, rng))
    low, high = np.quantile(drawn, [0.025, 0.975])
    by_chance = p = None
    if min(len(mine), len(other)) > 1:
        both = np.concatenate([mine, other])
        order = rng.permuted(np.tile(np.arange(len(both)), (RESAMPLES, 1)), axis=1)
        first = np.zeros((RESAMPLES, len(both)))
        np.put_along_axis(first, order[:, : len(mine)], 1.0, axis=1)
        exchanged = distances(first @ both, (1 - first) @ both)
        by_chance = float(np.quantile(exchanged, 0.95))
        # The arrangement that was found counts as one of those that chance may give.
        p = float((1 + np.sum(exchanged >= distance - 1e-12)) / (1 + RESAMPLES))
    return Distance(
        group,
        (len(ours.quality), len(theirs.quality)),
        (float(ours.quality.mean()), float(theirs.quality.mean())),
        distance,
        (float(low), float(high)),
        by_chance,
        p,
    )


def counts_by_clutter(labels: Labels) -> Float[np.ndarray, "clutters bins"]:
    """How many labels of each clutter lie in each bin of q, shape (clutters, BINS)."""
    clutters, index = np.unique(labels.clutter, return_inverse=True)
    bins = np.clip((labels.quality * BINS).astype(np.int64), 0, BINS - 1)
    counts = np.zeros((len(clutters), BINS))
    np.add.at(counts, (index, bins), 1.0)
    return counts


def distances(
    ours: Float[np.ndarray, "n bins"], theirs: Float[np.ndarray, "n bins"]
) -> Float[np.ndarray, " n"]:
    """Wasserstein-1 distance of pairs of histograms over [0, 1], each made to sum to one.

    Parameters
    ----------
    ours
        Counts by bin, shape (n, bins).
    theirs
        The same of the other run.

    Returns
    -------
    Area between the cumulative distributions, shape (n,).
    """
    cumulative = [
        np.cumsum(side, axis=1) / np.maximum(side.sum(axis=1, keepdims=True), 1e-300)
        for side in (ours, theirs)
    ]
    areas: np.ndarray = np.abs(cumulative[0] - cumulative[1]).mean(axis=1)
    return areas


def _drawn_anew(
    counts: Float[np.ndarray, "clutters bins"], rng: np.random.Generator
) -> Float[np.ndarray, "resamples bins"]:
    """Sums of as many clutters, drawn with repeats."""
    clutters = len(counts)
    times = rng.multinomial(clutters, np.full(clutters, 1 / clutters), RESAMPLES)
    sums: np.ndarray = times @ counts
    return sums


def error_change(ours: Sequence[float], theirs: Sequence[float]) -> ErrorChange | None:
    """Compare the errors on the same objects.

    Parameters
    ----------
    ours
        Mean |q̂ − q| of each object, in one order.
    theirs
        The same of the other run.

    Returns
    -------
    The change; None without an object.
    """
    if not len(ours):
        return None
    mine, other = np.asarray(ours), np.asarray(theirs)
    p = None
    if len(mine) > 1:
        p = 1.0
        if np.any(mine != other):
            p = float(
                permutation_test(
                    (mine, other),
                    lambda x, y, axis: np.mean(x - y, axis=axis),
                    permutation_type="samples",
                    vectorized=True,
                    n_resamples=PAIRED_RESAMPLES,
                    rng=np.random.default_rng(0),
                ).pvalue
            )
    return ErrorChange(len(mine), (float(mine.mean()), float(other.mean())), p)
