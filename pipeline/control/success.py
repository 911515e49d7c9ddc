"""Success rates with their uncertainty, and whether one policy beats another."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest, fisher_exact, permutation_test

CONFIDENCE = 0.95  # of the intervals that tables and summaries call 95 %
RESAMPLES = 99_999  # p is told to 1 in 100 000
RATE_RESAMPLES = 2000  # the ends of an interval move by a few thousandths


def success_rate(lifted: int, attempts: int) -> tuple[float, float, float]:
    """Rate and its 95 % Wilson interval; (0, 0, 1) without an attempt."""
    if attempts == 0:
        return 0.0, 0.0, 1.0
    interval = binomtest(lifted, attempts).proportion_ci(CONFIDENCE, method="wilson")
    return lifted / attempts, float(interval.low), float(interval.high)


def bootstrap_interval(
    lifted: Sequence[bool], clutters: Sequence[str], objects: Sequence[str]
) -> tuple[float, float]:
    """95 % interval of a success rate when clutters and objects are drawn anew, each by itself.

    An attempt counts as often as its clutter and its object were drawn together (Owen's pigeonhole
    bootstrap): attempts at one clutter, or on one object, are not independent.

    Parameters
    ----------
    lifted
        Whether each attempt lifted its object.
    clutters
        Clutter of each attempt.
    objects
        Object of each attempt; those that met none, "", are drawn with their clutter alone.

    Returns
    -------
    Its ends in [0, 1]; (0, 1) without an attempt.
    """
    if not lifted:
        return 0.0, 1.0
    rng, weights = np.random.default_rng(0), np.ones((RATE_RESAMPLES, len(lifted)))
    for groups in (clutters, objects):
        names, index = np.unique(groups, return_inverse=True)
        drawn = rng.multinomial(len(names), np.full(len(names), 1 / len(names)), RATE_RESAMPLES)
        weights *= np.where(np.array(groups) == "", 1, drawn[:, index])
    total = weights.sum(axis=1)
    rates = (weights @ np.array(lifted, dtype=float))[total > 0] / total[total > 0]
    low, high = np.quantile(rates, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return float(low), float(high)


@dataclass(frozen=True)
class Outcome:
    """Attempts of one policy at one clutter."""

    lifted: int
    attempts: int

    @property
    def rate(self) -> float:
        """Share of attempts that lifted; 0 without one."""
        return self.lifted / self.attempts if self.attempts else 0.0


@dataclass(frozen=True)
class Advantage:
    """How two policies compare on the same clutters; rates are means over clutters.

    Attributes
    ----------
    p_paired
        Two-sided, of the mean difference under exchange of the two policies within each clutter
        (a permutation test): attempts at one clutter are not independent, clutters are.
    p_fisher
        Fisher's exact test on all attempts, as if they were.
    """

    rate: float
    baseline_rate: float
    p_paired: float
    p_fisher: float


def advantage(ours: Sequence[Outcome], baseline: Sequence[Outcome]) -> Advantage:
    """Compare two policies; the outcomes are paired by clutter, at least one."""
    rates = np.array([outcome.rate for outcome in ours])
    others = np.array([outcome.rate for outcome in baseline])
    if len(rates) > 1 and np.any(rates != others):
        p_paired = permutation_test(
            (rates, others),
            lambda x, y, axis: np.mean(x - y, axis=axis),
            permutation_type="samples",
            vectorized=True,
            n_resamples=RESAMPLES,
            rng=np.random.default_rng(0),
        ).pvalue
    else:
        p_paired = 1.0
    table = [
        [sum(o.lifted for o in side), sum(o.attempts - o.lifted for o in side)]
        for side in (ours, baseline)
    ]
    return Advantage(
        float(rates.mean()),
        float(others.mean()),
        float(p_paired),
        float(fisher_exact(table).pvalue),
    )
