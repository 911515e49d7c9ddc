"""The pad in the film of an attempt: as the referee found it, from the last seal on."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from rerun.chunk import RrdReader

from pipeline.artifacts.tensors import to_tensor
from pipeline.config import RunConfig
from pipeline.recording.evaluate import blueprint, show_attempts, shown_robot
from pipeline.recording.pads import rings, sealed_pad
from pipeline.recording.recording import recording
from pipeline.referee.seal import referee_of
from schemas.softgrip.v1.evaluation_pb2 import Attempt
from tests.bodies import mesh_of, pose_at
from tests.recording.test_robot import Rows, rows_of, stage_at

CONFIG = RunConfig()
REFEREE = referee_of(CONFIG.referee, CONFIG.gripper.pad.radius_m)
BLOCK = mesh_of(trimesh.creation.box(extents=(0.08, 0.08, 0.04)))
TOP_M, DOWN, UP = 0.04, 6, 4
WEIGHT_N = 1.5


def attempt(judge: str = "referee", aside_m: float = 0.0) -> Attempt:
    """Down on a block in six steps, and up with it in four."""
    heights = [*np.linspace(TOP_M + 0.05, TOP_M, DOWN), *np.linspace(TOP_M, 0.08, UP + 1)[1:]]
    path = np.array([pose_at(aside_m, 0, z) for z in heights])
    block = np.array(
        [[pose_at(0, 0, 0.02 + max(z - TOP_M, 0.0) * (i >= DOWN))] for i, z in enumerate(heights)]
    )
    wrench = np.zeros((len(path), 6))
    wrench[DOWN:, 2] = -WEIGHT_N
    made = Attempt(
        scene_id="s",
        outcome="lifted",
        judge=judge,
        target="block",
        target_body=1,
        borne_n=9.0,
        states=["lift"] * len(path),
    )
    arrays = {
        "world_from_gripper": path[DOWN - 1],
        "reached_pose": path[DOWN - 1],
        "gripper_path": path,
        "object_paths": block,
        "base_wrench": wrench,
        "candidate_poses": path[:1],
        "candidate_quality": np.ones(1),
    }
    for name, array in arrays.items():
        getattr(made, name).CopyFrom(to_tensor(array))
    return made


def test_the_pad_is_found_again_where_the_vacuum_was_switched_on() -> None:
    pad = sealed_pad(attempt(), ["block"], {"block": BLOCK}, CONFIG)
    assert pad is not None
    assert pad.step == DOWN - 1
    found = rings(pad.seal, REFEREE.disc)
    # A flat top: the fan's vacuum under the middle, and a film as high as the roughness.
    assert found["vacuum"][0] > 0.9 * CONFIG.referee.fan_vacuum_pa
    assert found["gap"][0] == pytest.approx(1e3 * CONFIG.referee.roughness_m, rel=0.01)


def test_past_the_edge_the_gap_opens_and_the_vacuum_falls() -> None:
    pad = sealed_pad(attempt(aside_m=0.03), ["block"], {"block": BLOCK}, CONFIG)
    assert pad is not None
    found = rings(pad.seal, REFEREE.disc)
    assert found["gap"][-1] > found["gap"][0]
    assert found["vacuum"][-1] < found["vacuum"][0]


def test_another_judge_has_no_pad() -> None:
    assert sealed_pad(attempt("label"), ["block"], {"block": BLOCK}, CONFIG) is None


def test_the_film_shows_the_pad_from_the_seal_on_and_what_it_bears(tmp_path: Path) -> None:
    made = [attempt(), attempt("label")]
    pads = [sealed_pad(one, ["block"], {"block": BLOCK}, CONFIG) for one in made]
    path = tmp_path / "evaluate.rrd"
    with recording(stage_at(path), blueprint()) as stream:
        show_attempts(
            stream, made, {"s": ["block"]}, {"block": BLOCK}, "", shown_robot(CONFIG), pads, REFEREE
        )
    rows: dict[str, Rows] = {}
    for chunk in RrdReader(path).stream():
        rows.setdefault(chunk.entity_path, []).extend(rows_of(chunk))
    meshes = [
        row["frame"]
        for row in rows["/world/gripper/sealed/0000"]
        if row.get("Mesh3D:vertex_positions")
    ]
    assert meshes == [DOWN - 1]
    free = [row.get("frame") for row in rows["/world/gripper/pad"] if row.get("Cylinders3D:radii")]
    assert {0, DOWN + UP} <= set(free)  # as a disc when each attempt begins
    for name, value in (("hangs", WEIGHT_N), ("borne", 9.0)):
        last = [row for row in rows[f"/curves/load/{name}"] if row.get("Scalars:scalars")][-1]
        assert last["Scalars:scalars"] == [value]
    assert rows["/curves/vacuum"]
