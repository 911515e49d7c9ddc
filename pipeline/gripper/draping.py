"""How the soft pad comes to lie on a surface: S-1.07, «Track V».

Each vertex of the pad travels along its own line parallel to z of GCS. The pad
is the lowest surface that stays on or above the scene and whose height changes
by at most Delta_d along any edge of its triangulation:

    z(v) = max over u of  z_s(u) - Delta_d * hops(u, v),

where hops counts edges on the shortest path. Nothing reaches more than H below
the highest vertex. Assumption A-1 acts here: draping is a quasi-static state,
not a motion, so no time stepping is needed; A-2 makes z_s a fixed, rigid surface.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import shortest_path

from pipeline.gripper.compiled import compiled
from pipeline.gripper.pad import Pad


def edge_hops(pad: Pad) -> Int[np.ndarray, "vertices vertices"]:
    """Number of edges on the shortest path between every two vertices."""
    count = len(pad.vertices_xy_m)
    ones = np.ones(len(pad.edges))
    graph = coo_array((ones, (pad.edges[:, 0], pad.edges[:, 1])), shape=(count, count)).tocsr()
    return np.asarray(shortest_path(graph, directed=False, unweighted=True), dtype=np.int64)


def drape_reference(
    pad: Pad, heights_m: Float[np.ndarray, " vertices"]
) -> Float[np.ndarray, " vertices"]:
    """`drape` computed as its definition reads, from all pairs of vertices; tests compare with it.

    Parameters
    ----------
    pad
        The pad in GCS.
    heights_m
        z_s, height of the scene under each vertex [m], shape (vertices,); NaN or -inf where nothing
        is below.

    Returns
    -------
    z(v) in the same frame [m], shape (vertices,); -inf everywhere if nothing is below the pad.
    """
    surface = np.where(np.isfinite(heights_m), heights_m, -np.inf)
    if not np.isfinite(surface).any():
        return surface
    draped = (surface[:, None] - pad.config.distance_step_m * edge_hops(pad)).max(axis=0)
    return np.asarray(np.maximum(draped, surface.max() - pad.config.altitude_m))


def drape(
    pad: Pad, heights_m: Float[np.ndarray, "batch vertices"]
) -> Float[np.ndarray, "batch vertices"]:
    """Heights z(v) of many draped pads [m]; each row as in `drape_reference`."""
    draped = np.empty_like(heights_m, dtype=np.float64)
    drape_into(heights_m, pad.edges, pad.config.distance_step_m, pad.config.altitude_m, draped)
    return draped


@compiled
def drape_into(
    heights: Float[np.ndarray, "batch vertices"],
    edges: Int[np.ndarray, "edges 2"],
    distance_step: float,
    altitude: float,
    draped: Float[np.ndarray, "batch vertices"],
) -> None:
    """Relax the edges outwards and inwards in turn until no vertex is lifted any more.

    A sweep carries a height along a whole outward (inward) path, so a few suffice
    where plain Bellman-Ford would need as many as the pad has rings.
    """
    for row in range(heights.shape[0]):
        z = draped[row]
        top = -np.inf
        for v in range(z.size):
            height = heights[row, v]
            z[v] = height if np.isfinite(height) else -np.inf
            top = max(top, z[v])
        if top == -np.inf:
            continue
        outwards = True
        lifted = True
        while lifted:
            lifted = False
            for step in range(edges.shape[0]):
                e = step if outwards else edges.shape[0] - 1 - step
                a = edges[e, 0]
                b = edges[e, 1]
                if z[a] - distance_step > z[b]:
                    z[b] = z[a] - distance_step
                    lifted = True
                elif z[b] - distance_step > z[a]:
                    z[a] = z[b] - distance_step
                    lifted = True
            outwards = not outwards
        for v in range(z.size):
            z[v] = max(z[v], top - altitude)


def contact_vertices(
    pad: Pad,
    draped_m: Float[np.ndarray, "*batch vertices"],
    heights_m: Float[np.ndarray, "*batch vertices"],
    on_target: Bool[np.ndarray, "*batch vertices"],
) -> Bool[np.ndarray, "*batch vertices"]:
    """Which vertices lie on the target object, within the contact tolerance.

    A vertex that rests on a neighbour of the target touches, but does not seal.
    """
    hit = np.isfinite(heights_m)
    gap = np.where(hit, draped_m, np.inf) - np.where(hit, heights_m, 0.0)
    return np.asarray((gap <= pad.config.contact_tolerance_m) & on_target)
