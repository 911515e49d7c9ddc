"""Clouds of grasps and samples ↔ softgrip.v1.CloudBatch.

A cell's point lies within its cell, and its height is known to about a millimetre. So a cloud is
kept in steps: two bytes of height and one each for x and y off the cell's middle, for the cells
that hold a point, and the mask as bits. Where a point does not fit that, half floats are kept.
"""

import math
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import TypeVar

import numpy as np
from google.protobuf.message import Message
from jaxtyping import Bool, Float, Float16, Int8, Int16, UInt16

from pipeline.artifacts.bounds import MOST_CHUNK_BYTES
from pipeline.artifacts.reading import Artifact
from pipeline.artifacts.tensors import tensors_of, to_tensor
from pipeline.artifacts.writing import ArtifactWriter
from pipeline.compiled_code import njit
from pipeline.config.grasps import CELL_SIDE
from pipeline.errors import ArtifactError, ContentError
from schemas.softgrip.v1.clouds_pb2 import CloudBatch

TOPIC = "/clouds"

# Powers of two, so that heights up to 2 r_G are exact in half precision: clouds that were packed
# once are packed again without any loss. Of a pad of 25 mm the steps are 0.024 and 0.039 mm.
# Measured on 2 560 test samples, the released network's error moves by 2e-6.
HEIGHT_STEP = 2.0**-10  # r_G; the step of half precision between 1 and 2
IN_CELL_STEPS = 64  # to a cell's side; finer than half precision would be lost beyond 1 r_G
_HALF_CELL_STEPS = IN_CELL_STEPS // 2 + 1  # half precision may put a border's point beyond it
_MOST_CELLS = math.isqrt(MOST_CHUNK_BYTES)  # a side; of more no cloud fits a message
_POINT_BYTES = 6  # a point in half precision

M = TypeVar("M", bound=Message)

STORED_AS = {"mask": "u1", "height_bytes": "u1", "in_cell": "i1"}
SHAPES = {"mask": "n b", "height_bytes": "2 s", "in_cell": "2 s"}
WHOLE_STORED_AS = {"mask": "u1", "points": "f2"}
WHOLE_SHAPES = {"mask": "n b", "points": "n g g 3"}
# In files of softgrip.v1 clouds lie in the rows.
INLINE_STORED_AS = {"cloud": "f2", "cloud_mask": "u1"}
INLINE_SHAPES = {"cloud": "n g g 3", "cloud_mask": "n g g"}

Clouds = tuple[Float16[np.ndarray, "n g g 3"], Bool[np.ndarray, "n g g"]]


def write_apart(
    artifact: ArtifactWriter,
    topic: str,
    rows: Iterable[tuple[int, Message]],
    clouds: Iterable[tuple[int, CloudBatch]],
) -> None:
    """Write rows, then their clouds, each in chunks of their own.

    Parameters
    ----------
    artifact
        The file.
    topic
        Of the rows.
    rows
        Log time [ns] and message.
    clouds
        The same log times, and the clouds of each.
    """
    artifact.end_chunk()
    for log_time_ns, message in rows:
        artifact.write(topic, message, log_time_ns)
    artifact.end_chunk()
    for log_time_ns, batch in clouds:
        artifact.write(TOPIC, batch, log_time_ns)
    artifact.end_chunk()


def with_clouds(artifact: Artifact, kind: type[M]) -> Iterator[tuple[M, CloudBatch | None]]:
    """Every message of rows with its clouds.

    Parameters
    ----------
    artifact
        A shard of stage grasps or shards.
    kind
        Class of the rows, GraspBatch or SampleBatch.

    Yields
    ------
    tuple[M, CloudBatch | None]
        The rows, and their clouds; none where the rows hold them, as in files of softgrip.v1.

    Raises
    ------
    ContentError
        Rows have no clouds.
    """
    batches = artifact.messages(CloudBatch)
    for log_time_ns, message in artifact.messages(kind):
        if message.HasField("cloud"):
            yield message, None
            continue
        cloud_time_ns, batch = next(batches, (None, None))
        if batch is None or cloud_time_ns != log_time_ns:
            raise ContentError(f"Rows at log time {log_time_ns} have no clouds")
        yield message, batch


def clouds_beside(message: Message, batch: CloudBatch | None, rows: int) -> Clouds:
    """The clouds of a message of rows, wherever they lie.

    Parameters
    ----------
    message
        The rows.
    batch
        Their clouds, if they lie apart and are wanted.
    rows
        How many they are.

    Returns
    -------
    Points, shape (n, g, g, 3), and the cells that hold one; g is 0 where clouds are not wanted.

    Raises
    ------
    ContentError
        Clouds are of another number of rows, or damaged.
    """
    if message.HasField("cloud"):
        arrays = tensors_of(message, INLINE_STORED_AS, INLINE_SHAPES)
        cloud, mask = arrays["cloud"], arrays["cloud_mask"].view(bool)
    elif batch is None:
        return np.empty((rows, 0, 0, 3), np.float16), np.empty((rows, 0, 0), np.bool_)
    else:
        cloud, mask = clouds_of(batch)
    if len(cloud) != rows:
        raise ContentError(f"{len(cloud)} clouds of {rows} rows")
    return cloud, mask


def cloud_batch(
    cloud: Float[np.ndarray, "n g g 3"], mask: Bool[np.ndarray, "n g g"], rounded: bool
) -> CloudBatch:
    """The message of some clouds.

    Parameters
    ----------
    cloud
        Points in units of r_G, zero where there are none, shape (n, g, g, 3).
    mask
        Cells that hold a point, shape (n, g, g).
    rounded
        Whether points may be rounded to steps; if not, steps are used only where they keep all
        that half precision does.

    Returns
    -------
    The message.

    Raises
    ------
    ArtifactError
        The clouds are more than a reader accepts in one message.
    """
    cells = mask.shape[1]
    if mask.size * _POINT_BYTES > MOST_CHUNK_BYTES:
        raise ArtifactError(
            f"{len(mask)} clouds of {cells} x {cells} cells are more than a reader accepts at once",
            "Lower grasps.samples_per_message and shards.samples_per_message",
        )
    bits = np.packbits(mask.reshape(len(mask), cells * cells), axis=1)
    message = CloudBatch(cells=cells, mask=to_tensor(bits))
    height, in_cell, fits = _in_steps(_single(cloud), mask, CELL_SIDE)
    if fits and not rounded:
        again = _points(height, in_cell, mask, CELL_SIDE, HEIGHT_STEP, CELL_SIDE / IN_CELL_STEPS)
        fits = np.array_equal(again.view(np.uint16), cloud.astype(np.float16).view(np.uint16))
    if not fits:
        message.points.CopyFrom(to_tensor(cloud.astype(np.float16)))
        return message
    low_high = np.ascontiguousarray(height.astype("<i2").view(np.uint8).reshape(-1, 2).T)
    message.height_bytes.CopyFrom(to_tensor(low_high))
    message.in_cell.CopyFrom(to_tensor(in_cell))
    message.height_step = HEIGHT_STEP
    message.in_cell_step = CELL_SIDE / IN_CELL_STEPS
    message.cell_side = CELL_SIDE
    return message


def clouds_of(message: CloudBatch) -> Clouds:
    """The clouds of a message.

    Parameters
    ----------
    message
        Of a shard of stage grasps or shards.

    Returns
    -------
    Points in units of r_G, shape (n, g, g, 3), and the cells that hold one, shape (n, g, g).

    Raises
    ------
    ContentError
        A tensor is missing, they do not fit together, or they unfold to more than is written.
    """
    cells = message.cells
    if not 0 < cells <= _MOST_CELLS:
        raise ContentError(f"Clouds of {cells} cells a side")
    whole = message.HasField("points")
    arrays = tensors_of(
        message, WHOLE_STORED_AS if whole else STORED_AS, WHOLE_SHAPES if whole else SHAPES
    )
    bits = arrays["mask"]
    if bits.shape[1] != -(-cells * cells // 8):
        raise ContentError(f"A cloud's mask is not of {cells} x {cells} cells")
    if len(bits) * cells * cells * _POINT_BYTES > MOST_CHUNK_BYTES:
        raise ContentError(f"{len(bits)} clouds of {cells} x {cells} cells in one message")
    flat = np.unpackbits(bits, axis=1, count=cells * cells).view(bool)
    mask = flat.reshape(len(bits), cells, cells)
    if whole:
        if arrays["points"].shape[:2] != mask.shape[:2]:
            raise ContentError(f"Clouds are not of {cells} x {cells} cells")
        return arrays["points"], mask
    low_high, in_cell = arrays["height_bytes"], arrays["in_cell"]
    if np.count_nonzero(flat) != low_high.shape[1]:
        raise ContentError(f"A cloud's mask does not hold {low_high.shape[1]} points")
    height = np.ascontiguousarray(low_high.T).view("<i2").reshape(-1)
    steps = (message.cell_side, message.height_step, message.in_cell_step)
    if not all(0 < step <= 1 for step in steps):
        raise ContentError(f"Clouds in steps of {steps}")
    return _points(height, in_cell, mask, *steps), mask


def _single(cloud: Float[np.ndarray, "n g g 3"]) -> Float[np.ndarray, "n g g 3"]:
    """In single precision; half floats by a table, a fifth of the time of NumPy's conversion."""
    if cloud.dtype != np.float16:
        return np.ascontiguousarray(cloud, dtype=np.float32)
    return np.asarray(_singles()[np.ascontiguousarray(cloud).view(np.uint16)])


@lru_cache(maxsize=1)
def _singles() -> Float[np.ndarray, "65536"]:
    """Every half float in single precision, in the order of their bits."""
    return np.arange(2**16, dtype=np.uint16).view(np.float16).astype(np.float32)


def _points(
    height: Int16[np.ndarray, " s"],
    in_cell: Int8[np.ndarray, "2 s"],
    mask: Bool[np.ndarray, "n g g"],
    cell: float,
    height_step: float,
    in_cell_step: float,
) -> Float16[np.ndarray, "n g g 3"]:
    """Steps as points in half precision, by tables: ten times as fast as conversions."""
    heights, places = _tables(mask.shape[1], cell, height_step, in_cell_step)
    cloud = np.zeros((*mask.shape, 3), dtype=np.float16)
    bits = cloud.view(np.uint16)
    _out_of_steps(height, in_cell, mask, heights.view(np.uint16), places.view(np.uint16), bits)
    return cloud


@lru_cache(maxsize=4)
def _tables(
    cells: int, cell: float, height_step: float, in_cell_step: float
) -> tuple[Float16[np.ndarray, "65536"], Float16[np.ndarray, "g 256"]]:
    """z of every number of steps, and x (or y) of every column (or row) and number of steps."""
    heights = np.arange(-(2**15), 2**15) * height_step
    middles = (np.arange(cells) + 0.5 - cells / 2) * cell
    places = middles[:, None] + np.arange(-(2**7), 2**7) * in_cell_step
    with np.errstate(over="ignore"):  # of a hostile file's steps; ours are far from it
        return heights.astype(np.float16), places.astype(np.float16)


@njit()
def _in_steps(
    cloud: Float[np.ndarray, "n g g 3"], mask: Bool[np.ndarray, "n g g"], cell: float
) -> tuple[Int16[np.ndarray, " s"], Int8[np.ndarray, "2 s"], bool]:
    """Heights and places within the cell in steps; and whether every point fits them."""
    count, cells = mask.shape[:2]
    points = mask.sum()
    height = np.empty(points, dtype=np.int16)
    in_cell = np.empty((2, points), dtype=np.int8)
    at = 0
    for n in range(count):
        for i in range(cells):
            for j in range(cells):
                if not mask[n, i, j]:
                    for axis in range(3):
                        if cloud[n, i, j, axis] != 0.0:
                            return height, in_cell, False
                    continue
                z = np.rint(cloud[n, i, j, 2] / HEIGHT_STEP)
                x = np.rint(
                    (cloud[n, i, j, 0] - (j + 0.5 - cells / 2) * cell) * (IN_CELL_STEPS / cell)
                )
                y = np.rint(
                    (cloud[n, i, j, 1] - (i + 0.5 - cells / 2) * cell) * (IN_CELL_STEPS / cell)
                )
                # Written so that NaN does not fit.
                if not (
                    abs(z) < 32768.0 and abs(x) <= _HALF_CELL_STEPS and abs(y) <= _HALF_CELL_STEPS
                ):
                    return height, in_cell, False
                height[at] = np.int16(z)
                in_cell[0, at] = np.int8(x)
                in_cell[1, at] = np.int8(y)
                at += 1
    return height, in_cell, True


@njit()
def _out_of_steps(
    height: Int16[np.ndarray, " s"],
    in_cell: Int8[np.ndarray, "2 s"],
    mask: Bool[np.ndarray, "n g g"],
    heights: UInt16[np.ndarray, "65536"],
    places: UInt16[np.ndarray, "g 256"],
    bits: UInt16[np.ndarray, "n g g 3"],
) -> None:
    """Fill the cells of the mask with the bits of their half floats."""
    count, cells = mask.shape[:2]
    at = 0
    for n in range(count):
        for i in range(cells):
            for j in range(cells):
                if mask[n, i, j]:
                    bits[n, i, j, 0] = places[j, np.int64(in_cell[0, at]) + 128]
                    bits[n, i, j, 1] = places[i, np.int64(in_cell[1, at]) + 128]
                    bits[n, i, j, 2] = heights[np.int64(height[at]) + 32768]
                    at += 1
