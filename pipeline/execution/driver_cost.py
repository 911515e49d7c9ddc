"""What the driver of a cluster spends itself, and how large a cluster it keeps busy with that."""

NODE_CORES = 8  # of the nodes that are counted
LEAST_S = 1e-3  # a driver is never free, whatever its clock finds


def driver_cost(driver_s: float, workers_s: float, grasps: int) -> dict[str, float]:
    """The driver's share of the work on some grasps.

    Parameters
    ----------
    driver_s
        The driver's own processor time [s].
    workers_s
        Processor time of the work items, wherever they were made [s].
    grasps
        How many grasps were made; none: nothing is said.

    Returns
    -------
    The driver's seconds a thousand grasps, and the number of nodes of eight cores whose results one
    driver can take: as many cores as workers' seconds go on one of the driver's.
    """
    if grasps == 0:
        return {}
    spent_s = max(driver_s, LEAST_S)
    return {
        "driver_s_per_1000_grasps": round(1000 * spent_s / grasps, 6),
        "nodes_one_driver_feeds": round(workers_s / spent_s / NODE_CORES, 1),
    }
