"""Processor time: unlike wall time it does not grow when other programs use the machine."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Adds up the processor time [s] of blocks of code; blocks must not be nested.

    Rerun encodes and writes in threads of its own. So the time of the whole process is counted for
    a block that only records, and the time of the calling thread for a block that also does other
    work.
    """

    def __init__(self) -> None:
        self.seconds = 0.0

    @contextmanager
    def running(self, whole_process: bool = False) -> Iterator[None]:
        """Count the processor time of a block.

        Parameters
        ----------
        whole_process
            Whether all threads are counted, or only the one that runs the block.

        Yields
        ------
        None
            Nothing.
        """
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
