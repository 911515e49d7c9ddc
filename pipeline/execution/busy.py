"""Share of a stage's time that went into the work that limits it."""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class BusyClock:
    """Time spent in one kind of work, over wall time; counted from the end of the first piece.

    The first piece is left out, because it holds what is done once: a renderer compiles its
    shaders.
    """

    def __init__(self) -> None:
        self._since: float | None = None
        self._busy_s = 0.0

    @contextmanager
    def busy(self) -> Iterator[None]:
        """Time the block as one piece of the work."""
        started = time.perf_counter()
        yield
        ended = time.perf_counter()
        if self._since is None:
            self._since = ended
        else:
            self._busy_s += ended - started

    def share(self) -> float | None:
        """Busy time over wall time until now; None before a second piece."""
        if self._since is None or self._busy_s == 0.0:
            return None
        return round(self._busy_s / (time.perf_counter() - self._since), 3)
