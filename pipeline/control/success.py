"""Success rates with their uncertainty."""

from scipy.stats import binomtest

CONFIDENCE = 0.95


def success_rate(lifted: int, attempts: int) -> tuple[float, float, float]:
    """Rate and its 95 % Wilson interval; (0, 0, 1) without an attempt."""
    if attempts == 0:
        return 0.0, 0.0, 1.0
    interval = binomtest(lifted, attempts).proportion_ci(CONFIDENCE, method="wilson")
    return lifted / attempts, float(interval.low), float(interval.high)
