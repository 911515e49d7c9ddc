"""Share of a stage's time that went into the work that limits it."""

import time


class BusyClock:
    """Time spent in one kind of work, over wall time; counted from the end of the first piece.

    The first piece is left out, because it holds what is done once: a renderer compiles its
    shaders. Where several processes do that work, the share is the mean number of busy ones.
    """

    def __init__(self) -> None:
        self._since: float | None = None
        self._busy_s = 0.0

    def book(self, busy_s: float) -> None:
        """Book a piece of the work that has just ended, and the seconds it took."""
        if self._since is None:
            self._since = time.perf_counter()
        else:
            self._busy_s += busy_s

    def share(self) -> float | None:
        """Busy time over wall time until now; None before a second piece."""
        if self._since is None or self._busy_s == 0.0:
            return None
        return round(self._busy_s / (time.perf_counter() - self._since), 3)
