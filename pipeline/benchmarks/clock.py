"""Timing: laps by name, and quantiles of repeated calls."""

import time
from collections import defaultdict
from collections.abc import Callable

import numpy as np


class Laps:
    """Seconds by phase: each ``lap(name)`` books the time since the last one.

    >>> laps = Laps()
    >>> drape(...)
    >>> laps.lap("draping")
    """

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self._last = time.perf_counter()

    def start(self) -> None:
        """Restart the clock without counting the time since the last lap."""
        self._last = time.perf_counter()

    def lap(self, phase: str) -> None:
        """Add the time since the last lap or start to ``phase``."""
        now = time.perf_counter()
        self.seconds[phase] += now - self._last
        self._last = now


def seconds_of(call: Callable[[], object], repeats: int) -> float:
    """Shortest time of ``repeats`` calls [s]: the one that other programs disturb least."""
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        call()
        times.append(time.perf_counter() - started)
    return min(times)


def quantiles_ms(seconds: list[float]) -> dict[str, float]:
    """p50, p95 and p99 in milliseconds."""
    p50, p95, p99 = 1e3 * np.quantile(seconds, [0.5, 0.95, 0.99])
    return {"p50": float(p50), "p95": float(p95), "p99": float(p99)}
