"""The film of an attempt: the pad everywhere, an arm's links where an arm was moving."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

from pipeline.artifacts.tensors import to_tensor
from pipeline.config import RunConfig
from pipeline.geometry.iiwa14 import LIMITS_RAD, LINKS
from pipeline.recording.evaluate import blueprint, show_attempts, shown_robot
from pipeline.recording.recording import Recorded, recording
from pipeline.simulation.iiwa14 import flange_from_gripper
from pipeline.stopwatch import Stopwatch
from schemas.softgrip.v1.evaluation_pb2 import Attempt
from tests.simulation.kinematics import flange_pose

CONFIG = RunConfig()
ROBOT = shown_robot(CONFIG)
FRAMES = 30
Rows = list[dict[str, Any]]


def attempt(seed: int, with_arm: bool) -> Attempt:
    """Joints that swing, and the gripper where they hold it."""
    ends = np.random.default_rng(seed).uniform(-0.5, 0.5, (2, 7)) * LIMITS_RAD
    joints = np.linspace(ends[0], ends[1], FRAMES)
    path = np.array([flange_pose(q) @ flange_from_gripper(CONFIG.evaluate.hand) for q in joints])
    path[:, :3, 3] += CONFIG.evaluate.arm.base_m
    arrays = {
        "world_from_gripper": path[-1],
        "gripper_path": path,
        "object_paths": np.empty((FRAMES, 0, 4, 4)),
        "base_wrench": np.zeros((FRAMES, 6)),
        "candidate_poses": path[:1],
        "candidate_quality": np.ones(1),
    }
    if with_arm:
        arrays["joint_path"] = joints
    made = Attempt(scene_id="s", outcome="lifted", states=["lift"] * FRAMES)
    for name, array in arrays.items():
        getattr(made, name).CopyFrom(to_tensor(array))
    return made


def stage_at(path: Path) -> Recorded:
    """A stage whose recording appears at ``path``."""
    return SimpleNamespace(
        name="evaluate", recording=path, recording_id="test", drawing=Stopwatch()
    )


def filmed(folder: Path, attempts: list[Attempt]) -> dict[str, Rows]:
    """Entity → rows of its columns, of a film of the attempts."""
    path = folder / "evaluate.rrd"
    with recording(stage_at(path), blueprint()) as stream:
        show_attempts(stream, attempts, {"s": []}, {}, "", ROBOT)
    rows: dict[str, Rows] = {}
    for chunk in RrdReader(path).stream():
        rows.setdefault(chunk.entity_path, []).extend(rows_of(chunk))
    return rows


def rows_of(chunk: Any) -> Rows:
    """Without the clock's times."""
    batch = chunk.to_record_batch()
    return list(batch.drop_columns([n for n in batch.schema.names if "log_t" in n]).to_pylist())


def test_every_link_is_shown_once_and_posed_at_every_frame(tmp_path: Path) -> None:
    attempts = [attempt(seed, with_arm=True) for seed in (0, 1)]
    rows = filmed(tmp_path, attempts)
    for shape in LINKS:
        link = rows[f"/world/arm/{shape.link}"]
        sizes = "Cylinders3D:lengths" if shape.length_m else "Ellipsoids3D:half_sizes"
        assert sum(bool(row.get(sizes)) for row in link) == 1
        frames = [row["frame"] for row in link if row.get("Transform3D:translation")]
        assert sorted(frames) == list(range(2 * FRAMES))


def test_the_last_link_ends_where_the_gripper_begins(tmp_path: Path) -> None:
    rows = filmed(tmp_path, [attempt(3, with_arm=True)])
    last, gripper = (places(rows[entity]) for entity in ("/world/arm/link7", "/world/gripper"))
    reach_m = LINKS[-1].to_m + CONFIG.evaluate.hand.length_m
    for frame in range(FRAMES):
        distance_m = np.linalg.norm(last[frame] - gripper[frame])
        assert distance_m == pytest.approx(reach_m, abs=1e-5)


def places(rows: Rows) -> dict[int, np.ndarray]:
    posed = [row for row in rows if row.get("Transform3D:translation")]
    return {row["frame"]: np.array(row["Transform3D:translation"][0]) for row in posed}


def test_a_gripper_that_floats_has_no_arm(tmp_path: Path) -> None:
    rows = filmed(tmp_path, [attempt(0, with_arm=False)])
    assert not [entity for entity in rows if entity.startswith("/world/arm")]
    assert len(places(rows["/world/gripper"])) == FRAMES


def test_the_pad_is_shown_at_its_size(tmp_path: Path) -> None:
    path = tmp_path / "pad.rrd"
    wide = RunConfig.model_validate(
        {
            "gripper": {"pad": {"radius_m": 0.075}},
        }
    )
    with recording(stage_at(path), blueprint()) as stream:
        show_attempts(stream, [], {}, {}, "", shown_robot(wide))
    shown = [
        row["Cylinders3D:radii"]
        for chunk in RrdReader(path).stream()
        for row in rows_of(chunk)
        if row.get("Cylinders3D:radii")
    ]
    assert sorted(radius for radii in shown for radius in radii) == pytest.approx([0.036, 0.075])


def test_an_arm_costs_the_film_little(tmp_path: Path) -> None:
    """Of the 0.8 MB that `RecordingConfig.attempts` allows one attempt, some seconds of it."""
    sizes = {}
    for with_arm in (False, True):
        folder = tmp_path / str(with_arm)
        folder.mkdir()
        filmed(folder, [attempt(seed, with_arm) for seed in range(10)])
        sizes[with_arm] = (folder / "evaluate.rrd").stat().st_size
    assert (sizes[True] - sizes[False]) / 10 < 1e5
