"""Attempts of the closed loop as LeRobot episodes, dataset format v3.0 (Cadene et al., 2024).

A frame is a control step: the gripper's pose, the wrench at its base, the vacuum at the pad, and
of each camera the last picture that the policy had taken by then; the action is the pose of the
next frame. Of the wrist's camera the policy looks at the surroundings of its aim: the rest of the
picture is 0, as what was not measured. Pictures are videos of depth (`lerobot_video`).
"""

import io
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from jaxtyping import Float, Int, UInt16

from pipeline.artifacts.publishing import publish_bytes
from pipeline.geometry.transforms import position_quaternion
from pipeline.interchange.lerobot_video import depth_video, feature_of_depth

VERSION = "v3.0"
TASK = "Pick an object from the clutter with the vacuum gripper"
POSE_NAMES = ["x", "y", "z", "qw", "qx", "qy", "qz"]
WRENCH_NAMES = ["fx", "fy", "fz", "tx", "ty", "tz"]
# LeRobot's defaults; numbers fit into the first file of the first chunk.
_CHUNK, _DATA_MB, _VIDEO_MB = 1000, 100, 500
_VIDEOS = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
EPISODES_A_VIDEO = 100  # some tens of megabytes


@dataclass(frozen=True, eq=False)
class StepPicture:
    """A picture that the policy took.

    Attributes
    ----------
    camera
        Name of the camera.
    step
        Number of the last sample before it.
    depth_mm
        The part that was looked at [mm], shape (h, w).
    corner_px
        Row and column of the part's first pixel in the camera's whole picture.
    whole_px
        Height and width of the whole picture.
    """

    camera: str
    step: int
    depth_mm: UInt16[np.ndarray, "h w"]
    corner_px: tuple[int, int]
    whole_px: tuple[int, int]

    def whole(self) -> UInt16[np.ndarray, "_ _"]:
        """The whole picture [mm]; 0 where nothing was looked at or measured."""
        picture = np.zeros(self.whole_px, dtype=np.uint16)
        (top, left), (height, width) = self.corner_px, self.depth_mm.shape
        picture[top : top + height, left : left + width] = self.depth_mm
        return picture


@dataclass(frozen=True, eq=False)
class Episode:
    """One attempt.

    Attributes
    ----------
    name
        Scene and number of the attempt.
    time_s
        When the trajectory was sampled, shape (t,) [s].
    world_from_gripper
        Poses, shape (t, 4, 4) [m].
    wrench
        Force and torque at the gripper's base in GCS, shape (t, 6) [N, N m].
    pressure
        Vacuum at the pad over the pump's greatest, shape (t,); NaN where nothing measures it.
    pictures
        What the policy saw, in order.
    success
        Whether the object was lifted.
    quality
        q-hat of the chosen grasp.
    """

    name: str
    time_s: Float[np.ndarray, " t"]
    world_from_gripper: Float[np.ndarray, "t 4 4"]
    wrench: Float[np.ndarray, "t 6"]
    pressure: Float[np.ndarray, " t"]
    pictures: Sequence[StepPicture]
    success: bool
    quality: float


def write_lerobot(folder: Path, episodes: Sequence[Episode], fps: int) -> int:
    """Write the data set.

    Parameters
    ----------
    folder
        Where ``meta``, ``data`` and ``videos`` appear.
    episodes
        All of them, at least one.
    fps
        Control steps a second.

    Returns
    -------
    How many frames were written.
    """
    sizes = {_key(one.camera): one.whole_px for episode in episodes for one in episode.pictures}
    felt = bool(np.isfinite(np.concatenate([one.pressure for one in episodes])).all())
    tables, rows, first = [], [], 0
    for number, episode in enumerate(episodes):
        columns = _columns(episode, number, first, fps, felt)
        length = len(columns["timestamp"])
        tables.append(_table(columns))
        rows.append(_episode_row(number, episode, first, length, columns))
        first += length
    seen = _write_videos(folder, episodes, rows, sizes, fps)
    whole = pa.concat_tables(tables)
    features = _features(sizes, fps, felt)
    info = {
        "codebase_version": VERSION,
        "robot_type": "softgrip",
        "total_episodes": len(episodes),
        "total_frames": first,
        "total_tasks": 1,
        "chunks_size": _CHUNK,
        "data_files_size_in_mb": _DATA_MB,
        "video_files_size_in_mb": _VIDEO_MB,
        "fps": fps,
        "splits": {"train": f"0:{len(episodes)}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": _VIDEOS if sizes else None,
        "features": features,
    }
    numbers = [name for name in features if features[name]["dtype"] not in ("video", "bool")]
    stats = {name: _stats(_dense(whole[name])) for name in numbers} | seen
    publish_bytes(folder / "data/chunk-000/file-000.parquet", _parquet(whole))
    table = pa.Table.from_pylist(rows)
    publish_bytes(folder / "meta/episodes/chunk-000/file-000.parquet", _parquet(table))
    publish_bytes(folder / "meta/tasks.parquet", _parquet(_tasks()))
    publish_bytes(folder / "meta/stats.json", _json(stats))
    publish_bytes(folder / "meta/info.json", _json(info))
    return first


def _write_videos(
    folder: Path,
    episodes: Sequence[Episode],
    rows: list[dict[str, Any]],
    sizes: dict[str, tuple[int, int]],
    fps: int,
) -> dict[str, Any]:
    """Write a video a camera and `EPISODES_A_VIDEO` episodes, and where each lies into its row.

    Parameters
    ----------
    folder
        Of the data set.
    episodes
        All of them.
    rows
        What ``meta/episodes`` says of each; it is added to.
    sizes
        Feature → height and width of its pictures.
    fps
        Pictures a second.

    Returns
    -------
    Statistics of each feature over all pictures, in millimetres.
    """
    found: dict[str, Any] = {}
    for key, size in sizes.items():
        parts = []
        for file, begin in enumerate(range(0, len(episodes), EPISODES_A_VIDEO)):
            several = slice(begin, begin + EPISODES_A_VIDEO)
            at_s = 0.0
            for row, episode in zip(rows[several], episodes[several], strict=True):
                shown = list(_shown(episode, key, size, fps))
                parts.append(_picture_stats(shown))
                row |= {f"stats/{key}/{kind}": value for kind, value in parts[-1].items()}
                row[f"videos/{key}/chunk_index"] = file // _CHUNK
                row[f"videos/{key}/file_index"] = file % _CHUNK
                row[f"videos/{key}/from_timestamp"] = at_s
                at_s += len(shown) / fps
                row[f"videos/{key}/to_timestamp"] = at_s
            path = _VIDEOS.format(
                video_key=key, chunk_index=file // _CHUNK, file_index=file % _CHUNK
            )
            pictures = (
                one for episode in episodes[several] for one in _shown(episode, key, size, fps)
            )
            publish_bytes(folder / path, depth_video(pictures, fps))
        found[key] = _joined_stats(parts)
    return found


def _shown(
    episode: Episode, key: str, size: tuple[int, int], fps: int
) -> Iterator[UInt16[np.ndarray, "_ _"]]:
    """Of a camera, the last picture by each frame; empty ones before the first."""
    taken = [one for one in episode.pictures if _key(one.camera) == key]
    steps = np.array([one.step for one in taken], dtype=np.int64)
    picture, shown = np.zeros(size, dtype=np.uint16), -1
    for step in sampled_at(episode.time_s, fps):
        last = int(np.searchsorted(steps, step, side="right")) - 1
        if last != shown:
            picture, shown = taken[last].whole(), last
        yield picture


def _key(camera: str) -> str:
    return f"observation.images.{camera}"


def sampled_at(time_s: Float[np.ndarray, " t"], fps: int) -> Int[np.ndarray, " n"]:
    """Which sample holds at each frame: the last one that is not later."""
    frames = np.arange(int(np.floor((time_s[-1] - time_s[0]) * fps + 1e-6)) + 1) / fps
    return np.searchsorted(time_s - time_s[0], frames + 1e-6, side="right") - 1


def _columns(
    episode: Episode, number: int, first: int, fps: int, felt: bool
) -> dict[str, np.ndarray]:
    at = sampled_at(episode.time_s, fps)
    pose = np.array(
        [np.concatenate(position_quaternion(one)) for one in episode.world_from_gripper[at]],
        dtype=np.float32,
    )
    n = len(at)
    last = np.arange(n) == n - 1
    looks = [one.step for one in episode.pictures]
    pressure = {"observation.pressure": episode.pressure[at].astype(np.float32)} if felt else {}
    return {
        "observation.state": pose,
        "observation.wrench": episode.wrench[at].astype(np.float32),
        **pressure,
        "observation.looked": np.isin(at, looks),
        "action": np.concatenate([pose[1:], pose[-1:]]),
        "quality": np.full((n, 1), episode.quality, dtype=np.float32),
        "next.done": last,
        "next.success": last & episode.success,
        "timestamp": (np.arange(n) / fps).astype(np.float32),
        "frame_index": np.arange(n),
        "episode_index": np.full(n, number),
        "index": first + np.arange(n),
        "task_index": np.zeros(n, dtype=np.int64),
    }


def _table(columns: dict[str, np.ndarray]) -> pa.Table:
    arrays = {}
    for name, values in columns.items():
        if values.ndim == 2:
            flat = pa.array(values.ravel())
            arrays[name] = pa.FixedSizeListArray.from_arrays(flat, values.shape[1])
        else:
            arrays[name] = pa.array(values)
    return pa.table(arrays)


def _features(sizes: dict[str, tuple[int, int]], fps: int, felt: bool) -> dict[str, dict[str, Any]]:
    def of(dtype: str, names: list[str] | None, size: int = 1) -> dict[str, Any]:
        return {"dtype": dtype, "shape": [size], "names": names}

    return {
        "observation.state": of("float32", POSE_NAMES, len(POSE_NAMES)),
        "observation.wrench": of("float32", WRENCH_NAMES, len(WRENCH_NAMES)),
        **({"observation.pressure": of("float32", ["share of the greatest"])} if felt else {}),
        "observation.looked": of("bool", None),
        "action": of("float32", POSE_NAMES, len(POSE_NAMES)),
        "quality": of("float32", ["q_hat"]),
        "next.done": of("bool", None),
        "next.success": of("bool", None),
        "timestamp": of("float32", None),
        **{
            name: of("int64", None)
            for name in ("frame_index", "episode_index", "index", "task_index")
        },
        **{key: feature_of_depth(*size, fps) for key, size in sizes.items()},
    }


def _episode_row(
    number: int,
    episode: Episode,
    first: int,
    length: int,
    columns: dict[str, np.ndarray],
) -> dict[str, Any]:
    row: dict[str, Any] = {
        "episode_index": number,
        "tasks": [TASK],
        "length": length,
        "data/chunk_index": 0,
        "data/file_index": 0,
        "dataset_from_index": first,
        "dataset_to_index": first + length,
        "meta/episodes/chunk_index": 0,
        "meta/episodes/file_index": 0,
        "softgrip/attempt": episode.name,
        "softgrip/success": episode.success,
    }
    for name, values in columns.items():
        if values.dtype != bool:
            found = _stats(values.reshape(length, -1))
            row |= {f"stats/{name}/{kind}": value for kind, value in found.items()}
    return row


def _stats(values: np.ndarray) -> dict[str, list[float]]:
    table = values.astype(np.float64)
    return {
        "min": table.min(axis=0).tolist(),
        "max": table.max(axis=0).tolist(),
        "mean": table.mean(axis=0).tolist(),
        "std": table.std(axis=0).tolist(),
        "count": [len(table)],
    }


def _picture_stats(pictures: list[UInt16[np.ndarray, "h w"]]) -> dict[str, Any]:
    """Of all pixels of an episode [mm], in LeRobot's shape of a channel; the count is of frames."""
    values = np.array(pictures)
    mean, std = values.mean(dtype=np.float64), values.std(dtype=np.float64)
    of = {"min": values.min(), "max": values.max(), "mean": mean, "std": std}
    return {name: [[[float(value)]]] for name, value in of.items()} | {"count": [len(pictures)]}


def _joined_stats(parts: list[dict[str, Any]]) -> dict[str, Any]:
    """The same of several episodes together."""
    count = np.array([part["count"][0] for part in parts], dtype=np.float64)
    low, high, mean, std = (
        np.array([part[name][0][0][0] for part in parts]) for name in ("min", "max", "mean", "std")
    )
    weight = count / count.sum()
    middle = float(weight @ mean)
    spread = float(np.sqrt(weight @ (std**2 + (mean - middle) ** 2)))
    of = {"min": low.min(), "max": high.max(), "mean": middle, "std": spread}
    return {name: [[[float(value)]]] for name, value in of.items()} | {"count": [int(count.sum())]}


def _dense(column: pa.ChunkedArray) -> np.ndarray:
    joined = column.combine_chunks()
    if pa.types.is_fixed_size_list(joined.type):
        return np.asarray(joined.flatten().to_numpy().reshape(len(joined), -1))
    return np.asarray(joined.to_numpy().reshape(len(joined), 1))


def _tasks() -> pa.Table:
    """One task; LeRobot reads it by pandas and takes the text from the index."""
    index = {
        "name": None,
        "field_name": "__index_level_0__",
        "pandas_type": "unicode",
        "numpy_type": "object",
        "metadata": None,
    }
    column = {
        "name": "task_index",
        "field_name": "task_index",
        "pandas_type": "int64",
        "numpy_type": "int64",
        "metadata": None,
    }
    pandas = {
        "index_columns": ["__index_level_0__"],
        "column_indexes": [],
        "columns": [column, index],
        "creator": {"library": "pyarrow", "version": pa.__version__},
        "pandas_version": "2.2.0",
    }
    table = pa.table({"task_index": pa.array([0]), "__index_level_0__": pa.array([TASK])})
    return table.replace_schema_metadata({"pandas": json.dumps(pandas)})


def _parquet(table: pa.Table) -> bytes:
    file = io.BytesIO()
    pq.write_table(table, file, compression="zstd")
    return file.getvalue()


def _json(content: Any) -> bytes:
    return (json.dumps(content, indent=1) + "\n").encode()
