"""The floating gripper in SAPIEN: seals, lifts, feels the weight, and loses what is too heavy."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.config import RunConfig
from pipeline.config.evaluation import EvaluateConfig, SuctionConfig
from pipeline.gripper.pad import build_pad
from pipeline.simulation.engine import add_body, new_world
from pipeline.simulation.gripper_body import FloatingGripper
from tests.bodies import catalogue_object, pose_at

BLOCK = (0.08, 0.08, 0.04)
TOP_M = 0.04


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("parts")


def gripper_over(
    shape: trimesh.Trimesh, cache: Path, density_kg_m3: float = 300.0, vacuum_pa: float = 8000.0
) -> FloatingGripper:
    config = RunConfig(evaluate=EvaluateConfig(suction=SuctionConfig(vacuum_pa=vacuum_pa)))
    item = catalogue_object("it", shape, cache, density_kg_m3)
    world = new_world(config.scenes, render=False)
    lowest = float(item.mesh.vertices_m[:, 2].min())
    body = add_body(world, item, pose_at(0, 0, -lowest), 1, (0.5, 0.5, 0.5), config.scenes)
    return FloatingGripper(world, {1: body}, {1: item}, build_pad(config.gripper.pad), config)


def block() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=BLOCK)


def test_a_block_is_sealed_lifted_and_shaken(cache: Path) -> None:
    gripper = gripper_over(block(), cache)
    assert gripper.move(pose_at(0, 0, TOP_M + 0.02))
    assert gripper.seal()
    assert gripper.target == 1
    assert gripper.seal_pressure == pytest.approx(1.0, abs=1e-3)
    assert gripper.reached_quality == pytest.approx(1.0, abs=1e-3)
    assert gripper.lift()
    assert gripper.shake()
    assert gripper.lifted_height_m >= 0.10


def test_the_pad_feels_the_weight(cache: Path) -> None:
    gripper = gripper_over(block(), cache)
    gripper.move(pose_at(0, 0, TOP_M + 0.02))
    gripper.seal()
    gripper.lift()
    weight_n = 9.81 * 300.0 * np.prod(BLOCK)
    pulls = np.array([-load[2] for _, _, _, load, state in gripper.samples if state == "observe"])
    assert pulls[-3:] == pytest.approx(weight_n, rel=0.01)


def test_too_heavy_an_object_is_lost(cache: Path) -> None:
    pull_n = 8000.0 * np.pi * 0.025**2
    too_dense = 1.5 * pull_n / 9.81 / float(np.prod(BLOCK))
    gripper = gripper_over(block(), cache, density_kg_m3=too_dense)
    gripper.move(pose_at(0, 0, TOP_M + 0.02))
    assert gripper.seal()
    assert not gripper.lift()


def test_too_little_vacuum_loses_what_more_would_hold(cache: Path) -> None:
    gripper = gripper_over(block(), cache, vacuum_pa=100.0)
    gripper.move(pose_at(0, 0, TOP_M + 0.02))
    assert gripper.seal()
    assert not gripper.lift()


@pytest.mark.parametrize(("x_m", "sealed"), [(0.0, True), (0.055, False)])
def test_a_pad_over_the_edge_does_not_seal(cache: Path, x_m: float, sealed: bool) -> None:
    gripper = gripper_over(block(), cache)
    assert gripper.move(pose_at(x_m, 0, TOP_M + 0.02))
    assert gripper.seal() is sealed


def test_a_ring_of_holes_does_not_seal(cache: Path) -> None:
    ring = trimesh.creation.annulus(r_min=0.012, r_max=0.05, height=0.03, sections=64)
    gripper = gripper_over(ring, cache)
    assert gripper.move(pose_at(0, 0, 0.05))
    # The hole reaches within Reg.V: what is left of it cannot hold as a plate does.
    gripper.seal()
    assert gripper.seal_pressure < 0.9


def test_the_table_is_no_target(cache: Path) -> None:
    gripper = gripper_over(block(), cache)
    assert gripper.move(pose_at(0.3, 0.3, 0.02))
    assert not gripper.seal()
    assert gripper.target == 0
