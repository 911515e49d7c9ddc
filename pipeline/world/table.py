"""The table's top as a surface for rays."""

import numpy as np

from pipeline.geometry.mesh import Mesh


def table_mesh(side_m: float) -> Mesh:
    """A square of two triangles at z = 0, centred on the origin, facing up."""
    half = side_m / 2
    corners = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]])
    return Mesh(corners.astype(np.float64), np.array([[0, 1, 2], [0, 2, 3]]))
