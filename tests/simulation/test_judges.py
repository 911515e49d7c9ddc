"""The two judges: the same seal seen by both, and objects that hang by what the referee finds."""

import time
from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.config import RunConfig
from pipeline.config.evaluation import EvaluateConfig
from pipeline.config.referee import RefereeConfig
from pipeline.control.wrench_monitor import hanging_n
from pipeline.geometry.mesh import Mesh
from pipeline.gripper.pad import build_pad
from pipeline.physics.engine import add_body, new_world
from pipeline.simulation.gripper_body import SuctionGripper
from pipeline.simulation.judges import LabelJudge, RefereeJudge, build_judge
from pipeline.simulation.picking import build_mover
from pipeline.world.posed_bodies import PosedBodies, PosedScene
from tests.bodies import catalogue_object, pose_at

CONFIG = RunConfig()
PAD = build_pad(CONFIG.gripper.pad)
FULL_N = CONFIG.referee.fan_vacuum_pa * np.pi * 0.025**2
TOP_M = 0.04


def block(x_m: float = 0.08) -> trimesh.Trimesh:
    return trimesh.creation.box(extents=(x_m, 0.08, 0.04))


def scene(shape: trimesh.Trimesh) -> PosedScene:
    mesh = Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))
    return PosedBodies({3: mesh}, 1.0).at({3: pose_at(0, 0, 0.02)})


def pulling(force_n: float) -> np.ndarray:
    return np.array([0.0, 0.0, -force_n, 0.0, 0.0, 0.0])


def test_the_judge_is_named_in_the_configuration() -> None:
    assert isinstance(build_judge(RunConfig(), PAD), RefereeJudge)
    label = RunConfig(evaluate=EvaluateConfig(judge="label"))
    assert isinstance(build_judge(label, PAD), LabelJudge)


@pytest.mark.parametrize("judge", [RefereeJudge(CONFIG), LabelJudge(CONFIG, PAD)])
def test_a_block_seals_and_the_table_does_not(judge: RefereeJudge | LabelJudge) -> None:
    found = judge.find_seal(pose_at(0, 0, TOP_M), scene(block()))
    assert found is not None
    body, bearing = found
    assert body == 3
    assert bearing.closes
    assert bearing.pressure > 0.95
    assert bearing.bears(pulling(5.0))
    assert not bearing.bears(pulling(50.0))
    assert judge.find_seal(pose_at(0.3, 0.3, 0.0), scene(block())) is None


def test_the_referee_bears_a_closed_fans_vacuum_less_the_leak() -> None:
    found = RefereeJudge(CONFIG).find_seal(pose_at(0, 0, TOP_M), scene(block()))
    assert found is not None
    assert found[1].bears(pulling(0.95 * FULL_N))
    assert not found[1].bears(pulling(FULL_N))


def test_past_the_edge_the_referee_bears_less() -> None:
    pressures = [
        found[1].pressure
        for x_m in (0.0, 0.02, 0.03, 0.04)
        if (found := RefereeJudge(CONFIG).find_seal(pose_at(x_m, 0, TOP_M), scene(block())))
    ]
    assert len(pressures) == 4
    assert (np.diff(pressures) < 0).all()


def gripper_over(
    shape: trimesh.Trimesh, cache: Path, density_kg_m3: float, referee: RefereeConfig
) -> SuctionGripper:
    config = RunConfig(referee=referee)
    item = catalogue_object("it", shape, cache, density_kg_m3)
    world = new_world(config.scenes, render=False)
    body = add_body(world, item, pose_at(0, 0, 0.02), 1, (0.5, 0.5, 0.5), config.scenes)
    return SuctionGripper(world, {1: body}, {1: item}, PAD, config, build_mover(world, config))


def hangs(gripper: SuctionGripper, x_m: float = 0.0) -> bool:
    """Down on the block, vacuum on, slowly up; whether anything is felt on the joint."""
    for z_m, speed in ((TOP_M + 0.05, 0.5), (-0.02, 0.2)):
        for _ in range(200):
            reading = gripper.step(pose_at(x_m, 0, z_m), speed)
            if reading.arrived or reading.wrench[2] > 0.5:
                break
    gripper.vacuum(on=True)
    up = gripper.pose()
    up[2, 3] += 0.02
    for _ in range(200):
        reading = gripper.step(up, 0.01)
        if reading.arrived:
            break
    return hanging_n(reading) > 0.02


def density(share: float, volume_m3: float) -> float:
    """Weight as a share of a closed fan's force."""
    return float(share * FULL_N / 9.81 / volume_m3)


@pytest.mark.parametrize(("share", "holds"), [(0.9, True), (1.05, False)])
def test_a_block_hangs_by_what_the_referee_finds(tmp_path: Path, share: float, holds: bool) -> None:
    dense = density(share, 0.08 * 0.08 * 0.04)
    gripper = gripper_over(block(), tmp_path, dense, RefereeConfig())
    assert hangs(gripper) is holds
    assert gripper.seal_pressure > 0.95
    # What it bears through an attempt is less: there it is lifted and carried fast.
    assert 0.0 < gripper.borne_n < 0.9 * FULL_N
    assert gripper.sealed is holds


def test_a_long_block_peels_off_its_end(tmp_path: Path) -> None:
    """W = F / (1 + d / r): at d = 50 mm from the pad a third of what the middle bears."""
    dense = density(0.6, 0.20 * 0.08 * 0.04)
    held = {
        x_m: hangs(gripper_over(block(0.20), tmp_path, dense, RefereeConfig()), x_m)
        for x_m in (0.0, 0.05)
    }
    assert held == {0.0: True, 0.05: False}


def test_a_weaker_fan_loses_what_a_stronger_one_holds(tmp_path: Path) -> None:
    dense = density(0.5, 0.08 * 0.08 * 0.04)
    assert hangs(gripper_over(block(), tmp_path, dense, RefereeConfig()))
    weak = RefereeConfig(fan_vacuum_pa=4e3)
    assert not hangs(gripper_over(block(), tmp_path, dense, weak))


def test_asking_for_a_load_takes_less_than_a_physics_step_of_simulated_time() -> None:
    found = RefereeJudge(CONFIG).find_seal(pose_at(0.02, 0, TOP_M), scene(block()))
    assert found is not None
    start = time.process_time()
    for share in np.linspace(0.1, 1.0, 50):
        found[1].bears(pulling(share * FULL_N))
    assert (time.process_time() - start) / 50 < CONFIG.scenes.timestep_s
