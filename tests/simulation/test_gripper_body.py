"""The gripper in SAPIEN: seals, lifts, feels the weight, and loses what is too heavy."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.config import RunConfig
from pipeline.config.evaluation import (
    ArmConfig,
    EvaluateConfig,
    HandConfig,
    RobotName,
    SuctionConfig,
)
from pipeline.control.robot import Reading
from pipeline.control.transport import there_and_back
from pipeline.control.wrench_monitor import hanging_n
from pipeline.gripper.pad import build_pad
from pipeline.physics.engine import add_body, new_world
from pipeline.simulation.gripper_body import SuctionGripper
from pipeline.simulation.iiwa14 import flange_from_gripper
from pipeline.simulation.picking import build_mover
from tests.bodies import catalogue_object, pose_at
from tests.simulation.kinematics import flange_pose

BLOCK = (0.08, 0.08, 0.04)
TOP_M = 0.04
SPEED_M_S = 0.5
PULL_N = 8000.0 * np.pi * 0.025**2  # of a full seal, to the polygon's share of the circle


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("parts")


def gripper_over(
    shape: trimesh.Trimesh,
    cache: Path,
    density_kg_m3: float = 300.0,
    vacuum_pa: float = 8000.0,
    robot: RobotName = "floating",
) -> SuctionGripper:
    suction = SuctionConfig(vacuum_pa=vacuum_pa)
    config = RunConfig(evaluate=EvaluateConfig(suction=suction, robot=robot, judge="label"))
    item = catalogue_object("it", shape, cache, density_kg_m3)
    world = new_world(config.scenes, render=False)
    lowest = float(item.mesh.vertices_m[:, 2].min())
    body = add_body(world, item, pose_at(0, 0, -lowest), 1, (0.5, 0.5, 0.5), config.scenes)
    mover = build_mover(world, config)
    pad = build_pad(config.gripper.pad)
    return SuctionGripper(world, {1: body}, {1: item}, pad, config, mover)


def block() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=BLOCK)


def went(gripper: SuctionGripper, pose: np.ndarray, speed_m_s: float = SPEED_M_S) -> Reading:
    """Step until there, or until the pad touches."""
    for _ in range(200):
        reading = gripper.step(pose, speed_m_s)
        if reading.arrived or (reading.wrench[2] > 0.5):
            return reading
    raise AssertionError("neither arrived nor touched")


def sealed(gripper: SuctionGripper, x_m: float = 0.0) -> bool:
    """Go down on the block from above, vacuum on; whether something hangs on the joint."""
    went(gripper, pose_at(x_m, 0, TOP_M + 0.05))
    went(gripper, pose_at(x_m, 0, -0.02), 0.2)
    gripper.vacuum(on=True)
    reading = went(gripper, gripper.pose() + pose_at(0, 0, 0.01) - np.eye(4), 0.1)
    return hanging_n(reading) > 0.02


def lifted(gripper: SuctionGripper) -> bool:
    up = gripper.pose()
    up[2, 3] += 0.13
    return hanging_n(went(gripper, up, 0.25)) > 0.02


def test_a_block_is_sealed_lifted_and_shaken(cache: Path) -> None:
    gripper = gripper_over(block(), cache)
    assert sealed(gripper)
    assert gripper.target == 1
    assert gripper.seal_pressure == pytest.approx(1.0, abs=1e-3)
    assert gripper.reached_quality == pytest.approx(1.0, abs=1e-3)
    assert lifted(gripper)
    gripper.shake()
    assert gripper.lifted_m() >= 0.10
    assert all(sample.joints_rad.size == 0 for sample in gripper.samples)


def test_the_arm_lifts_the_same_block(cache: Path) -> None:
    gripper = gripper_over(block(), cache, robot="iiwa14")
    assert sealed(gripper)
    assert gripper.seal_pressure == pytest.approx(1.0, abs=1e-2)
    assert lifted(gripper)
    gripper.shake()
    assert gripper.lifted_m() >= 0.10
    for sample in gripper.samples:
        pose = flange_pose(sample.joints_rad) @ flange_from_gripper(HandConfig())
        pose[:3, 3] += ArmConfig().base_m
        np.testing.assert_allclose(sample.world_from_gripper, pose, atol=1e-5)


def test_the_pad_stops_where_it_touches(cache: Path) -> None:
    gripper = gripper_over(block(), cache)
    went(gripper, pose_at(0, 0, TOP_M + 0.05))
    reading = went(gripper, pose_at(0, 0, -0.02), 0.2)
    assert reading.wrench[2] > 0.5
    assert reading.world_from_gripper[2, 3] == pytest.approx(TOP_M, abs=2e-4)


def test_the_base_feels_the_weight_and_its_moment(cache: Path) -> None:
    gripper = gripper_over(block(), cache)
    aside_m = 0.01
    assert sealed(gripper, aside_m)
    assert lifted(gripper)
    reading = gripper.shake()
    weight_n = 9.81 * 300.0 * np.prod(BLOCK)
    assert reading.wrench[:3] == pytest.approx([0, 0, -weight_n], rel=0.01, abs=0.01)
    # The centre of mass hangs at x = -aside in GCS: M_y = z F_x - x F_z.
    assert reading.wrench[4] == pytest.approx(-aside_m * weight_n, rel=0.05)


@pytest.mark.parametrize(("share", "holds"), [(0.85, True), (1.05, False)])
def test_weights_just_under_and_just_over_the_limit(cache: Path, share: float, holds: bool) -> None:
    """F_v of Eq. (7) in newtons; slowly up, as acceleration counts as weight does."""
    dense = share * 0.997 * PULL_N / 9.81 / float(np.prod(BLOCK))
    gripper = gripper_over(block(), cache, density_kg_m3=dense)
    went(gripper, pose_at(0, 0, TOP_M + 0.05))
    went(gripper, pose_at(0, 0, -0.02), 0.2)
    gripper.vacuum(on=True)
    up = gripper.pose()
    up[2, 3] += 0.02
    assert (hanging_n(went(gripper, up, 0.005)) > 0.02) is holds


def test_acceleration_breaks_what_stillness_holds(cache: Path) -> None:
    dense = 0.85 * PULL_N / 9.81 / float(np.prod(BLOCK))
    gripper = gripper_over(block(), cache, density_kg_m3=dense)
    went(gripper, pose_at(0, 0, TOP_M + 0.05))
    went(gripper, pose_at(0, 0, -0.02), 0.2)
    gripper.vacuum(on=True)
    assert not lifted(gripper)


@pytest.mark.parametrize(("acceleration_m_s2", "holds"), [(3.0, True), (9.0, False)])
def test_transport_pulls_sideways_with_mass_times_acceleration(
    cache: Path, acceleration_m_s2: float, holds: bool
) -> None:
    """Eq. (8): at 0.4 of F_v in weight the side force passes √3/3 μ F_v from 7.1 m/s² on."""
    dense = 0.4 * PULL_N / 9.81 / float(np.prod(BLOCK))
    gripper = gripper_over(block(), cache, density_kg_m3=dense)
    assert sealed(gripper)
    assert lifted(gripper)
    before, from_s = gripper.pose(), gripper.time_s
    assert (hanging_n(gripper.carry(acceleration_m_s2)) > 0.02) is holds
    np.testing.assert_allclose(gripper.pose(), before, atol=1e-6)
    way = [
        s.world_from_gripper[:3, 3] - before[:3, 3] for s in gripper.samples if s.time_s > from_s
    ]
    assert np.abs(way)[:, 2].max() < 1e-6
    assert np.linalg.norm(way, axis=1).max() == pytest.approx(8.0 * 0.025, rel=0.05)


def test_a_leg_is_full_acceleration_and_full_braking() -> None:
    times = np.linspace(0, 2.5, 2501)
    share = np.array([there_and_back(t) for t in times])
    assert share[[0, 1000, 2000, 2500]].tolist() == [0.0, 1.0, 0.0, 0.0]
    curvature = np.diff(share, 2) / 1e-6
    assert np.abs(curvature).max() == pytest.approx(4.0, rel=1e-3)
    assert (np.abs(np.abs(curvature[:1990]) - 4.0) < 0.01).mean() > 0.99


def test_off_centre_the_same_weight_peels(cache: Path) -> None:
    """Moment about y of m g x over the limit F_v r_v: at 0.7 of F_v, from x = 0.029 on."""
    long = trimesh.creation.box(extents=(0.20, 0.08, 0.04))
    dense = 0.7 * PULL_N / 9.81 / (0.20 * 0.08 * 0.04)
    held = {}
    for x_m in (0.0, 0.05):
        gripper = gripper_over(long, cache, density_kg_m3=dense)
        went(gripper, pose_at(x_m, 0, TOP_M + 0.05))
        went(gripper, pose_at(x_m, 0, -0.02), 0.2)
        gripper.vacuum(on=True)
        up = gripper.pose()
        up[2, 3] += 0.02
        held[x_m] = hanging_n(went(gripper, up, 0.005)) > 0.02
    assert held == {0.0: True, 0.05: False}


def test_too_little_vacuum_loses_what_more_would_hold(cache: Path) -> None:
    assert not sealed(gripper_over(block(), cache, vacuum_pa=100.0))


@pytest.mark.parametrize(("x_m", "holds"), [(0.0, True), (0.055, False)])
def test_a_pad_over_the_edge_does_not_seal(cache: Path, x_m: float, holds: bool) -> None:
    assert sealed(gripper_over(block(), cache), x_m) is holds


def test_a_hole_leaves_the_pressure_of_what_is_left_of_reg_v(cache: Path) -> None:
    """Vertices up to 12 mm hang over the hole, so triangles up to the ring at 14 mm are open."""
    ring = trimesh.creation.annulus(r_min=0.0127, r_max=0.05, height=0.03, sections=64)
    gripper = gripper_over(ring, cache)
    assert sealed(gripper)
    assert gripper.seal_pressure == pytest.approx((1 - (14 / 20) ** 2) ** 2, rel=1e-6)


def test_a_hole_as_wide_as_reg_v_does_not_seal(cache: Path) -> None:
    """The pad rests on the ring all around, and nothing of Reg.V is covered."""
    ring = trimesh.creation.annulus(r_min=0.0197, r_max=0.05, height=0.03, sections=64)
    gripper = gripper_over(ring, cache)
    assert not sealed(gripper)
    assert gripper.seal_pressure == 0.0


def test_the_table_is_no_target(cache: Path) -> None:
    gripper = gripper_over(block(), cache)
    went(gripper, pose_at(0.3, 0.3, 0.05))
    went(gripper, pose_at(0.3, 0.3, -0.02), 0.2)
    gripper.vacuum(on=True)
    assert gripper.target == 0


def test_the_stem_stops_on_a_wall(cache: Path) -> None:
    """Driven sideways into a heavy block, the stem is pushed back at the base."""
    tall = trimesh.creation.box(extents=(0.08, 0.08, 0.2))
    gripper = gripper_over(tall, cache, density_kg_m3=3000.0)
    went(gripper, pose_at(0.12, 0, 0.02))
    reading = [gripper.step(pose_at(0.0, 0, 0.02), SPEED_M_S) for _ in range(6)]
    assert max(r.peak_n for r in reading) > 15.0
    assert max(r.wrench[0] for r in reading) > 1.0
