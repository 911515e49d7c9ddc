"""Processor time, which does not depend on what else runs on the machine."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Sums the processor time of the blocks that run under it [s]; blocks must not be nested.

    Rerun encodes and writes in threads of its own. Where a block only records, the time of the
    whole process counts; where it also does a stage's work, the time of the thread that logs.
    """

    def __init__(self) -> None:
        self.seconds = 0.0

    @contextmanager
    def running(self, whole_process: bool = False) -> Iterator[None]:
        """Count one block: the time of this thread, or of the whole process."""
        clock = time.process_time if whole_process else time.thread_time
        started = clock()
        try:
            yield
        finally:
            self.seconds += clock() - started


def processor_time_s() -> float:
    """Processor time of this process and of its workers that have ended [s]."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system
