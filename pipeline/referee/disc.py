"""Finite elements on the pad's disc: a mesh that is the same after sixths of a turn, or mirrored.

Ring i has 6 i vertices. No angle is obtuse, so the stiffness of linear elements has no positive
entry off its diagonal (an M-matrix): active sets grow or shrink one way, pressures stay between
their bounds.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int
from scipy import sparse

PATCH_RINGS = 4  # contact pressure is even over a patch: 61 of them, a sixth of r_G wide


@dataclass(frozen=True, eq=False)
class Disc:
    """Linear elements on a disc in the plane z = 0 of GCS, vertex 0 at the centre.

    Attributes
    ----------
    radius_m
        r_G [m].
    vertices_xy_m
        Vertices, shape (n, 2), GCS [m].
    triangles
        Vertex indices, shape (m, 3), counter-clockwise seen from +z.
    triangle_areas_m2
        Area of each triangle, shape (m,) [m2].
    areas_m2
        Area that each vertex stands for, a third of its triangles', shape (n,) [m2].
    starts, neighbours, weights
        The edges of vertex i are ``starts[i]:starts[i + 1]`` of ``neighbours`` and ``weights``;
        a weight is half the sum of the cotangents opposite the edge [1].
    rim_weights
        For vertices on the rim, how much film leads to the atmosphere: the length of rim over
        half an element [1]; 0 elsewhere. Shape (n,).
    patch
        Which patch of even contact pressure a vertex belongs to, shape (n,).
    """

    radius_m: float
    vertices_xy_m: Float[np.ndarray, "n 2"]
    triangles: Int[np.ndarray, "m 3"]
    triangle_areas_m2: Float[np.ndarray, " m"]
    areas_m2: Float[np.ndarray, " n"]
    starts: Int[np.ndarray, " n+1"]
    neighbours: Int[np.ndarray, " e"]
    weights: Float[np.ndarray, " e"]
    rim_weights: Float[np.ndarray, " n"]
    patch: Int[np.ndarray, " n"]

    @property
    def area_m2(self) -> float:
        """Area of the disc, a polygon [m2]."""
        return float(self.areas_m2.sum())


@lru_cache(maxsize=8)
def build_disc(radius_m: float, element_m: float) -> Disc:
    """Rings as many as keep each element within its size.

    Parameters
    ----------
    radius_m
        r_G [m].
    element_m
        Largest radial side of an element [m].

    Returns
    -------
    Vertices, elements and patches of the disc.
    """
    rings = max(2, int(np.ceil(radius_m / element_m - 1e-9)))
    vertices = _hexagonal_points(rings) * radius_m
    triangles = _triangles(rings)
    corners = vertices[triangles]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    lumped = np.bincount(triangles.ravel(), np.repeat(areas / 3, 3), minlength=len(vertices))
    graph = _cotangent_weights(vertices, triangles, areas)
    rim = np.zeros(len(vertices))
    rim[-6 * rings :] = (2 * np.pi * radius_m / (6 * rings)) / (0.5 * radius_m / rings)
    coarse = _hexagonal_points(PATCH_RINGS) * radius_m
    away = np.linalg.norm(vertices[:, None] - coarse[None], axis=2)
    disc = Disc(
        radius_m=radius_m,
        vertices_xy_m=vertices,
        triangles=triangles,
        triangle_areas_m2=areas,
        areas_m2=lumped,
        starts=graph.indptr.astype(np.int64),
        neighbours=graph.indices.astype(np.int64),
        weights=graph.data,
        rim_weights=rim,
        patch=away.argmin(axis=1),
    )
    for array in (vertices, triangles, areas, lumped, graph.data, rim, disc.patch):
        array.setflags(write=False)
    return disc


def laplacian(disc: Disc, edge_weights: Float[np.ndarray, " e"]) -> sparse.csr_array:
    """The matrix L of Σ_ij w_ij (u_i - u_j)² / 2 = uᵀ L u over all edges.

    Parameters
    ----------
    disc
        Whose edges are meant.
    edge_weights
        A weight for each entry of ``disc.neighbours``, symmetric.

    Returns
    -------
    Sparse, shape (n, n).
    """
    count = len(disc.areas_m2)
    graph = sparse.csr_array((edge_weights, disc.neighbours, disc.starts), shape=(count, count))
    return sparse.csr_array(sparse.diags_array(graph.sum(axis=1)) - graph)


def _hexagonal_points(rings: int) -> Float[np.ndarray, "n 2"]:
    """A centre and rings of 6 i points, the last at radius 1."""
    points = [np.zeros((1, 2))]
    for ring in range(1, rings + 1):
        angle = 2 * np.pi * np.arange(6 * ring) / (6 * ring)
        points.append(ring / rings * np.column_stack([np.cos(angle), np.sin(angle)]))
    return np.concatenate(points)


def _triangles(rings: int) -> Int[np.ndarray, "m 3"]:
    """Between neighbouring rings, sixth by sixth."""

    def vertex(ring: int, number: int) -> int:
        return 0 if ring == 0 else 1 + 3 * ring * (ring - 1) + number % (6 * ring)

    faces = []
    for ring in range(1, rings + 1):
        for sixth in range(6):
            for j in range(ring):
                inner = vertex(ring - 1, sixth * (ring - 1) + j)
                outer, outer_next = (vertex(ring, sixth * ring + j + k) for k in (0, 1))
                faces.append((inner, outer, outer_next))
                if j < ring - 1:
                    inner_next = vertex(ring - 1, sixth * (ring - 1) + j + 1)
                    faces.append((inner, outer_next, inner_next))
    return np.array(faces, dtype=np.int64)


def _cotangent_weights(
    vertices: Float[np.ndarray, "n 2"],
    triangles: Int[np.ndarray, "m 3"],
    areas: Float[np.ndarray, " m"],
) -> sparse.csr_array:
    """Half the cotangents opposite each edge, summed over its triangles."""
    rows, columns, values = [], [], []
    for corner in range(3):
        apex, a, b = (triangles[:, (corner + k) % 3] for k in range(3))
        to_a, to_b = vertices[a] - vertices[apex], vertices[b] - vertices[apex]
        half_cotangent = np.einsum("ij,ij->i", to_a, to_b) / (4 * areas)
        rows += [a, b]
        columns += [b, a]
        values += [half_cotangent, half_cotangent]
    count = len(vertices)
    graph = sparse.coo_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
        shape=(count, count),
    ).tocsr()
    graph.sort_indices()
    graph.data = np.maximum(graph.data, 0.0)  # right angles: zero to rounding
    return graph
