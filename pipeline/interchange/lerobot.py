"""Attempts of the closed loop as LeRobot episodes, dataset format v3.0 (Cadene et al., 2024).

A frame holds the gripper's pose and the wrench at its base; the action is the pose of the next
frame. Its pictures are the depth images that the choice of the grasp rests on, the same in every
frame of an episode, for attempts keep no others; they are 16-bit PNG in millimetres.
"""

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from jaxtyping import Float, Int, UInt16
from PIL import Image

from pipeline.artifacts.publishing import publish_bytes
from pipeline.geometry.transforms import position_quaternion

FPS = 10  # attempts are recorded at least every tenth of a second
VERSION = "v3.0"
TASK = "Pick an object from the clutter with the vacuum gripper"
POSE_NAMES = ["x", "y", "z", "qw", "qx", "qy", "qz"]
WRENCH_NAMES = ["fx", "fy", "fz", "tx", "ty", "tz"]
# LeRobot's defaults; everything fits into the first file of the first chunk.
_CHUNK, _DATA_MB, _VIDEO_MB = 1000, 100, 500


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
    pictures
        Camera → depth image, shape (h, w) [mm].
    success
        Whether the object was lifted.
    quality
        q-hat of the chosen grasp.
    """

    name: str
    time_s: Float[np.ndarray, " t"]
    world_from_gripper: Float[np.ndarray, "t 4 4"]
    wrench: Float[np.ndarray, "t 6"]
    pictures: dict[str, UInt16[np.ndarray, "_ _"]]
    success: bool
    quality: float


def write_lerobot(folder: Path, episodes: Sequence[Episode]) -> int:
    """Write the data set.

    Parameters
    ----------
    folder
        Where ``meta`` and ``data`` appear.
    episodes
        All of them, at least one.

    Returns
    -------
    How many frames were written.
    """
    cameras = {
        f"observation.images.{camera}": picture.shape
        for episode in episodes
        for camera, picture in episode.pictures.items()
    }
    tables, rows, first = [], [], 0
    for number, episode in enumerate(episodes):
        columns = _columns(episode, number, first, cameras)
        length = len(columns["timestamp"])
        tables.append(_table(columns, cameras))
        rows.append(_episode_row(number, episode, first, length, columns, cameras))
        first += length
    whole = pa.concat_tables(tables)
    features = _features(cameras)
    info = {
        "codebase_version": VERSION,
        "robot_type": "softgrip",
        "total_episodes": len(episodes),
        "total_frames": first,
        "total_tasks": 1,
        "chunks_size": _CHUNK,
        "data_files_size_in_mb": _DATA_MB,
        "video_files_size_in_mb": _VIDEO_MB,
        "fps": FPS,
        "splits": {"train": f"0:{len(episodes)}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": None,
        "features": features,
    }
    numbers = [name for name in features if features[name]["dtype"] not in ("image", "bool")]
    stats = {name: _stats(_dense(whole[name])) for name in numbers}
    publish_bytes(folder / "data/chunk-000/file-000.parquet", _parquet(whole))
    table = pa.Table.from_pylist(rows)
    publish_bytes(folder / "meta/episodes/chunk-000/file-000.parquet", _parquet(table))
    publish_bytes(folder / "meta/tasks.parquet", _parquet(_tasks()))
    publish_bytes(folder / "meta/stats.json", _json(stats))
    publish_bytes(folder / "meta/info.json", _json(info))
    return first


def sampled_at(time_s: Float[np.ndarray, " t"], fps: int) -> Int[np.ndarray, " n"]:
    """Which sample holds at each frame: the last one that is not later."""
    frames = np.arange(int(np.floor((time_s[-1] - time_s[0]) * fps + 1e-6)) + 1) / fps
    return np.searchsorted(time_s - time_s[0], frames + 1e-6, side="right") - 1


def _columns(
    episode: Episode, number: int, first: int, cameras: dict[str, tuple[int, ...]]
) -> dict[str, np.ndarray]:
    at = sampled_at(episode.time_s, FPS)
    pose = np.array(
        [np.concatenate(position_quaternion(one)) for one in episode.world_from_gripper[at]],
        dtype=np.float32,
    )
    n = len(at)
    last = np.arange(n) == n - 1
    return {
        "observation.state": pose,
        "observation.wrench": episode.wrench[at].astype(np.float32),
        "action": np.concatenate([pose[1:], pose[-1:]]),
        "quality": np.full((n, 1), episode.quality, dtype=np.float32),
        "next.done": last,
        "next.success": last & episode.success,
        "timestamp": (np.arange(n) / FPS).astype(np.float32),
        "frame_index": np.arange(n),
        "episode_index": np.full(n, number),
        "index": first + np.arange(n),
        "task_index": np.zeros(n, dtype=np.int64),
        **{
            key: episode.pictures.get(key.rpartition(".")[2], np.zeros(shape, dtype=np.uint16))
            for key, shape in cameras.items()
        },
    }


def _table(columns: dict[str, np.ndarray], cameras: dict[str, tuple[int, ...]]) -> pa.Table:
    n, arrays = len(columns["timestamp"]), {}
    for name, values in columns.items():
        if name in cameras:
            picture = {"bytes": _png(values), "path": None}
            kind = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
            arrays[name] = pa.array([picture] * n, kind)
        elif values.ndim == 2:
            flat = pa.array(values.ravel())
            arrays[name] = pa.FixedSizeListArray.from_arrays(flat, values.shape[1])
        else:
            arrays[name] = pa.array(values)
    return pa.table(arrays)


def _features(cameras: dict[str, tuple[int, ...]]) -> dict[str, dict[str, Any]]:
    def of(dtype: str, names: list[str] | None, size: int = 1) -> dict[str, Any]:
        return {"dtype": dtype, "shape": [size], "names": names}

    return {
        "observation.state": of("float32", POSE_NAMES, len(POSE_NAMES)),
        "observation.wrench": of("float32", WRENCH_NAMES, len(WRENCH_NAMES)),
        "action": of("float32", POSE_NAMES, len(POSE_NAMES)),
        "quality": of("float32", ["q_hat"]),
        "next.done": of("bool", None),
        "next.success": of("bool", None),
        "timestamp": of("float32", None),
        **{
            name: of("int64", None)
            for name in ("frame_index", "episode_index", "index", "task_index")
        },
        **{
            key: {"dtype": "image", "shape": [*shape, 1], "names": ["height", "width", "channels"]}
            for key, shape in cameras.items()
        },
    }


def _episode_row(
    number: int,
    episode: Episode,
    first: int,
    length: int,
    columns: dict[str, np.ndarray],
    cameras: dict[str, tuple[int, ...]],
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
        if name not in cameras and values.dtype != bool:
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


def _png(picture: np.ndarray) -> bytes:
    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG")
    return file.getvalue()


def _json(content: Any) -> bytes:
    return (json.dumps(content, indent=1) + "\n").encode()
