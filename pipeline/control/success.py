"""Success rates with their uncertainty, and whether one policy beats another."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest, fisher_exact, permutation_test

CONFIDENCE = 0.95  # of the intervals that tables and summaries call 95 %
RESAMPLES = 99_999  # p is told to 1 in 100 000


def success_rate(lifted: int, attempts: int) -> tuple[float, float, float]:
    """Rate and its 95 % Wilson interval; (0, 0, 1) without an attempt."""
    if attempts == 0:
        return 0.0, 0.0, 1.0
    interval = binomtest(lifted, attempts).proportion_ci(CONFIDENCE, method="wilson")
    return lifted / attempts, float(interval.low), float(interval.high)


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
