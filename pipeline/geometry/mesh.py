"""A triangle mesh as two arrays."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from pipeline.read_only import read_only


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles over shared vertices, outward normals by the right-hand rule.

    Its arrays cannot be written to: what is computed from a mesh is kept and found by the mesh.

    Attributes
    ----------
    vertices_m
        Vertices in a frame that the holder of the mesh names [m], shape (n, 3).
    faces
        Indices of the corners of each triangle, shape (m, 3).
    """

    vertices_m: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "m 3"]

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices_m", read_only(self.vertices_m))
        object.__setattr__(self, "faces", read_only(self.faces))

    @property
    def extents_m(self) -> Float[np.ndarray, " 3"]:
        """Sides of the axis-aligned bounding box [m]."""
        return np.asarray(np.ptp(self.vertices_m, axis=0))

    def scaled(self, factor: float) -> "Mesh":
        """The surface with all lengths multiplied by a factor."""
        return Mesh(self.vertices_m * factor, self.faces)

    def transformed(self, a_from_mesh: Float[np.ndarray, "4 4"]) -> "Mesh":
        """The same surface in frame a; ``a_from_mesh``, shape (4, 4), must not mirror."""
        vertices = self.vertices_m @ a_from_mesh[:3, :3].T + a_from_mesh[:3, 3]
        return Mesh(vertices, self.faces)
