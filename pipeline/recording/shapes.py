"""Meshes as Rerun shows them."""

from functools import lru_cache

import numpy as np
import rerun as rr
import trimesh
from jaxtyping import Float, UInt8

from pipeline.geometry.manifolds import from_manifold, to_manifold
from pipeline.geometry.mesh import Mesh

TOLERANCE_M = 2e-4  # how far an edge that collapses may move: too little to be seen
# A scan of 16 000 faces in each of many scenes would make a recording of hundreds of MB.
FEW_FACES, MOST_FACES = 1_000, 10_000
CREASE_RAD = 0.6  # sharper edges stay edges when a mesh is shaded


def shown_mesh(mesh: Mesh, colour: UInt8[np.ndarray, " 3"]) -> rr.Mesh3D:
    """A closed mesh in one colour, smooth but for its edges, about ``TOLERANCE_M`` off at most.

    One that keeps more than ``MOST_FACES`` faces so is given more tolerance.
    """
    return _ready(mesh, (*colour.tolist(), 255))


@lru_cache(maxsize=256)
def _ready(mesh: Mesh, rgba: tuple[int, ...]) -> rr.Mesh3D:
    """Made once, however often it is logged."""
    shown = _shaded(mesh)
    return rr.Mesh3D(
        vertex_positions=shown.vertices_m,
        triangle_indices=shown.faces,
        vertex_normals=vertex_normals(shown),
        albedo_factor=rgba,
    )


def shown_facets(mesh: Mesh, colour: UInt8[np.ndarray, " 3"]) -> rr.Mesh3D:
    """A small mesh in one colour with every face flat, as a convex part is."""
    corners = mesh.vertices_m[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return rr.Mesh3D(
        vertex_positions=corners.reshape(-1, 3),
        vertex_normals=np.repeat(normals, 3, axis=0),
        albedo_factor=[*colour.tolist(), 255],
    )


@lru_cache(maxsize=256)
def _shaded(mesh: Mesh) -> Mesh:
    """Simplified but where it is small, with the vertices of its edges doubled."""
    shown = mesh if len(mesh.faces) <= FEW_FACES else _simplified(mesh)
    surface = trimesh.Trimesh(shown.vertices_m, shown.faces, process=False)
    parted = trimesh.graph.smooth_shade(surface, angle=CREASE_RAD)
    return Mesh(np.array(parted.vertices, dtype=np.float64), np.array(parted.faces, dtype=np.int64))


def _simplified(mesh: Mesh) -> Mesh:
    solid, tolerance_m = to_manifold(mesh), TOLERANCE_M
    simple = solid.simplify(tolerance_m)
    while simple.num_tri() > MOST_FACES:
        tolerance_m *= 2
        simple = solid.simplify(tolerance_m)
    return from_manifold(simple)


@lru_cache(maxsize=256)
def vertex_normals(mesh: Mesh) -> Float[np.ndarray, "n 3"]:
    """Area-weighted mean of the normals of the faces around each vertex."""
    corners = mesh.vertices_m[mesh.faces]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(mesh.vertices_m)
    for corner in range(3):
        for axis in range(3):
            normals[:, axis] += np.bincount(
                mesh.faces[:, corner], weights=face[:, axis], minlength=len(normals)
            )
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.maximum(lengths, 1e-30))


def shown_pose(world_from_frame: Float[np.ndarray, "4 4"]) -> rr.Transform3D:
    """A frame's pose."""
    return rr.Transform3D(translation=world_from_frame[:3, 3], mat3x3=world_from_frame[:3, :3])
