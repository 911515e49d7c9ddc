"""Meshes as Rerun shows them."""

from dataclasses import dataclass
from functools import lru_cache

import manifold3d
import numpy as np
import rerun as rr
from jaxtyping import Float, Int, UInt8

from pipeline.geometry.manifolds import to_manifold
from pipeline.geometry.mesh import Mesh

TOLERANCE_M = 2e-4  # how far an edge that collapses may move: too little to be seen
# A scan of 16 000 faces in each of many scenes would make a recording of hundreds of MB.
FEW_FACES, MOST_FACES = 1_000, 10_000
CREASE_RAD = 0.6  # sharper edges stay edges when a mesh is shaded


def shown_mesh(mesh: Mesh, colour: UInt8[np.ndarray, " 3"]) -> rr.Mesh3D:
    """A closed mesh in one colour for Rerun: simplified, shaded smooth except at sharp edges.

    The simplified surface differs by about ``TOLERANCE_M``, or by more where the mesh would
    otherwise keep more than ``MOST_FACES`` faces.

    Parameters
    ----------
    mesh
        A closed mesh.
    colour
        Red, green and blue, shape (3,).

    Returns
    -------
    The mesh as Rerun logs it.
    """
    return _ready(mesh, (*colour.tolist(), 255))


@lru_cache(maxsize=256)
def _ready(mesh: Mesh, rgba: tuple[int, ...]) -> rr.Mesh3D:
    """Build a mesh for Rerun once and keep it, as it is logged many times."""
    shown = shaded(mesh)
    return rr.Mesh3D(
        vertex_positions=shown.vertices_m,
        triangle_indices=shown.faces,
        vertex_normals=shown.normals,
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


@dataclass(frozen=True, eq=False)
class Shaded:
    """A mesh with one normal for each vertex; vertices on sharp edges appear once for each side."""

    vertices_m: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "m 3"]
    normals: Float[np.ndarray, "n 3"]


@lru_cache(maxsize=256)
def shaded(mesh: Mesh) -> Shaded:
    """Simplify a closed mesh, unless it is small, and give it normals: smooth except at edges."""
    solid = to_manifold(mesh) if len(mesh.faces) <= FEW_FACES else _simplified(mesh)
    arrays = solid.calculate_normals(0, float(np.degrees(CREASE_RAD))).to_mesh64()
    vertices = np.array(arrays.vert_properties, dtype=np.float64)
    faces = np.array(arrays.tri_verts, dtype=np.int64)
    return Shaded(vertices[:, :3], faces, vertices[:, 3:6])


def _simplified(mesh: Mesh) -> manifold3d.Manifold:
    solid, tolerance_m = to_manifold(mesh), TOLERANCE_M
    simple = solid.simplify(tolerance_m)
    while simple.num_tri() > MOST_FACES:
        tolerance_m *= 2
        simple = solid.simplify(tolerance_m)
    return simple


def shown_pose(world_from_frame: Float[np.ndarray, "4 4"]) -> rr.Transform3D:
    """A frame's pose."""
    return rr.Transform3D(translation=world_from_frame[:3, 3], mat3x3=world_from_frame[:3, :3])
