"""SE(3) as 4x4 arrays named `a_from_b`; quaternions in (w, x, y, z) order."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation


def invert(a_from_b: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4 4"]:
    """b_from_a of a rigid a_from_b: the transpose of the rotation, no matrix inverse."""
    b_from_a = np.eye(4)
    b_from_a[:3, :3] = a_from_b[:3, :3].T
    b_from_a[:3, 3] = -a_from_b[:3, :3].T @ a_from_b[:3, 3]
    return b_from_a


def transform_points(
    a_from_b: Float[np.ndarray, "4 4"], points_b: Float[np.ndarray, "*n 3"]
) -> Float[np.ndarray, "*n 3"]:
    """Points of frame b expressed in frame a; any leading shape."""
    return np.asarray(points_b @ a_from_b[:3, :3].T + a_from_b[:3, 3])


def rotate_vectors(
    a_from_b: Float[np.ndarray, "4 4"], vectors_b: Float[np.ndarray, "*n 3"]
) -> Float[np.ndarray, "*n 3"]:
    """Directions of frame b expressed in frame a: rotated, not moved."""
    return np.asarray(vectors_b @ a_from_b[:3, :3].T)


def pose_from(
    position_m: Float[np.ndarray, " 3"], quaternion_wxyz: Float[np.ndarray, " 4"]
) -> Float[np.ndarray, "4 4"]:
    """a_from_b of b's origin in a and a quaternion, which need not have unit length.

    Parameters
    ----------
    position_m
        Origin of b in a [m].
    quaternion_wxyz
        Turns b's axes into a's.

    Returns
    -------
    The pose, shape (4, 4).

    Raises
    ------
    ValueError
        The quaternion has length zero.
    """
    a_from_b = np.eye(4)
    a_from_b[:3, :3] = Rotation.from_quat(quaternion_wxyz, scalar_first=True).as_matrix()
    a_from_b[:3, 3] = position_m
    return a_from_b


def position_quaternion(
    a_from_b: Float[np.ndarray, "4 4"],
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 4"]]:
    """(position in a [m], unit quaternion wxyz with w >= 0); the inverse of `pose_from`."""
    quaternion = Rotation.from_matrix(a_from_b[:3, :3]).as_quat(canonical=True, scalar_first=True)
    return a_from_b[:3, 3].copy(), np.asarray(quaternion)


def frame_from_z(
    origin_m: Float[np.ndarray, " 3"], z_axis: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, "4 4"]:
    """world_from_frame with the given origin and z direction, x and y fixed by a rule.

    x is the world axis least aligned with z (the first such in a tie), made orthogonal to z:
    deterministic, and never ill-conditioned. z_axis need not have unit length.

    Parameters
    ----------
    origin_m
        Of the frame, in the world [m].
    z_axis
        Its z direction in the world, of any length.

    Returns
    -------
    The pose, shape (4, 4).

    Raises
    ------
    ValueError
        ``z_axis`` has length zero.
    """
    z = _unit(np.asarray(z_axis, dtype=np.float64), "z_axis")
    helper = np.eye(3)[np.argmin(np.abs(z))]
    x = _unit(helper - (helper @ z) * z, "x")
    return _frame(origin_m, x, np.cross(z, x), z)


def look_at(
    eye_m: Float[np.ndarray, " 3"], target_m: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, "4 4"]:
    """world_from_camera (CCS: x right, y down, z forward) at eye_m, looking at target_m.

    World z is up in the picture; for a view straight along z, world y is.

    Parameters
    ----------
    eye_m
        The camera's centre in the world [m].
    target_m
        What its axis goes through, in the world [m].

    Returns
    -------
    The pose, shape (4, 4).

    Raises
    ------
    ValueError
        Eye and target coincide.
    """
    eye = np.asarray(eye_m, dtype=np.float64)
    z = _unit(np.asarray(target_m, dtype=np.float64) - eye, "target - eye")
    vertical = np.hypot(z[0], z[1]) < 1e-9
    up = np.array([0.0, 1.0, 0.0]) if vertical else np.array([0.0, 0.0, 1.0])
    x = _unit(np.cross(z, up), "x")
    return _frame(eye, x, np.cross(z, x), z)


def random_rotation(rng: np.random.Generator) -> Float[np.ndarray, "3 3"]:
    """A rotation uniform over SO(3): a normalised normal 4-vector as quaternion."""
    return np.asarray(Rotation.from_quat(rng.normal(size=4)).as_matrix())


def _unit(vector: Float[np.ndarray, " 3"], name: str) -> Float[np.ndarray, " 3"]:
    length = np.linalg.norm(vector)
    if not length > 0.0:
        raise ValueError(f"{name} has no direction: {vector}")
    return np.asarray(vector / length)


def _frame(
    origin_m: Float[np.ndarray, " 3"],
    x: Float[np.ndarray, " 3"],
    y: Float[np.ndarray, " 3"],
    z: Float[np.ndarray, " 3"],
) -> Float[np.ndarray, "4 4"]:
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, y, z])
    pose[:3, 3] = origin_m
    return pose
