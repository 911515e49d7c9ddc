"""What recording costs a stage: processor time, which does not depend on what else runs.

Rerun encodes and writes in threads of its own. Where a stage records when its work is done, they
are counted, as the whole process is; amid the work it is the time of the thread that logs.
"""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Seconds of processor time spent in the blocks it was held to; no nesting."""

    def __init__(self) -> None:
        self.seconds = 0.0

    @contextmanager
    def running(self, whole_process: bool = False) -> Iterator[None]:
        """Around one block; counts this thread, or the whole process."""
        clock = time.process_time if whole_process else time.thread_time
        started = clock()
        try:
            yield
        finally:
            self.seconds += clock() - started


def processor_time_s() -> float:
    """Of this process and of its workers that have ended."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


LARGEST_MB = 200  # what a viewer still opens in seconds; [recording] of run.toml keeps below it

# A process runs one stage, which has one recording.
recording_cost = Stopwatch()
