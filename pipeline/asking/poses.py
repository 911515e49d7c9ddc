"""Poses as columns of a table."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation


def pose_columns(world_from_thing: Float[np.ndarray, "n 4 4"]) -> dict[str, np.ndarray]:
    """Poses as places [m] and unit quaternions of the part with w >= 0."""
    quaternion = Rotation.from_matrix(world_from_thing[:, :3, :3]).as_quat(
        canonical=True, scalar_first=True
    )
    places = dict(zip(("x_m", "y_m", "z_m"), world_from_thing[:, :3, 3].T, strict=True))
    return places | dict(zip(("qw", "qx", "qy", "qz"), quaternion.T, strict=True))
