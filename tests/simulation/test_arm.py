"""The iiwa 14: closed-form kinematics against PhysX and Pinocchio; limits, reach, lines."""

import numpy as np
import pytest

from pipeline.config.evaluation import ArmConfig, HandConfig
from pipeline.config.scenes import ScenesConfig
from pipeline.control.viewpoints import gripper_above
from pipeline.geometry.iiwa14 import AXES, LIMITS_RAD, LINKS, link_poses
from pipeline.geometry.transforms import invert
from pipeline.physics.engine import new_world, sapien_pose
from pipeline.simulation.arm import ArmMover
from pipeline.simulation.iiwa14 import flange_from_gripper
from tests.simulation.kinematics import flange_pose

HAND, ARM = HandConfig(), ArmConfig()
UPRIGHT = np.eye(4)


@pytest.fixture(scope="module")
def arm() -> ArmMover:
    return ArmMover(new_world(ScenesConfig(), render=False), HAND, ARM, 0.025)


def above(x: float, y: float, z: float) -> np.ndarray:
    return gripper_above(np.array([x, y, z]), 0.0, UPRIGHT)


def test_stretched_up_the_flange_is_at_the_published_height() -> None:
    """360 + 420 + 400 + 126 mm over the foot; R820: the wrist's centre 820 mm from the shoulder."""
    np.testing.assert_allclose(flange_pose(np.zeros(7))[:3, 3], [0, 0, 1.306], atol=1e-12)
    bent = flange_pose(np.array([0, np.pi / 2, 0, 0, 0, 0, 0]))
    np.testing.assert_allclose(bent[:3, 3], [0.82 + 0.126, 0, 0.36], atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_urdf_articulation_and_pinocchio_agree_with_the_closed_form(
    arm: ArmMover, seed: int
) -> None:
    q = np.random.default_rng(seed).uniform(-1, 1, 7) * LIMITS_RAD
    expected = flange_pose(q) @ flange_from_gripper(HAND)
    expected[:3, 3] += ARM.base_m
    arm._articulation.set_qpos(q)
    np.testing.assert_allclose(arm.pose(), expected, atol=2e-6)
    links = {link.name: link.entity_pose for link in arm._articulation.links}
    for shape, pose in zip(LINKS, link_poses(q), strict=True):
        np.testing.assert_allclose(links[shape.link].p, pose[:3, 3] + ARM.base_m, atol=2e-6)
        turned = links[shape.link].to_transformation_matrix()[:3, :3]
        np.testing.assert_allclose(turned, pose[:3, :3], atol=2e-6)
    arm._model.compute_forward_kinematics(q)
    found = arm._model.get_link_pose(arm._pad_index)
    np.testing.assert_allclose(found.p + np.array(ARM.base_m), expected[:3, 3], atol=2e-6)
    arm.reset()


def test_a_target_within_reach_is_reached_within_limits(arm: ArmMover) -> None:
    target = above(0.05, 0.2, 0.1)
    q = arm.joints_at(target, arm.joints_rad())
    assert q is not None
    assert (np.abs(q) <= LIMITS_RAD).all()
    reached = flange_pose(q) @ flange_from_gripper(HAND)
    reached[:3, 3] += ARM.base_m
    np.testing.assert_allclose(reached, target, atol=1e-4)
    assert arm.reachable(target)


@pytest.mark.parametrize("place", [(0.6, 0.0, 0.1), (-0.62, 0.0, 0.1), (0.0, 0.0, 1.6)])
def test_a_target_out_of_reach_is_refused(arm: ArmMover, place: tuple[float, ...]) -> None:
    assert not arm.reachable(above(*place))


def test_a_straight_line_is_followed_within_limits_of_speed_and_range() -> None:
    world = new_world(ScenesConfig(), render=False)
    arm = ArmMover(world, HAND, ARM, 0.025)
    start, end = arm.pose(), above(-0.05, 0.15, 0.1)
    speeds, off_m, before = [], [], arm.joints_rad()
    steps = 360
    for number in range(1, steps + 1):
        goal = start.copy()
        goal[:3, 3] += number / steps * (end[:3, 3] - start[:3, 3])
        assert arm.drive(goal)
        world.step()
        now = arm.joints_rad()
        assert (np.abs(now) <= LIMITS_RAD).all()
        speeds.append(np.abs(now - before) / world.timestep)
        before = now
        off_m.append(float(np.linalg.norm(arm.pose()[:3, 3] - goal[:3, 3])))
    assert max(off_m) < 0.004
    assert off_m[-1] < 0.002
    assert (np.max(speeds, axis=0) <= [1.2 * axis.speed_rad_s for axis in AXES]).all()


def test_too_fast_a_line_lags_rather_than_break_a_joint() -> None:
    world = new_world(ScenesConfig(), render=False)
    arm = ArmMover(world, HAND, ARM, 0.025)
    far = above(-0.05, 0.3, 0.2)
    assert arm.drive(far)
    world.step()
    assert np.linalg.norm(arm.pose()[:3, 3] - far[:3, 3]) > 0.1
    for _ in range(480):
        assert arm.drive(far)
        world.step()
    assert np.linalg.norm(arm.pose()[:3, 3] - far[:3, 3]) < 0.002


def test_where_one_joint_comes_to_its_end_the_elbow_gives_way() -> None:
    """From the first posture, the sixth joint alone would have to bend past its 120 degrees."""
    world = new_world(ScenesConfig(), render=False)
    arm = ArmMover(world, HAND, ARM, 0.025)
    start, end = np.radians([[-30, 42, -5, -62, 20, 100, -44], [-42, 65, 4, -25, 20, 119, -42]])
    goal = flange_pose(end) @ flange_from_gripper(HAND)
    goal[:3, 3] += ARM.base_m
    arm._articulation.set_qpos(start)
    arm._q_rad = start
    assert arm._solution(goal, start) is None
    for _ in range(240):
        assert arm.drive(goal)
        world.step()
    np.testing.assert_allclose(arm.pose(), goal, atol=0.003)


def test_what_cannot_be_followed_is_said(arm: ArmMover) -> None:
    assert not arm.drive(above(0.9, 0.0, 0.1))
    arm.reset()


def test_the_gripper_is_ahead_of_the_flange() -> None:
    down = np.diag([1.0, -1.0, -1.0, 1.0])
    np.testing.assert_allclose(
        (down @ flange_from_gripper(HAND))[:3, 3], [0, 0, -HAND.length_m], atol=1e-12
    )
    assert sapien_pose(invert(flange_from_gripper(HAND))).p[2] == pytest.approx(HAND.length_m)
