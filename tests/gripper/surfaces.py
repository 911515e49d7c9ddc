"""Heights of shapes in closed form under a pad, for tests."""

import numpy as np
from jaxtyping import Bool, Float

from pipeline.gripper import Pad

Heights = Float[np.ndarray, " vertices"]


def plane(pad: Pad) -> Heights:
    return np.zeros(len(pad.vertices_xy_m))


def tilted(pad: Pad, angle_rad: float) -> Heights:
    """A plane turned about y."""
    return np.asarray(-np.tan(angle_rad) * pad.vertices_xy_m[:, 0])


def sphere(pad: Pad, radius_m: float) -> Heights:
    below = radius_m**2 - (pad.vertices_xy_m**2).sum(axis=1)
    return np.where(below >= 0, np.sqrt(np.maximum(below, 0)) - radius_m, -np.inf)


def cylinder(pad: Pad, radius_m: float, *, along_x: bool = False) -> Heights:
    across = pad.vertices_xy_m[:, 1 if along_x else 0]
    below = radius_m**2 - across**2
    return np.where(below >= 0, np.sqrt(np.maximum(below, 0)) - radius_m, -np.inf)


def everywhere(pad: Pad) -> Bool[np.ndarray, " vertices"]:
    return np.ones(len(pad.vertices_xy_m), dtype=np.bool_)
