"""Edges of a triangle mesh: is it closed, and where is it not."""

import numpy as np
import trimesh
from jaxtyping import Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from pipeline.geometry.mesh import Mesh


def directed_edges(faces: Int[np.ndarray, "m 3"]) -> Int[np.ndarray, "e 2"]:
    """The three directed edges of each face, face after face; e = 3 m."""
    return np.asarray(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2))


def undirected_edge_counts(
    faces: Int[np.ndarray, "m 3"],
) -> tuple[Int[np.ndarray, "u 2"], Int[np.ndarray, " u"]]:
    """Each edge once, and how many faces use it."""
    edges = np.sort(directed_edges(faces), axis=1).astype(np.int64)
    width = int(edges.max(initial=0)) + 1
    keys, counts = np.unique(edges[:, 0] * width + edges[:, 1], return_counts=True)
    return np.stack([keys // width, keys % width], axis=1), counts


def boundary_edges(faces: Int[np.ndarray, "m 3"]) -> Int[np.ndarray, "b 2"]:
    """Directed edges whose undirected edge has one face only."""
    edges = directed_edges(faces)
    _, inverse, counts = np.unique(
        np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    return np.asarray(edges[counts[inverse.reshape(-1)] == 1])


def boundary_loops(faces: Int[np.ndarray, "m 3"]) -> list[Int[np.ndarray, " k"]]:
    """Openings as closed loops of vertices, each running along its faces' directed edges.

    Where two openings meet in a vertex, they are walked as they come: every boundary edge is in
    exactly one loop. Raises ValueError where boundary edges do not close to loops.
    """
    following: dict[int, list[int]] = {}
    for start, end in boundary_edges(faces).tolist():
        following.setdefault(start, []).append(end)
    loops = []
    while following:
        first = min(following)
        loop = [first]
        while True:
            ends = following.get(loop[-1])
            if not ends:
                raise ValueError("boundary edges do not close to a loop")
            after = ends.pop()
            if not ends:
                del following[loop[-1]]
            if after == first:
                break
            loop.append(after)
        loops.append(np.array(loop))
    return loops


def components(faces: Int[np.ndarray, "m 3"]) -> list[Int[np.ndarray, " k"]]:
    """Face indices of each part connected through edges of two faces, largest first."""
    labels = trimesh.graph.connected_component_labels(
        trimesh.graph.face_adjacency(faces), node_count=len(faces)
    )
    groups = [np.flatnonzero(labels == label) for label in range(int(labels.max()) + 1)]
    return sorted(groups, key=lambda group: (-len(group), int(group[0])))


def is_connected(mesh: Mesh) -> bool:
    """Whether all vertices that faces use hang together: quicker to tell than the components."""
    edges, n = directed_edges(mesh.faces), len(mesh.vertices_m)
    links = coo_array((np.ones(len(edges), dtype=np.int8), (edges[:, 0], edges[:, 1])), (n, n))
    _, labels = connected_components(links, directed=False)
    return bool((labels[mesh.faces[:, 0]] == labels[mesh.faces[0, 0]]).all())


def is_closed(mesh: Mesh) -> bool:
    """Every edge has exactly two faces, which pass along it in opposite directions."""
    start, end = directed_edges(mesh.faces).astype(np.int64).T
    if len(start) == 0 or (start == end).any():
        return False
    width = int(mesh.faces.max()) + 1
    forward = np.sort(start * width + end)
    backward = np.sort(end * width + start)
    # Each edge once in each direction, and none twice in one.
    return bool((forward == backward).all() and (forward[1:] != forward[:-1]).all())


def submesh(mesh: Mesh, face_index: Int[np.ndarray, " k"]) -> Mesh:
    """The chosen faces with the vertices they use, in their old order."""
    used, inverse = np.unique(mesh.faces[face_index], return_inverse=True)
    return Mesh(mesh.vertices_m[used], inverse.reshape(-1, 3))


def concatenate(meshes: list[Mesh]) -> Mesh:
    """Several meshes of one frame as one, vertices not merged."""
    offsets = np.cumsum([0, *(len(mesh.vertices_m) for mesh in meshes)])
    vertices: Float[np.ndarray, "n 3"] = np.concatenate([mesh.vertices_m for mesh in meshes])
    faces = np.concatenate([mesh.faces + offsets[k] for k, mesh in enumerate(meshes)])
    return Mesh(vertices, faces)
