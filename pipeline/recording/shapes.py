"""Meshes as Rerun shows them."""

from functools import lru_cache

import fast_simplification
import numpy as np
import rerun as rr
import trimesh
from jaxtyping import Float, UInt8

from pipeline.geometry.mesh import Mesh

# A scan of 16 000 faces in each of many scenes would make a recording of hundreds of MB.
SHOWN_FACES = 4000
SIMPLIFIED_AT = 10.0  # longest extent while a mesh is simplified
CREASE_RAD = 0.6  # sharper edges stay edges when a mesh is shaded


def shown_mesh(mesh: Mesh, colour: UInt8[np.ndarray, " 3"]) -> rr.Mesh3D:
    """A mesh in one colour, smooth but for its edges, of at most about ``SHOWN_FACES`` faces."""
    shown = _shaded(mesh)
    return rr.Mesh3D(
        vertex_positions=shown.vertices_m,
        triangle_indices=shown.faces,
        vertex_normals=vertex_normals(shown),
        albedo_factor=[*colour.tolist(), 255],
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
    """Simplified where it must be, with the vertices of its edges doubled."""
    vertices, faces = mesh.vertices_m, mesh.faces
    if len(faces) > SHOWN_FACES:
        # Its thresholds are lengths: at this size it keeps edges that it tears in metres.
        size = SIMPLIFIED_AT / mesh.extents_m.max()
        vertices, faces = fast_simplification.simplify(
            (vertices * size).astype(np.float32), faces.astype(np.int32), target_count=SHOWN_FACES
        )
        vertices = vertices / size
    surface = trimesh.Trimesh(vertices, faces, process=False)
    parted = trimesh.graph.smooth_shade(surface, angle=CREASE_RAD)
    return Mesh(np.array(parted.vertices, dtype=np.float64), np.array(parted.faces, dtype=np.int64))


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
