"""What the driver of a cluster spends itself, and how large a cluster it keeps busy with that."""

import time

NODE_CORES = 8  # of the nodes that are counted
LEAST_S = 1e-3  # a driver is never free, whatever its clock finds


class DriverClock:
    """Tells a driver's start and end from what each result costs it.

    Workers wait for the driver while it plans and while it ends a stage. How many of them it keeps
    busy is decided in between.

    Parameters
    ----------
    began
        Processor time of this process when the driver began [s].
    has_workers
        Whether items are made in other processes than this one.
    """

    def __init__(self, began: float, has_workers: bool) -> None:
        self._began, self._has_workers = began, has_workers
        self._first = self._last = began
        self._start_s = 0.0
        self._results = 0
        self._workers_s = 0.0
        self._here_s = 0.0
        self._made = 0

    def book(self, spent_s: float, made: int, here_s: float | None = None) -> None:
        """Note a result as it arrives.

        Parameters
        ----------
        spent_s
            Processor time of making it, wherever that was [s]; 0: it was there already.
        made
            How many grasps, or scenes, it holds.
        here_s
            What of that this process spent [s]; None: nothing where items have processes of their
            own, else all.
        """
        if here_s is None:
            here_s = 0.0 if self._has_workers else spent_s
        self._results += 1
        self._last = time.process_time()
        if self._results == 1:  # by now jobs are planned, processes started and given work
            self._first = self._last
            self._start_s = self._first - self._began - here_s
        elif spent_s:
            self._workers_s += spent_s
            self._here_s += here_s
            self._made += made

    def cost(self, of: str = "grasps") -> dict[str, float]:
        """What the driver spent until now: before, between and after the results.

        Parameters
        ----------
        of
            What is made.

        Returns
        -------
        `driver_start_s` until the first result and `driver_end_s` since the last one [s], and what
        `driver_cost` tells of the time between these two; nothing where no result came after the
        first.
        """
        cost = driver_cost(self._last - self._first - self._here_s, self._workers_s, self._made, of)
        if not cost:
            return {}
        end_s = time.process_time() - self._last
        return {
            "driver_start_s": round(self._start_s, 4),
            **cost,
            "driver_end_s": round(end_s, 4),
        }


def driver_cost(
    driver_s: float, workers_s: float, made: int, of: str = "grasps"
) -> dict[str, float]:
    """The driver's share of some work.

    Parameters
    ----------
    driver_s
        The driver's own processor time while results came [s].
    workers_s
        Processor time of the work items, wherever they were made [s].
    made
        How many grasps, or scenes, were made; none: nothing is said.
    of
        What is made.

    Returns
    -------
    The driver's seconds a thousand of them, and the number of nodes of eight cores whose results
    one driver can take: as many cores as workers' seconds go on one of the driver's.
    """
    if made == 0:
        return {}
    spent_s = max(driver_s, LEAST_S)
    return {
        f"driver_s_per_1000_{of}": round(1000 * spent_s / made, 6),
        "nodes_one_driver_feeds": round(workers_s / spent_s / NODE_CORES, 1),
    }
