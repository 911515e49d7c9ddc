"""Vertices written more than once become one: by their distance, not by rounding to a grid.

Two points a hair apart fall into two cells of any grid if its border runs between them.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

# Neighbours that are looked at for each point. A chain of near points is one vertex whatever its
# length, so that a crowd is still joined; the bound keeps a hostile file from pairing all with all.
_MOST_NEIGHBOURS = 8


def weld(
    points: Float[np.ndarray, "n 3"], tolerance: float
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " n"]]:
    """Join points that are equal, or nearer to each other than a tolerance.

    Parameters
    ----------
    points
        Finite points, shape (n, 3), in any unit.
    tolerance
        In the points' unit; 0 joins equal points alone.

    Returns
    -------
    The index of the first point of each group, ascending, shape (k,); and for each point the
    number of its group, shape (n,).
    """
    first, group = _equal(points)
    if tolerance > 0.0:
        chains = _near(points[first], tolerance)
        first, group = _ranked(first, chains, chains[group])
    return first, group


def _equal(
    points: Float[np.ndarray, "n 3"],
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " n"]]:
    """The first of equal points, ascending, and the number of each point's group."""
    # Equal points have equal sums. One sort then does for three, unless others have them too.
    order = np.argsort(points @ np.array([1.0, np.sqrt(2.0), np.sqrt(3.0)]), kind="stable")
    fresh = _differ(points[order])
    sums = points[order] @ np.array([1.0, np.sqrt(2.0), np.sqrt(3.0)])
    if (fresh & (sums[1:] == sums[:-1])).any():
        order = np.lexsort(points.T)
        fresh = _differ(points[order])
    group = np.zeros(len(points), dtype=np.int64)
    group[order[1:]] = np.cumsum(fresh)
    first = order[np.concatenate([np.ones(min(1, len(points)), dtype=bool), fresh])]
    return _ranked(first, np.arange(len(first)), group)


def _differ(ranked: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " m"]:
    """Whether each point but the first differs from the one before."""
    return np.asarray((ranked[1:] != ranked[:-1]).any(axis=1))


def _near(points: Float[np.ndarray, "n 3"], tolerance: float) -> Int[np.ndarray, " n"]:
    """A number for each of different points, the same along every chain of near ones."""
    count = len(points)
    if count < 2:
        return np.zeros(count, dtype=np.int64)
    tree = KDTree(points)
    nearest, _ = tree.query(points, k=[2], distance_upper_bound=tolerance)
    close = np.flatnonzero(np.isfinite(nearest[:, 0]))
    if len(close) == 0:
        return np.arange(count)
    most = range(2, min(_MOST_NEIGHBOURS, count) + 1)
    _, near = tree.query(points[close], k=most, distance_upper_bound=tolerance)
    row, column = np.nonzero(near < count)
    links = coo_array(
        (np.ones(len(row), dtype=bool), (close[row], near[row, column])), (count, count)
    )
    _, group = connected_components(links, directed=False)
    return np.asarray(group, dtype=np.int64)


def _ranked(
    first: Int[np.ndarray, " g"], merged: Int[np.ndarray, " g"], group: Int[np.ndarray, " n"]
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " n"]]:
    """Groups renumbered in the order of their first points.

    first: a point of each old group; merged: its new group, from 0 without gaps; group: the new
    group of every point.
    """
    leader = np.full(int(merged.max(initial=-1)) + 1, np.iinfo(np.int64).max)
    np.minimum.at(leader, merged, first)
    order = np.argsort(leader)
    rank = np.empty(len(leader), dtype=np.int64)
    rank[order] = np.arange(len(leader))
    return leader[order], rank[group]
