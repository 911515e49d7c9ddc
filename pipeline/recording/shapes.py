"""Meshes as Rerun shows them."""

from functools import lru_cache

import fast_simplification
import numpy as np
import rerun as rr
from jaxtyping import Float, UInt8

from pipeline.geometry.mesh import Mesh

# A scan of 16 000 faces in each of many scenes would make a recording of hundreds of MB.
SHOWN_FACES = 4000


def shown_mesh(mesh: Mesh, colour: UInt8[np.ndarray, " 3"]) -> rr.Mesh3D:
    """A mesh in one colour, shaded smoothly, of at most about ``SHOWN_FACES`` faces."""
    if len(mesh.faces) > SHOWN_FACES:
        mesh = _simplified(mesh)
    return rr.Mesh3D(
        vertex_positions=mesh.vertices_m,
        triangle_indices=mesh.faces,
        vertex_normals=vertex_normals(mesh),
        albedo_factor=[*colour.tolist(), 255],
    )


@lru_cache(maxsize=256)
def _simplified(mesh: Mesh) -> Mesh:
    vertices, faces = fast_simplification.simplify(
        mesh.vertices_m.astype(np.float32), mesh.faces.astype(np.int32), target_count=SHOWN_FACES
    )
    return Mesh(vertices.astype(np.float64), faces.astype(np.int64))


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
