"""What a Ray cluster's driver spends on short items, in tasks of their own and in shared ones."""

import itertools
import time
from collections.abc import Iterator
from unittest.mock import patch

from pipeline.execution import ray_executor, run_in_order


def driver_ms(pause_s: float, count: int, shared: bool) -> float:
    """The driver's processor time an item on the running cluster [ms].

    Parameters
    ----------
    pause_s
        How long each item takes [s]; a node does nothing in it.
    count
        Items that are counted; one more comes before them.
    shared
        Whether short items share tasks, as they do in stages.

    Returns
    -------
    The time, with what passes while the driver waits.
    """
    most = ray_executor.MOST_ITEMS if shared else 1
    with patch.object(ray_executor, "MOST_ITEMS", most):
        results: Iterator[float] = run_in_order(
            pause, itertools.repeat(pause_s, count + 1), 1, "ray"
        )
        next(results)  # by now the driver is connected
        began = time.process_time()
        made = sum(1 for _ in results)
        return 1e3 * (time.process_time() - began) / made


def pause(seconds: float) -> float:
    """An item: wait."""
    time.sleep(seconds)
    return seconds


def table(count: int) -> str:
    """Items that do nothing and items of 20 ms, alone and shared, as Markdown."""
    rows = ["| an item takes | in a task of its own | shared |", "|-|-|-|"]
    for pause_s in (0.0, 0.02):
        alone, together = (driver_ms(pause_s, count, shared) for shared in (False, True))
        rows.append(f"| {1e3 * pause_s:g} ms | {alone:.2f} ms | {together:.2f} ms |")
    return "\n".join(rows)
