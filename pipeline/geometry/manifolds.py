"""Meshes to and from manifold3d, which does solids' Boolean operations and simplification."""

import manifold3d
import numpy as np

from pipeline.geometry.mesh import Mesh


def to_manifold(mesh: Mesh) -> manifold3d.Manifold:
    """The solid that a closed, outward mesh bounds, in float64.

    Parameters
    ----------
    mesh
        Closed, faces outward [m].

    Returns
    -------
    The solid.

    Raises
    ------
    ValueError
        The faces do not pair up along their edges.
    """
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(
            vert_properties=np.array(mesh.vertices_m, dtype=np.float64, order="C"),
            tri_verts=np.array(mesh.faces, dtype=np.uint64, order="C"),
        )
    )
    if solid.status() != manifold3d.Error.NoError:
        raise ValueError(f"not a manifold: {solid.status()}")
    return solid


def from_manifold(solid: manifold3d.Manifold) -> Mesh:
    """The solid's surface: closed, outward; possibly empty."""
    arrays = solid.to_mesh64()
    vertices = np.array(arrays.vert_properties[:, :3], dtype=np.float64)
    return Mesh(vertices, np.array(arrays.tri_verts, dtype=np.int64))
