"""A progress bar for loops that take more than a few seconds."""

import sys
from collections.abc import Iterable
from typing import TypeVar

from tqdm import tqdm

T = TypeVar("T")

QUIET_INTERVAL_S = 10.0  # a log file gets a line now and then, a screen gets a bar


def progress(items: Iterable[T], total: int, what: str, unit: str) -> Iterable[T]:
    """Yield the items and show progress, rate and remaining time on standard error.

    Parameters
    ----------
    items
        What is passed through.
    total
        Number of items.
    what
        Name of the work.
    unit
        Name of one item.

    Returns
    -------
    The same items, in their order.
    """
    on_screen = sys.stderr.isatty()
    return tqdm(
        items,
        total=total,
        desc=what,
        unit=unit,
        file=sys.stderr,
        dynamic_ncols=on_screen,
        mininterval=0.2 if on_screen else QUIET_INTERVAL_S,
        smoothing=0.1,
    )
