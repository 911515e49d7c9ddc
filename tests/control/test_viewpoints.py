"""Poses of the gripper: which way its camera stands."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pipeline.control.viewpoints import turn_camera_up

ASIDE_M, ABOVE_M = 0.16, 0.18
angle = st.floats(-np.pi, np.pi)


def height_of_camera_m(pose: np.ndarray) -> float:
    return float((pose @ [ASIDE_M, 0.0, ABOVE_M, 1.0])[2])


@given(angle, st.floats(0.0, 1.5), angle)
def test_the_camera_never_hangs_below_the_pad(heading: float, tilt: float, spin: float) -> None:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("ZYZ", [heading, tilt, spin]).as_matrix()
    pose[:3, 3] = 0.1, -0.2, 0.05
    turned = turn_camera_up(pose, ASIDE_M, ABOVE_M)
    assert height_of_camera_m(turned) >= pose[2, 3] - 1e-12
    np.testing.assert_allclose(turned[:3, 2:], pose[:3, 2:])
    np.testing.assert_allclose(np.linalg.det(turned[:3, :3]), 1.0)


def test_a_pose_whose_camera_is_up_stays() -> None:
    np.testing.assert_array_equal(turn_camera_up(np.eye(4), ASIDE_M, ABOVE_M), np.eye(4))
