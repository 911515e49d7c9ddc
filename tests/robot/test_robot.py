"""The example's driver on a fake cell: the policy of SAPIEN picks, unchanged, and all is logged."""

import json
import math
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.config import RunConfig
from pipeline.control.viewpoints import gripper_above
from pipeline.errors import CalibrationError
from pipeline.interchange.episodes import read_episodes
from pipeline.robot.arm import DrivenRobot
from pipeline.robot.calibration import read_calibration
from pipeline.robot.eyes import DrivenEyes, in_range
from pipeline.world.cameras import points_of_depth
from schemas.softgrip.v1.evaluation_pb2 import Attempt
from stages.robot import next_number, opened_driver, robot
from tests.robot import vendor
from tests.robot.conftest import EXAMPLE, ROOT, calibration, world_of
from tests.robot.vendor import World

Cell = tuple[Path, World]


@pytest.fixture(scope="module")
def logged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, list[Attempt]]]:
    """Two attempts in one cell: a smooth box is nearer to the camera than a porous one."""
    folder = tmp_path_factory.mktemp("log")
    content = calibration()
    path = folder / "calibration.json"
    path.write_text(json.dumps(content))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vendor, "WORLD", world_of(content), raising=False)
        patch.setitem(__import__("sys").modules, "vendor", vendor)
        robot(EXAMPLE, path, attempts=2, network="analytic", run="default", out=folder)
        assert next_number(folder) == 2
        attempts = []
        for file in sorted(folder.glob("attempt_*.mcap")):
            with open_artifact(file) as artifact:
                attempts += [attempt for _, attempt in artifact.messages(Attempt)]
        yield folder, attempts


def test_the_policy_of_the_simulation_picks_on_a_robot(
    logged: tuple[Path, list[Attempt]],
) -> None:
    lifted, failed = logged[1]
    assert (lifted.outcome, lifted.cause) == ("lifted", "")
    assert lifted.weight_n == pytest.approx(0.3 * vendor.GRAVITY_M_S2, rel=1e-3)
    assert lifted.lifted_height_m > RunConfig().evaluate.lift.height_m
    assert lifted.carried_m_s2 == 5.0
    assert lifted.seal_pressure == pytest.approx((55_000 - 1_000) / (60_000 - 1_000))
    reached = from_tensor(lifted.reached_pose)
    assert reached[2, 3] == pytest.approx(0.06, abs=0.004)  # on top of the box, pressed little
    assert (failed.outcome, failed.cause) == ("failed", "no seal")
    assert failed.seal_pressure == pytest.approx(0.0)
    for attempt in (lifted, failed):
        assert attempt.judge == "robot"
        assert np.isnan(attempt.reached_quality)
        assert attempt.corrections >= 5


def test_contacts_are_logged_with_what_was_measured_around_them(
    logged: tuple[Path, list[Attempt]],
) -> None:
    lifted, failed = logged[1]
    # Both boxes are flat, so which one is rated best is a matter of thousandths.
    *refused, tried = lifted.contacts
    assert tried.held
    assert tried.lifted
    for attempt in (lifted, failed):
        assert len(attempt.contacts) == attempt.seals == attempt.regrasps + 1
    refused += failed.contacts
    assert not any(one.held or one.lifted for one in refused)
    tops_m = [from_tensor(one.world_from_contact)[2, 3] for one in (tried, *refused)]
    # The smooth box alone is held: every contact that was not lies on the porous one.
    assert tops_m == pytest.approx([0.06] + [0.04] * len(refused), abs=0.002)
    for one in (tried, *refused):
        mask = from_tensor(one.cloud_mask).astype(bool)
        cloud = from_tensor(one.cloud).astype(np.float64)
        assert mask.mean() > 0.9
        under_pad = mask & (np.hypot(cloud[..., 0], cloud[..., 1]) < 1)  # in units of r_G
        assert (
            np.abs(cloud[under_pad][:, 2]).max() < 0.01
        )  # a box's flat top; edges lie further out
        assert from_tensor(one.world_from_contact)[2, 2] > 0.99


def test_a_step_says_where_the_pad_was_and_what_it_saw(
    logged: tuple[Path, list[Attempt]],
) -> None:
    attempt = logged[1][0]
    time_s = from_tensor(attempt.time_s)
    rate_hz = RunConfig().evaluate.policy.rate_hz
    assert np.median(np.diff(time_s)) == pytest.approx(1 / rate_hz, rel=0.1)
    assert len(attempt.states) == len(time_s) == len(from_tensor(attempt.pressure))
    wrist = [one for one in attempt.seen if one.camera == "wrist"]
    assert len(wrist) >= 8
    episodes = read_episodes(logged[0] / "attempt_00000.mcap", "closed-loop")
    assert episodes[0].success


@pytest.fixture
def parts(cell: Cell) -> tuple[DrivenEyes, DrivenRobot, World]:
    held, config = read_calibration(cell[0]), RunConfig()
    driver = opened_driver(EXAMPLE)
    return DrivenEyes(driver, held, config), DrivenRobot(driver, held, config), cell[1]


def test_bias_and_the_hands_weight_are_taken_off_in_every_pose(
    parts: tuple[DrivenEyes, DrivenRobot, World],
) -> None:
    _, arm, world = parts
    arm.begin()
    place = gripper_above(np.array([0.0, 0.0, 0.3]), 0.0, np.eye(4))
    tilt = np.deg2rad(25)
    place[:3, :3] = [
        [np.cos(tilt), 0, np.sin(tilt)],
        [0, 1, 0],
        [-np.sin(tilt), 0, np.cos(tilt)],
    ]
    for _ in range(60):
        reading = arm.step(place, 0.8)
    assert reading.arrived
    assert reading.followed
    assert reading.world_from_gripper == pytest.approx(place, abs=2e-3)
    assert np.abs(reading.wrench).max() < 1e-6
    # A load that hangs at the pad pulls along world -z, in the axes of the gripper.
    world.held = vendor.Box(world.pad()[:3, 3].copy(), np.full(3, 0.01), 0.5)
    loaded = arm.step(place, 0.8)
    down = place[:3, :3].T @ [0.0, 0.0, -0.5 * vendor.GRAVITY_M_S2]
    assert loaded.wrench[:3] == pytest.approx(down, abs=1e-2)
    pad_from_flange = np.linalg.inv(world.flange_from_gripper)[:3, 3]
    assert loaded.wrench[3:] == pytest.approx(np.cross(-pad_from_flange, down), abs=1e-2)


def test_the_arm_stops_where_the_pad_touches(
    parts: tuple[DrivenEyes, DrivenRobot, World],
) -> None:
    _, arm, world = parts
    arm.begin()
    for height_m in (0.15, 0.0):
        target = gripper_above(np.array([0.0, 0.0, height_m]), 0.0, np.eye(4))
        for _ in range(60):
            reading = arm.step(target, 0.25)
            if reading.wrench[2] > RunConfig().evaluate.policy.contact_n:
                break
    deep_m = world.boxes[0].top_m - world.pad()[2, 3]
    assert 0 < deep_m < 0.25 * 0.008 * 2  # two of the driver's periods


def test_pictures_and_calibration_give_the_boxes_where_they_are(
    parts: tuple[DrivenEyes, DrivenRobot, World],
) -> None:
    eyes, arm, world = parts
    arm.begin()
    static = eyes.static()
    assert static is not None
    above = gripper_above(np.array([0.02, 0.0, 0.3]), 0.0, np.eye(4))
    for _ in range(60):
        arm.step(above, 0.8)
    assert eyes.static() is static  # the arm is in the way now
    wrist = eyes.wrist(np.array([0.0, 0.0, 0.06]), 0.05)
    assert wrist is not None
    assert wrist.camera.width_px < world.cameras["wrist"]["width"]
    for picture in (static[0], wrist):
        points, _, _ = points_of_depth(picture.depth_m, picture.camera, 1, above_m=0.05)
        assert len(points) > 300
        assert points[:, 2] == pytest.approx(0.06, abs=1e-5)
        low, high = points.min(axis=0), points.max(axis=0)
        assert (low[:2] > [-0.061, -0.051]).all()
        assert (high[:2] < [0.061, 0.051]).all()


def test_the_grippers_own_points_are_cut_out(
    parts: tuple[DrivenEyes, DrivenRobot, World],
) -> None:
    eyes, arm, world = parts
    arm.begin()
    tip = arm.pose()[:3, 3]
    world.boxes = [vendor.Box(tip + np.array([0.0, 0.0, 0.04]), np.array([0.01, 0.01, 0.02]), 1.0)]
    seen = eyes.wrist(tip, 0.06)
    assert seen is not None
    points, _, _ = points_of_depth(seen.depth_m, seen.camera, 1, above_m=0.1)
    assert len(points) == 0


def test_noise_that_would_count_as_an_object_is_told(cell: Cell) -> None:
    cell[1].noise_n = 0.5
    arm = DrivenRobot(opened_driver(EXAMPLE), read_calibration(cell[0]), RunConfig())
    with pytest.raises(CalibrationError, match=r"noise at rest is 0\.\d+ N.*tension_min_n.*Raise"):
        arm.begin()


@pytest.mark.parametrize(
    ("depth", "says"),
    [
        (np.full((212, 256), 900.0), "drivers often give millimetres"),
        (np.full((424, 512), 0.9), "512 by 424 pixels, and the calibrated one 256 by 212"),
    ],
)
def test_a_driver_that_gives_another_picture_is_told(
    cell: Cell, depth: np.ndarray, says: str
) -> None:
    camera = read_calibration(cell[0]).static[0]
    with pytest.raises(CalibrationError, match=says):
        in_range(depth, camera)


def test_pixels_that_were_not_measured_are_empty(cell: Cell) -> None:
    camera = read_calibration(cell[0]).static[0]
    depth = np.full((212, 256), 0.9)
    depth[0, :4] = [np.nan, -1.0, 0.1, 9.0]
    kept = in_range(depth, camera)
    assert (kept[0, :4] == 0).all()
    assert kept[0, 4] == 0.9
    assert not in_range(np.full((212, 256), np.nan), camera).any()


def changed(**values: Any) -> Callable[[dict[str, Any]], None]:
    return lambda content: content.update(values)


def camera_changed(**values: Any) -> Callable[[dict[str, Any]], None]:
    return lambda content: content["static_cameras"][0].update(values)


def in_millimetres(content: dict[str, Any]) -> None:
    for row in content["flange_from_gripper"]:
        row[3] *= 1 if row is content["flange_from_gripper"][3] else 1000


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (changed(world_from_base=None), "does not say world_from_base"),
        (changed(world_from_base=[[1, 0], [0, 1]]), "not 4 by 4 finite numbers"),
        (changed(flange_from_camera=np.diag([1, 1, -1, 1]).tolist()), "no rotation"),
        (in_millimetres, "in metres, not millimetres"),
        (changed(hand_mass_kg=800), "Weigh gripper and camera, in kg"),
        (changed(hand_centre_m="middle"), "not made of numbers"),
        (changed(vacuum_closed_pa=-60_000), "vacuum of a closed pad is the larger"),
        (changed(static_cameras=[]), "names no static_cameras"),
        (changed(home_m=[0, 0, -0.1]), "above the table"),
        (changed(wrist_camera=None), "there is no camera"),
        (camera_changed(world_from_camera=None), "has no pose"),
        (camera_changed(far_m=0.1), "measures from 0.5 to 0.1 m"),
        (camera_changed(D=[0.3, -0.2, 0, 0, 0]), "its lens has distortion"),
        (camera_changed(width=None), "no width and height"),
    ],
)
def test_a_calibration_that_cannot_be_is_told_in_one_sentence(
    tmp_path: Path, spoil: Callable[[dict[str, Any]], None], says: str
) -> None:
    content = calibration()
    spoil(content)
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(content))
    with pytest.raises(Exception, match=says) as told:
        read_calibration(path)
    assert str(path) in str(told.value)


def test_a_cell_without_a_pressure_sensor_has_no_pressure(tmp_path: Path) -> None:
    content = calibration()
    del content["vacuum_open_pa"], content["vacuum_closed_pa"]
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(content))
    assert math.isnan(read_calibration(path).pressure(math.nan))


def test_a_policy_that_there_is_not_is_told(cell: Cell, tmp_path: Path) -> None:
    with pytest.raises(typer.BadParameter, match="closed-loop, network, analytic, uncorrected"):
        robot(EXAMPLE, cell[0], policy="best", run="ci", out=tmp_path)


def test_a_file_that_is_no_driver_is_told(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match="is no Python file"):
        opened_driver(tmp_path / "none.py")
    (tmp_path / "empty.py").write_text("")
    with pytest.raises(CalibrationError, match=r"defines no open_driver\(\)"):
        opened_driver(tmp_path / "empty.py")
    (tmp_path / "broken.json").write_text("{")
    with pytest.raises(CalibrationError, match="cannot be read as JSON"):
        read_calibration(tmp_path / "broken.json")


def test_cleaning_a_run_keeps_what_a_robot_tried(tmp_path: Path) -> None:
    shutil.copy(ROOT / "Makefile", tmp_path)
    run = tmp_path / "runs" / "mine"
    for name in ("run.toml", "grasps.mcap", "logs/grasps.log", "robot/attempt_00000.mcap"):
        (run / name).parent.mkdir(parents=True, exist_ok=True)
        (run / name).touch()
    subprocess.run(["make", "-s", "clean", "RUN=mine"], cwd=tmp_path, check=True)
    left = {path.relative_to(run).as_posix() for path in run.rglob("*") if path.is_file()}
    assert left == {"run.toml", "robot/attempt_00000.mcap"}
