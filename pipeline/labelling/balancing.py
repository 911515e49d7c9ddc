"""Labels that cover [0, 1]: which candidates to step from, and which to keep.

Contacts drawn uniformly give few labels between the full seal and none. The
sampler's answer is in two parts: propose near the rare ones, then keep a
subset whose histogram is nearer to flat. Both leave their mark in the sample
(``proposal`` and ``keep_probability``), so a user can weight them away.
"""

import numpy as np
from jaxtyping import Float, Int, Integer

from pipeline.labelling.sampling import Proposal

TENTHS = 10  # bins of q that labels are balanced over


def tenth_of(quality: Float[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
    """Which tenth of [0, 1] a label falls in: 0 to 9; q = 1 belongs to the last."""
    return np.minimum((quality * TENTHS).astype(np.int64), TENTHS - 1)


def quality_histogram(quality: Float[np.ndarray, " n"]) -> Int[np.ndarray, " 10"]:
    """Labels per tenth of [0, 1]."""
    return np.bincount(tenth_of(quality), minlength=TENTHS)


def rare_grasps(
    quality: Float[np.ndarray, " n"], count: int, rng: np.random.Generator
) -> Int[np.ndarray, " count"]:
    """``count`` indices, drawn so that every tenth that has labels is drawn equally often."""
    tenths = tenth_of(quality)
    share = 1.0 / np.bincount(tenths, minlength=TENTHS)[tenths]
    return rng.choice(len(quality), size=count, p=share / share.sum())


def flattened(
    quality: Float[np.ndarray, " n"], wanted: int, balance: float, rng: np.random.Generator
) -> tuple[Int[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """A subset of at most ``wanted`` labels with a flatter histogram, and how likely each was.

    balance : 0 keeps the proportions there are, 1 gives every tenth the same
    number as far as there are enough. Returns sorted indices and, for each, the
    probability with which its tenth was kept.
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


def first_proposals(
    proposal: Integer[np.ndarray, " n"], keep_probability: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """How many grasps of the first round each kept grasp stands for.

    With these weights a mean over kept grasps is one over grasps as S-1.04 - S-1.06 draw them:
    those proposed near rare labels weigh nothing, the others by how few of their tenth were kept.
    """
    first = proposal != Proposal.NEARBY
    return np.where(first, 1.0 / np.maximum(keep_probability, 1e-12), 0.0)


def _quota(there: Int[np.ndarray, " 10"], wanted: int, balance: float) -> Int[np.ndarray, " 10"]:
    """How many of each tenth to keep: the blend of proportional and flat, within what is there."""
    total = max(int(there.sum()), 1)
    flat = _level(there, wanted)
    ideal = (1.0 - balance) * wanted * there / total + balance * flat
    quota = np.minimum(np.floor(ideal).astype(np.int64), there)
    # Rounding left some over: largest remainder first, lowest tenth on a tie.
    for tenth in np.argsort(-(ideal - quota), kind="stable"):
        quota[tenth] += int(quota.sum() < wanted and quota[tenth] < there[tenth])
    while quota.sum() < wanted:
        quota[int(np.argmax(there - quota))] += 1
    return np.asarray(quota)


def _level(there: Int[np.ndarray, " 10"], wanted: int) -> Float[np.ndarray, " 10"]:
    """The flattest fill: min(there, height) with the height that sums to ``wanted``."""
    low, high = 0.0, float(there.max(initial=0))
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if np.minimum(there, middle).sum() >= wanted else (middle, high)
    return np.asarray(np.minimum(there, high))
