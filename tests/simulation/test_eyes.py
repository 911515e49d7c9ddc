"""Pictures of an imperfect robot: late, from elsewhere than believed, with the gripper in them."""

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.config import RunConfig
from pipeline.config.evaluation import HandConfig
from pipeline.config.grasps import PadConfig
from pipeline.config.imperfection import ImperfectionConfig
from pipeline.control.cloud import DepthPicture, merged_cloud
from pipeline.control.own_body import cut_gripper_out
from pipeline.control.viewpoints import gripper_above
from pipeline.geometry.transforms import look_at
from pipeline.sensing.depth_by_rays import measure_depth
from pipeline.simulation.eyes import SimulatedEyes, gripper_from_camera, gripper_mesh, place_camera
from pipeline.simulation.gripper_body import SuctionGripper
from pipeline.simulation.imperfection import Calibration, draw_calibration
from pipeline.simulation.picking import Clutter
from pipeline.simulation.scenarios import SCENARIOS, make_trials
from pipeline.world.cameras import camera_at
from pipeline.world.posed_bodies import PosedBodies
from tests.bodies import catalogue_object, pose_at

SPEED_M_S = 0.1
PERFECT = Calibration(np.zeros(6), np.eye(4), np.eye(4)[None])


class StillWorld:
    """A block that went along x at a steady speed, under a gripper that stands still."""

    def __init__(self) -> None:
        self.gripper = gripper_above(np.array([0.0, 0.0, 0.04]), 0.28, np.eye(4))
        self.waited_s = 0.0

    def state_before(self, age_s: float) -> tuple[np.ndarray, dict[int, np.ndarray]]:
        return self.gripper, {1: pose_at(-SPEED_M_S * age_s, 0.0, 0.02)}

    def wait(self, time_s: float) -> None:
        self.waited_s += time_s


def exact(scale: float) -> RunConfig:
    return RunConfig.model_validate(
        {"sensing": {"disturbed": False}, "evaluate": {"imperfection": {"scale": scale}}}
    )


def eyes_on(
    config: RunConfig, calibration: Calibration, cache: Path, world: StillWorld
) -> SimulatedEyes:
    block = catalogue_object("block", trimesh.creation.box(extents=(0.06, 0.06, 0.04)), cache)
    return SimulatedEyes(world, {1: block}, config, calibration, np.random.default_rng(0))


def middle_m(picture: DepthPicture | None) -> np.ndarray:
    """Middle of the block's top face as it was measured."""
    assert picture is not None
    points = merged_cloud([picture], 0.002, 0.03).points_m
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)


def test_a_late_picture_shows_a_moving_block_speed_times_age_behind(tmp_path: Path) -> None:
    seen = {}
    for scale in (0.0, 1.0, 2.0):
        config = exact(scale)
        eyes = eyes_on(config, PERFECT, tmp_path, StillWorld())
        picture = eyes.wrist(np.array([0.0, 0.0, 0.04]), 0.08)
        assert picture is not None
        assert picture.age_s == config.evaluate.imperfection.picture_age_s
        seen[scale] = middle_m(picture)[0]
    age_s = exact(1.0).evaluate.imperfection.picture_age_s
    assert seen[1.0] - seen[0.0] == pytest.approx(-SPEED_M_S * age_s, abs=1e-3)
    assert seen[2.0] - seen[0.0] == pytest.approx(-2 * SPEED_M_S * age_s, abs=1e-3)


def test_the_cameras_beside_the_table_are_waited_for(tmp_path: Path) -> None:
    world, config = StillWorld(), exact(2.0)
    eyes_on(config, PERFECT, tmp_path, world).static()
    assert world.waited_s == 2 * config.evaluate.imperfection.latency_s


def test_an_error_of_the_hand_eye_shifts_what_is_seen_by_itself(tmp_path: Path) -> None:
    """Believed 5 mm aside along an axis of the camera, all lies 5 mm aside along it."""
    config, world = exact(1.0), StillWorld()
    aside = pose_at(0.005, 0.0, 0.0)
    wrong = Calibration(np.zeros(6), aside, np.eye(4)[None])
    place = np.array([0.0, 0.0, 0.04])
    right = eyes_on(config, PERFECT, tmp_path, world).wrist(place, 0.12)
    picture = eyes_on(config, wrong, tmp_path, world).wrist(place, 0.12)
    true_pose = world.gripper @ gripper_from_camera(config.evaluate.hand)
    shift = middle_m(picture) - middle_m(right)
    np.testing.assert_allclose(shift, 0.005 * true_pose[:3, 0], atol=1e-3)


def test_an_error_of_a_camera_beside_the_table_shifts_its_cloud(tmp_path: Path) -> None:
    shifts = []
    for aside_m in (0.0, 0.004):
        wrong = Calibration(np.zeros(6), np.eye(4), pose_at(aside_m, 0.0, 0.0)[None])
        pictures = eyes_on(exact(1.0), wrong, tmp_path, StillWorld()).static()
        assert pictures is not None
        shifts.append(middle_m(pictures[0]))
    assert np.linalg.norm(shifts[1] - shifts[0]) == pytest.approx(0.004, abs=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_an_error_beside_the_table_leaves_the_table_level(seed: int, tmp_path: Path) -> None:
    """Large errors of the calibration make no objects of the table."""
    config = ImperfectionConfig(scale=4.0)
    wrong = draw_calibration(config, 1, np.random.default_rng(seed))
    pictures = eyes_on(exact(1.0), wrong, tmp_path, StillWorld()).static()
    assert pictures is not None
    points = merged_cloud(pictures, 0.002, 0.001).points_m
    assert (np.hypot(points[:, 0], points[:, 1]) < 0.08).all()


def test_the_gripper_hides_what_is_behind_it_and_is_no_object(tmp_path: Path) -> None:
    """Close above the block the pad hides part of it; what is left belongs to the block."""
    world = StillWorld()
    world.gripper = pose_at(0.0, 0.0, 0.07)
    counts = {}
    for scale in (0.0, 1e-9):
        picture = eyes_on(exact(scale), PERFECT, tmp_path, world).wrist(np.zeros(3), 0.12)
        assert picture is not None
        points = merged_cloud([picture], 0.002, 0.01).points_m
        assert (np.abs(points[:, :2]) < 0.031).all()
        assert points[:, 2].max() < 0.041
        counts[scale] = len(points)
    assert counts[1e-9] < 0.9 * counts[0.0]


def test_a_cut_takes_the_body_and_leaves_the_rest() -> None:
    """A picture of the gripper alone over the table: only the table is left."""
    hand, pad = HandConfig(), PadConfig()
    world_from_gripper = gripper_above(np.zeros(3), 0.1, np.eye(4))
    eyes = np.array([0.24, 0.0, 0.85])
    config = RunConfig()
    camera = place_camera(
        camera_at("static", config.cameras.static, np.zeros(3), 1.0, 1.0, 0.0),
        look_at(eyes, np.zeros(3)),
    )
    scene = PosedBodies({1: gripper_mesh(hand, pad)}, 1.0).at({1: world_from_gripper})
    depth_m, shown = measure_depth(camera, scene, None, None)
    assert (shown == 1).sum() > 500
    cut = cut_gripper_out(DepthPicture(depth_m, camera), world_from_gripper, hand, pad, 0.001)
    np.testing.assert_array_equal(cut.depth_m == 0.0, (shown == 1) | (depth_m == 0.0))


@lru_cache(maxsize=1)
def moving_clutter() -> Clutter:
    rng = np.random.default_rng(0)
    scene, objects = next(make_trials(SCENARIOS[0], 1, 300.0, rng))
    return Clutter(scene, objects, exact(1.0), rng)


def test_time_passes_for_the_world_while_the_policy_thinks() -> None:
    """The block on a conveyor goes on; a while ago it was where it was then."""
    gripper: SuctionGripper = moving_clutter().gripper
    gripper.begin()
    gripper.conveyor_m_s = SPEED_M_S
    start = gripper.state_before(0.0)[1][1][0, 3]
    gripper.think()
    thought_s = exact(1.0).evaluate.imperfection.choice_s
    assert gripper.time_s == pytest.approx(thought_s, abs=0.005)
    now = gripper.state_before(0.0)[1][1][0, 3]
    assert now - start == pytest.approx(SPEED_M_S * gripper.time_s, abs=1e-3)
    for age_s in (0.03, 0.1):
        then = gripper.state_before(age_s)[1][1][0, 3]
        assert now - then == pytest.approx(SPEED_M_S * age_s, abs=5e-4)


def test_what_is_felt_before_taring_is_the_bias() -> None:
    clutter = moving_clutter()
    clutter.gripper.begin()
    home = clutter.gripper.pose()
    felt = np.array([clutter.gripper.step(home, 0.1).wrench for _ in range(30)])
    clutter.gripper.tare()
    tared = np.array([clutter.gripper.step(home, 0.1).wrench for _ in range(5)])
    config = exact(1.0).evaluate.imperfection
    # Five spreads of the mean of 30 readings around a bias that is far larger than what is left.
    assert (
        felt.std(axis=0) < 2 * np.repeat([config.force_noise_n, config.moment_noise_nm], 3)
    ).all()
    assert np.abs(felt.mean(axis=0)[:3]).max() > np.abs(tared.mean(axis=0)[:3]).max()
