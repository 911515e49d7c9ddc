"""What recording costs a stage: processor time, which does not depend on what else runs."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Seconds of a thread's processor time spent in the blocks it was held to; no nesting."""

    def __init__(self) -> None:
        self.seconds = 0.0

    @contextmanager
    def running(self) -> Iterator[None]:
        """Around one block."""
        started = time.thread_time()
        try:
            yield
        finally:
            self.seconds += time.thread_time() - started


def processor_time_s() -> float:
    """Of this process and of its workers that have ended."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


LARGEST_MB = 200  # what a viewer still opens in seconds; [recording] of run.toml keeps below it

# A process runs one stage, which has one recording.
recording_cost = Stopwatch()
