"""What recording costs a stage: seconds spent on it in this process, whichever thread."""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Seconds spent in the blocks it was held to; blocks do not nest."""

    def __init__(self) -> None:
        self.seconds = 0.0

    @contextmanager
    def running(self) -> Iterator[None]:
        """Around one block."""
        started = time.perf_counter()
        try:
            yield
        finally:
            self.seconds += time.perf_counter() - started


LARGEST_MB = 200  # what a viewer still opens in seconds; [recording] of run.toml keeps below it

# A process runs one stage, which has one recording.
recording_cost = Stopwatch()
