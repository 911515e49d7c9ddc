"""LeRobot v3 of the tiny run, read back by PyArrow and PyAV by the published layout alone."""

import json
from pathlib import Path
from typing import Any

import av
import numpy as np
import pyarrow.parquet as pq
import pytest

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from pipeline.geometry.transforms import pose_from
from pipeline.interchange.episodes import read_episodes
from pipeline.interchange.lerobot import Episode, StepPicture, sampled_at, write_lerobot
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


def decoded(exported: Path, info: dict[str, Any], key: str, file: int = 0) -> np.ndarray:
    """All depth pictures of a video [mm], as LeRobot's own rule turns codes into depth."""
    about = info["features"][key]["info"]
    assert about["is_depth_map"]
    path = exported / info["video_path"].format(video_key=key, chunk_index=0, file_index=file)
    with av.open(path) as container:
        (stream,) = container.streams.video
        assert stream.average_rate == info["fps"]
        assert stream.codec_context.name == about["video.codec"]
        assert stream.codec_context.pix_fmt == about["video.pix_fmt"]
        frames = list(container.decode(stream))
    assert [frame.time for frame in frames] == pytest.approx(np.arange(len(frames)) / info["fps"])
    codes = np.array([frame.to_ndarray(format=about["video.pix_fmt"]) for frame in frames])
    assert not about["video.use_log"]
    span = about["video.depth_max"] - about["video.depth_min"]
    return np.asarray(1000 * (about["video.depth_min"] + span / 4095 * codes))


def test_every_column_is_a_feature_of_its_shape(exported: Path) -> None:
    info = info_of(exported)
    assert info["codebase_version"] == "v3.0"
    data = data_of(exported, info)
    videos = {key for key, feature in info["features"].items() if feature["dtype"] == "video"}
    assert set(data) == set(info["features"]) - videos
    assert {"observation.images.wrist", "observation.images.static_0"} == videos
    assert len(data["index"]) == info["total_frames"]
    assert data["index"] == list(range(info["total_frames"]))
    for name in data:
        shape = info["features"][name]["shape"]
        if shape != [1]:
            assert {len(row) for row in data[name]} == {shape[0]}


def test_episodes_are_the_attempts(exported: Path, attempts: list[Attempt]) -> None:
    info = info_of(exported)
    data = data_of(exported, info)
    rows = pq.read_table(exported / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert len(rows) == len(attempts) == info["total_episodes"]
    for row, attempt in zip(rows, attempts, strict=True):
        frames = slice(row["dataset_from_index"], row["dataset_to_index"])
        assert row["length"] == frames.stop - frames.start
        assert set(data["episode_index"][frames]) == {row["episode_index"]}
        assert np.diff(data["timestamp"][frames]) == pytest.approx(1 / info["fps"], abs=1e-5)
        time_s, path = from_tensor(attempt.time_s), from_tensor(attempt.gripper_path)
        for frame in (0, row["length"] // 2, row["length"] - 1):
            state = data["observation.state"][frames][frame]
            at = np.flatnonzero(time_s <= time_s[0] + frame / info["fps"] + 1e-6)[-1]
            pose = pose_from(np.array(state[:3]), np.array(state[3:]))
            assert pose == pytest.approx(path[at], abs=1e-5)
            wrench = from_tensor(attempt.base_wrench)[at]
            assert data["observation.wrench"][frames][frame] == pytest.approx(wrench, abs=1e-3)
            vacuum = from_tensor(attempt.pressure)[at]
            assert data["observation.pressure"][frames][frame] == pytest.approx(vacuum, abs=1e-6)
        assert data["action"][frames][0] == data["observation.state"][frames][1]
        assert data["next.success"][frames][-1] == (attempt.outcome == "lifted")
        assert sum(data["next.done"][frames]) == 1


@pytest.mark.parametrize("camera", ["wrist", "static_0"])
def test_every_frame_shows_what_the_policy_had_seen_by_then(
    exported: Path, attempts: list[Attempt], camera: str
) -> None:
    info, key = info_of(exported), f"observation.images.{camera}"
    rows = pq.read_table(exported / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    depth_mm = decoded(exported, info, key)
    assert depth_mm.shape[1:] == tuple(info["features"][key]["shape"][:2])
    assert len(depth_mm) == info["total_frames"]
    looked = data_of(exported, info)["observation.looked"]
    for row, attempt in zip(rows, attempts, strict=True):
        begin = round(row[f"videos/{key}/from_timestamp"] * info["fps"])
        assert row[f"videos/{key}/to_timestamp"] * info["fps"] == pytest.approx(
            begin + row["length"]
        )
        time_s, taken = from_tensor(attempt.time_s), [p for p in attempt.seen if p.camera == camera]
        assert taken
        for frame in range(row["length"]):
            step = np.flatnonzero(time_s <= time_s[0] + frame / info["fps"] + 1e-6)[-1]
            expected = np.zeros(depth_mm.shape[1:])
            before = [one for one in taken if one.step <= step]
            if before:
                part = from_tensor(before[-1].depth_mm)
                top, left = before[-1].top_px, before[-1].left_px
                expected[top : top + part.shape[0], left : left + part.shape[1]] = part
            assert np.abs(depth_mm[begin + frame] - expected).max() < 1e-6
            now = any(one.step == step for one in attempt.seen)
            assert looked[row["dataset_from_index"] + frame] == now
    stats = json.loads((exported / "meta" / "stats.json").read_text())[key]
    assert np.ravel(stats["mean"])[0] == pytest.approx(depth_mm.mean())
    assert np.ravel(stats["std"])[0] == pytest.approx(depth_mm.std())
    assert stats["count"] == [len(depth_mm)]


def test_the_wrist_looks_at_each_step_of_the_way_down(attempts: list[Attempt]) -> None:
    """The local phase takes a picture a step until it is too near (Supplement VI)."""
    steps = [
        [one.step for one in attempt.seen if attempt.states[one.step] == "approach"]
        for attempt in attempts
    ]
    assert max(len(of) for of in steps) >= 5
    assert all((np.diff(of) >= 1).all() for of in steps)


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


def test_videos_are_cut_into_files_and_equal_pictures_give_equal_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.interchange.lerobot.EPISODES_A_VIDEO", 2)
    rng = np.random.default_rng(0)
    pictures = rng.integers(0, 5000, (5, 33, 45)).astype(np.uint16)  # odd sizes, and too far
    poses = np.tile(np.eye(4), (3, 1, 1))
    episodes = [
        Episode(
            name=f"{number}",
            time_s=np.arange(3) / 15,
            world_from_gripper=poses,
            wrench=np.zeros((3, 6)),
            pressure=np.full(3, np.nan),
            pictures=[StepPicture("wrist", 1, picture, (4, 6), (40, 60))],
            success=True,
            quality=0.5,
        )
        for number, picture in enumerate(pictures)
    ]
    for folder in ("a", "b"):
        assert write_lerobot(tmp_path / folder, episodes, 15) == 15
    info, key = info_of(tmp_path / "a"), "observation.images.wrist"
    assert "observation.pressure" not in info["features"]  # no sensor
    files = sorted(path.relative_to(tmp_path / "a") for path in tmp_path.glob("a/**/*.mp4"))
    assert len(files) == 3
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()
    rows = pq.read_table(tmp_path / "a/meta/episodes/chunk-000/file-000.parquet").to_pylist()
    for row, picture in zip(rows, pictures, strict=True):
        shown = decoded(tmp_path / "a", info, key, row[f"videos/{key}/file_index"])
        begin = round(row[f"videos/{key}/from_timestamp"] * 15)
        assert not shown[begin].any()  # before the first look
        seen = np.where(picture <= 4095, picture, 0)
        assert shown[begin + 2][4:37, 6:51] == pytest.approx(seen)


def test_a_policy_without_attempts_is_told(run: RunFolder) -> None:
    with pytest.raises(ArtifactError, match="holds no attempt of nobody"):
        read_episodes(run.artifact("evaluate"), "nobody")
