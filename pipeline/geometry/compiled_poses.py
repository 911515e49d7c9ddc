"""Turns and quaternions, compiled: `transforms` for loops of thousands of poses a second.

SciPy's rotations check and convert what they are given, which costs some 200 µs a pose; these do
neither. Rotation matrices must be proper.
"""

import numpy as np
from jaxtyping import Float

from pipeline.compiled_code import njit


@njit()
def quaternion_of(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " 4"]:
    """Unit quaternion wxyz with w >= 0, from the largest of its components (Shepperd, 1978)."""
    trace = rotation[0, 0] + rotation[1, 1] + rotation[2, 2]
    q = np.empty(4)
    squares = np.array([trace, rotation[0, 0], rotation[1, 1], rotation[2, 2]])
    largest = int(np.argmax(squares))
    if largest == 0:
        q[0] = 1.0 + trace
        q[1] = rotation[2, 1] - rotation[1, 2]
        q[2] = rotation[0, 2] - rotation[2, 0]
        q[3] = rotation[1, 0] - rotation[0, 1]
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q[0] = rotation[k, j] - rotation[j, k]
        q[1 + i] = 1.0 + rotation[i, i] - rotation[j, j] - rotation[k, k]
        q[1 + j] = rotation[j, i] + rotation[i, j]
        q[1 + k] = rotation[k, i] + rotation[i, k]
    q /= np.sqrt((q * q).sum())
    if q[0] < 0.0:
        q = -q
    return q


@njit()
def pose_of(
    position_m: Float[np.ndarray, " 3"], quaternion_wxyz: Float[np.ndarray, " 4"]
) -> Float[np.ndarray, "4 4"]:
    """a_from_b of b's origin in a and a quaternion of about unit length."""
    w, x, y, z = quaternion_wxyz / np.sqrt((quaternion_wxyz * quaternion_wxyz).sum())
    pose = np.eye(4)
    pose[0, 0], pose[0, 1], pose[0, 2] = (
        1 - 2 * (y * y + z * z),
        2 * (x * y - w * z),
        2 * (x * z + w * y),
    )
    pose[1, 0], pose[1, 1], pose[1, 2] = (
        2 * (x * y + w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z - w * x),
    )
    pose[2, 0], pose[2, 1], pose[2, 2] = (
        2 * (x * z - w * y),
        2 * (y * z + w * x),
        1 - 2 * (x * x + y * y),
    )
    pose[:3, 3] = position_m
    return pose


@njit()
def turn_between(
    world_from_a: Float[np.ndarray, "4 4"], world_from_b: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, " 3"]:
    """Rotation vector in WCS that turns frame a into frame b's orientation [rad]."""
    turn = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                turn[i, j] += world_from_b[i, k] * world_from_a[j, k]
    q = quaternion_of(turn)
    sine = np.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    scale = 2.0 if sine < 1e-12 else 2.0 * np.arctan2(sine, q[0]) / sine
    turn_rad: Float[np.ndarray, " 3"] = scale * q[1:]
    return turn_rad


@njit()
def turned(
    world_from_a: Float[np.ndarray, "4 4"], turn_rad: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, "4 4"]:
    """The pose with its orientation turned about its own origin by a rotation vector in WCS."""
    angle = np.sqrt((turn_rad * turn_rad).sum())
    q = np.empty(4)
    q[0] = np.cos(angle / 2)
    q[1:] = turn_rad * (0.5 if angle < 1e-12 else np.sin(angle / 2) / angle)
    turn = pose_of(np.zeros(3), q)
    pose = world_from_a.copy()
    for i in range(3):
        for j in range(3):
            pose[i, j] = 0.0
            for k in range(3):
                pose[i, j] += turn[i, k] * world_from_a[k, j]
    return pose


@njit()
def cross_product(
    a: Float[np.ndarray, " 3"], b: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, " 3"]:
    """a × b, with the bits of NumPy's cross."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )
