"""A triangle mesh as two arrays."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles over shared vertices, outward normals by the right-hand rule.

    vertices_m: (n, 3) in one frame that the holder names [m]; faces: (m, 3) vertex indices.
    """

    vertices_m: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "m 3"]

    @property
    def extents_m(self) -> Float[np.ndarray, " 3"]:
        """Sides of the axis-aligned bounding box [m]."""
        return np.asarray(np.ptp(self.vertices_m, axis=0))

    def scaled(self, factor: float) -> "Mesh":
        """A similar surface."""
        return Mesh(self.vertices_m * factor, self.faces)

    def transformed(self, a_from_mesh: Float[np.ndarray, "4 4"]) -> "Mesh":
        """The same surface in frame a; a_from_mesh must not mirror."""
        vertices = self.vertices_m @ a_from_mesh[:3, :3].T + a_from_mesh[:3, 3]
        return Mesh(vertices, self.faces)
