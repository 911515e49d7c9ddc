"""SE(3): round trips, composition, and the conventions that names promise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pipeline.geometry import transforms

positions = arrays(np.float64, 3, elements=st.floats(-10, 10))
quaternions = arrays(np.float64, 4, elements=st.floats(-1, 1)).filter(
    lambda q: bool(np.linalg.norm(q) > 1e-3)
)
poses = st.builds(transforms.pose_from, positions, quaternions)
directions = arrays(np.float64, 3, elements=st.floats(-1, 1)).filter(
    lambda v: bool(np.linalg.norm(v) > 1e-3)
)


def is_rotation(matrix: np.ndarray) -> bool:
    orthonormal = np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    return bool(orthonormal and abs(np.linalg.det(matrix) - 1) < 1e-12)


@given(poses)
def test_inverse_composes_to_identity(pose: np.ndarray) -> None:
    np.testing.assert_allclose(pose @ transforms.invert(pose), np.eye(4), atol=1e-12)
    np.testing.assert_allclose(transforms.invert(pose), np.linalg.inv(pose), atol=1e-11)


@given(poses, poses, arrays(np.float64, (4, 3), elements=st.floats(-5, 5)))
def test_composition_is_one_transform_after_the_other(
    a_from_b: np.ndarray, b_from_c: np.ndarray, points_c: np.ndarray
) -> None:
    at_once = transforms.transform_points(a_from_b @ b_from_c, points_c)
    in_turn = transforms.transform_points(a_from_b, transforms.transform_points(b_from_c, points_c))
    np.testing.assert_allclose(at_once, in_turn, atol=1e-11)


@given(poses)
def test_position_and_quaternion_round_trip(pose: np.ndarray) -> None:
    position, quaternion = transforms.position_quaternion(pose)
    assert quaternion[0] >= 0
    np.testing.assert_allclose(transforms.pose_from(position, quaternion), pose, atol=1e-12)


def test_quaternion_order_is_wxyz() -> None:
    half = np.sqrt(0.5)
    quarter_turn = transforms.pose_from(np.zeros(3), np.array([half, 0, 0, half]))
    np.testing.assert_allclose(
        transforms.transform_points(quarter_turn, np.array([1.0, 0, 0])), [0, 1, 0], atol=1e-12
    )


@given(positions, directions)
def test_frame_from_z_is_right_handed_with_the_given_axis(
    origin: np.ndarray, z_axis: np.ndarray
) -> None:
    frame = transforms.frame_from_z(origin, z_axis)
    assert is_rotation(frame[:3, :3])
    np.testing.assert_allclose(frame[:3, 2], z_axis / np.linalg.norm(z_axis), atol=1e-12)
    np.testing.assert_array_equal(frame[:3, 3], origin)
    np.testing.assert_array_equal(frame, transforms.frame_from_z(origin, z_axis))


@given(positions, directions)
def test_look_at_puts_the_target_on_the_optical_axis(
    eye: np.ndarray, direction: np.ndarray
) -> None:
    world_from_camera = transforms.look_at(eye, eye + direction)
    assert is_rotation(world_from_camera[:3, :3])
    target_camera = transforms.transform_points(
        transforms.invert(world_from_camera), eye + direction
    )
    on_axis = np.array([0.0, 0.0, float(np.linalg.norm(direction))])
    np.testing.assert_allclose(target_camera, on_axis, atol=1e-10)
    assert world_from_camera[2, 1] <= 1e-9, "y of the camera must not point up"


def test_look_at_from_the_front_has_x_right_and_y_down() -> None:
    world_from_camera = transforms.look_at(np.array([0, -1.0, 0]), np.zeros(3))
    np.testing.assert_allclose(
        world_from_camera[:3, :3],
        np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
        atol=1e-12,
    )


@given(poses, positions)
def test_vectors_turn_but_do_not_move(pose: np.ndarray, vector: np.ndarray) -> None:
    moved = transforms.transform_points(pose, vector) - transforms.transform_points(
        pose, np.zeros(3)
    )
    np.testing.assert_allclose(transforms.rotate_vectors(pose, vector), moved, atol=1e-11)


def test_random_rotations_are_uniform_and_repeatable() -> None:
    rng = np.random.default_rng(5)
    turned = np.array([transforms.random_rotation(rng) for _ in range(4000)])
    assert all(is_rotation(matrix) for matrix in turned[:50])
    # Each entry of a uniform rotation has mean 0 and variance 1/3 (0.036 is four sigma).
    assert np.abs(turned.mean(axis=0)).max() < 0.037
    np.testing.assert_allclose(turned.var(axis=0), 1 / 3, atol=0.025)
    again = transforms.random_rotation(np.random.default_rng(5))
    np.testing.assert_array_equal(turned[0], again)


def test_directions_of_length_zero_are_refused() -> None:
    with pytest.raises(ValueError, match="no direction"):
        transforms.frame_from_z(np.zeros(3), np.zeros(3))
    with pytest.raises(ValueError, match="no direction"):
        transforms.look_at(np.ones(3), np.ones(3))
