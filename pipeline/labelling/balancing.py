"""Balanced labels: which grasps the second round starts from, and which labels are kept.

Contacts drawn uniformly give few labels between a full seal and none. So a second round proposes
grasps near those with rare labels, and then a subset is kept whose histogram of q is flatter. Each
sample records both (``proposal`` and ``keep_probability``), so that a user can undo their effect by
weights.
"""

import numpy as np
from jaxtyping import Float, Int, Integer

from pipeline.labelling.sampling import Proposal

TENTHS = 10  # bins of q that labels are balanced over


def tenth_of(quality: Float[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
    """Index of the tenth of [0, 1] that each label lies in: 0 to 9; q = 1 is in the last."""
    return np.minimum((quality * TENTHS).astype(np.int64), TENTHS - 1)


def quality_histogram(quality: Float[np.ndarray, " n"]) -> Int[np.ndarray, " 10"]:
    """Number of labels in each tenth of [0, 1]."""
    return np.bincount(tenth_of(quality), minlength=TENTHS)


def draw_rare_grasps(
    quality: Float[np.ndarray, " n"], count: int, rng: np.random.Generator
) -> Int[np.ndarray, " count"]:
    """Draw ``count`` indices so that each tenth that has labels is equally likely."""
    tenths = tenth_of(quality)
    share = 1.0 / np.bincount(tenths, minlength=TENTHS)[tenths]
    return rng.choice(len(quality), size=count, p=share / share.sum())


def balance_labels(
    quality: Float[np.ndarray, " n"], wanted: int, balance: float, rng: np.random.Generator
) -> tuple[Int[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Choose a subset of labels with a flatter histogram.

    Parameters
    ----------
    quality
        q of every label, shape (n,).
    wanted
        Number of labels to keep; all where there are fewer.
    balance
        0 keeps the present proportions of the tenths; 1 keeps the same number of each tenth, as far
        as it has enough.
    rng
        Draws which labels of a tenth are kept.

    Returns
    -------
    Sorted indices of the kept labels, shape (k,), and for each the share of its tenth that was
    kept, shape (k,).
    """
    tenths = tenth_of(quality)
    there = np.bincount(tenths, minlength=TENTHS)
    wanted = min(wanted, len(quality))
    quota = _quota(there, wanted, balance)
    kept = np.concatenate(
        [
            rng.permutation(np.flatnonzero(tenths == tenth))[: quota[tenth]]
            for tenth in range(TENTHS)
        ]
    )
    kept.sort()
    return kept, (quota / np.maximum(there, 1))[tenths[kept]]


def proposal_weights(
    proposal: Integer[np.ndarray, " n"], keep_probability: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Weights that undo the sampler's bias.

    A mean over kept grasps with these weights estimates the mean over grasps as S-1.04 - S-1.06
    draw them.

    Parameters
    ----------
    proposal
        Values of `Proposal`, shape (n,).
    keep_probability
        Share of each grasp's tenth that was kept, shape (n,).

    Returns
    -------
    Number of first-round grasps that each grasp stands for, shape (n,): one over its probability,
    and 0 for grasps of the second round.
    """
    first = proposal != Proposal.NEARBY
    return np.where(first, 1.0 / np.maximum(keep_probability, 1e-12), 0.0)


def _quota(there: Int[np.ndarray, " 10"], wanted: int, balance: float) -> Int[np.ndarray, " 10"]:
    """Number of labels to keep of each tenth: between proportional (0) and flat (1) by ``balance``.

    Parameters
    ----------
    there
        Number of labels in each tenth, shape (10,).
    wanted
        Number to keep in all, at most as many as there are.
    balance
        Blend of both.

    Returns
    -------
    Numbers that sum to ``wanted``, none greater than ``there``, shape (10,).
    """
    total = max(int(there.sum()), 1)
    flat = _level(there, wanted)
    ideal = (1.0 - balance) * wanted * there / total + balance * flat
    quota = np.minimum(np.floor(ideal).astype(np.int64), there)
    # Rounding down left a few: give them to the largest remainders, the lower tenth on a tie.
    for tenth in np.argsort(-(ideal - quota), kind="stable"):
        quota[tenth] += int(quota.sum() < wanted and quota[tenth] < there[tenth])
    while quota.sum() < wanted:
        quota[int(np.argmax(there - quota))] += 1
    return np.asarray(quota)


def _level(there: Int[np.ndarray, " 10"], wanted: int) -> Float[np.ndarray, " 10"]:
    """min(there, height) for the one height at which these sum to ``wanted``, shape (10,)."""
    low, high = 0.0, float(there.max(initial=0))
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if np.minimum(there, middle).sum() >= wanted else (middle, high)
    return np.asarray(np.minimum(there, high))
