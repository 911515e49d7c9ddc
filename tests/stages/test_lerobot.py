"""LeRobot v3 of the tiny run, read back by PyArrow by the published layout alone."""

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from PIL import Image

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from pipeline.geometry.transforms import pose_from
from pipeline.interchange.lerobot import FPS, sampled_at
from pipeline.interchange.reading import read_episodes
from schemas.softgrip.v1.evaluation_pb2 import Attempt
from stages.export import Format, export_run


@pytest.fixture(scope="module")
def exported(run: RunFolder) -> Path:
    return export_run(run, Format.LEROBOT, 0.5)


@pytest.fixture(scope="module")
def attempts(run: RunFolder) -> list[Attempt]:
    with open_artifact(run.artifact("evaluate")) as artifact:
        every = [attempt for _, attempt in artifact.messages(Attempt)]
    return [attempt for attempt in every if attempt.policy == "closed-loop"]


def data_of(exported: Path, info: dict[str, Any]) -> dict[str, Any]:
    path = exported / info["data_path"].format(chunk_index=0, file_index=0)
    columns: dict[str, Any] = pq.read_table(path).to_pydict()
    return columns


def info_of(exported: Path) -> dict[str, Any]:
    info: dict[str, Any] = json.loads((exported / "meta" / "info.json").read_text())
    return info


def test_every_column_is_a_feature_of_its_shape(exported: Path) -> None:
    info = info_of(exported)
    assert info["codebase_version"] == "v3.0"
    data = data_of(exported, info)
    assert set(data) == set(info["features"])
    assert len(data["index"]) == info["total_frames"]
    assert data["index"] == list(range(info["total_frames"]))
    for name, feature in info["features"].items():
        if feature["dtype"] == "image":
            picture = Image.open(io.BytesIO(data[name][0]["bytes"]))
            assert [picture.height, picture.width, 1] == feature["shape"]
        elif feature["shape"] != [1]:
            assert {len(row) for row in data[name]} == {feature["shape"][0]}


def test_episodes_are_the_attempts(exported: Path, attempts: list[Attempt]) -> None:
    info = info_of(exported)
    data = data_of(exported, info)
    rows = pq.read_table(exported / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert len(rows) == len(attempts) == info["total_episodes"]
    for row, attempt in zip(rows, attempts, strict=True):
        frames = slice(row["dataset_from_index"], row["dataset_to_index"])
        assert row["length"] == frames.stop - frames.start
        assert set(data["episode_index"][frames]) == {row["episode_index"]}
        assert np.diff(data["timestamp"][frames]) == pytest.approx(1 / FPS, abs=1e-5)
        time_s, path = from_tensor(attempt.time_s), from_tensor(attempt.gripper_path)
        for frame in (0, row["length"] // 2, row["length"] - 1):
            state = data["observation.state"][frames][frame]
            at = np.flatnonzero(time_s <= time_s[0] + frame / FPS + 1e-6)[-1]
            pose = pose_from(np.array(state[:3]), np.array(state[3:]))
            assert pose == pytest.approx(path[at], abs=1e-5)
            wrench = from_tensor(attempt.base_wrench)[at]
            assert data["observation.wrench"][frames][frame] == pytest.approx(wrench, abs=1e-3)
        assert data["action"][frames][0] == data["observation.state"][frames][1]
        assert data["next.success"][frames][-1] == (attempt.outcome == "lifted")
        assert sum(data["next.done"][frames]) == 1
        shown = {picture.camera: picture for picture in attempt.pictures}
        for camera, picture in shown.items():
            png = data[f"observation.images.{camera}"][frames][0]["bytes"]
            read = np.asarray(Image.open(io.BytesIO(png)))
            assert (read == from_tensor(picture.depth_mm)).all()


def test_tasks_and_statistics(exported: Path) -> None:
    info = info_of(exported)
    tasks = pq.read_table(exported / "meta" / "tasks.parquet")
    assert json.loads(tasks.schema.metadata[b"pandas"])["index_columns"] == ["__index_level_0__"]
    assert tasks["task_index"].to_pylist() == [0]
    stats = json.loads((exported / "meta" / "stats.json").read_text())
    state = np.array(data_of(exported, info)["observation.state"])
    assert stats["observation.state"]["mean"] == pytest.approx(state.mean(axis=0))
    assert stats["observation.state"]["count"] == [len(state)]


def test_frames_take_the_last_sample_before_them() -> None:
    time_s = np.array([5.0, 5.05, 5.1, 5.1, 5.19, 5.3])
    assert sampled_at(time_s, 10).tolist() == [0, 3, 4, 5]


def test_a_policy_without_attempts_is_told(run: RunFolder) -> None:
    with pytest.raises(ArtifactError, match="holds no attempt of nobody"):
        read_episodes(run.artifact("evaluate"), "nobody")
