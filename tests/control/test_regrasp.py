"""Where a load hangs, from the wrench at the base, and what a contact near there is worth."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from pipeline.config import PolicyConfig
from pipeline.control.candidates import Candidates
from pipeline.control.cloud import Cloud
from pipeline.control.regrasp import load_place_m, top_of_column_m, worth_with_lever
from pipeline.control.robot import Reading

BASE_M = 0.2
few_cm = st.floats(-0.05, 0.05)


@given(x=few_cm, y=few_cm, tilt=st.floats(0.0, 1.0), turn=st.floats(-3.0, 3.0))
def test_the_weight_is_found_below_its_centre_however_the_gripper_leans(
    x: float, y: float, tilt: float, turn: float
) -> None:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("zx", [turn, tilt]).as_matrix()
    pose[:3, 3] = 0.1, -0.2, 0.3
    centre = pose[:3, 3] + [x, y, -0.04]
    weight = np.array([0.0, 0.0, -5.0])
    base = (pose @ [0.0, 0.0, BASE_M, 1.0])[:3]
    into_gripper = pose[:3, :3].T
    wrench = np.concatenate([into_gripper @ weight, into_gripper @ np.cross(centre - base, weight)])
    found = load_place_m(Reading(pose, wrench, 0.0, arrived=True), BASE_M)
    assert_allclose(found, centre[:2], atol=1e-9)


def test_the_top_of_a_column_is_its_highest_point() -> None:
    points = np.array([[0.0, 0.0, 0.1], [0.01, 0.0, 0.2], [0.05, 0.0, 0.9]])
    cloud = Cloud(points, np.zeros((3, 3)))
    found = top_of_column_m(cloud, np.zeros(2), 0.02)
    assert found is not None
    assert_allclose(found, points[1])
    assert top_of_column_m(cloud, np.array([0.3, 0.0]), 0.02) is None


def test_worth_falls_with_the_lever_and_is_nothing_where_little_is_gained() -> None:
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[:, 0, 3] = 0.0, 0.01, 0.03, 0.05
    found = Candidates(poses, np.zeros(4), np.zeros(4))
    worth = worth_with_lever(np.full(4, 0.8), found, np.zeros(2), 0.05, PolicyConfig())
    assert worth[0] == 0.8
    assert worth[0] > worth[1] > worth[2] > 0.0
    assert worth[3] == 0.0
