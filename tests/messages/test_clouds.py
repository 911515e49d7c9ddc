"""Clouds keep their points, lie apart from rows, and damaged ones are refused in words."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact, to_tensor
from pipeline.artifacts.bounds import BoundedFile
from pipeline.config.grasps import CELL_SIDE
from pipeline.errors import ArtifactError, ContentError
from pipeline.messages.clouds import HEIGHT_STEP, IN_CELL_STEPS, cloud_batch, clouds_of
from pipeline.messages.grasps import grasp_batch, read_grasps, write_grasps
from pipeline.messages.samples import read_samples, write_samples
from pipeline.network.samples import Samples
from schemas.softgrip.v1.clouds_pb2 import CloudBatch
from schemas.softgrip.v1.grasps_pb2 import GraspBatch
from tests.messages.test_messages import ORIGIN, some_grasps

few = settings(max_examples=30, deadline=None)
ROWS = {"/grasps", "/samples", "/pads"}


def measured_clouds(count: int, side: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Points anywhere within their cells, as cameras give them; empty cells are zero."""
    rng = np.random.default_rng(seed)
    middles = (np.arange(side) + 0.5 - side / 2) * CELL_SIDE
    cloud = np.empty((count, side, side, 3), dtype=np.float32)
    cloud[..., 0] = middles + rng.uniform(-0.5, 0.5, (count, side, side)) * CELL_SIDE
    cloud[..., 1] = middles[:, None] + rng.uniform(-0.5, 0.5, (count, side, side)) * CELL_SIDE
    cloud[..., 2] = rng.uniform(-1.2, 6.0, (count, side, side))
    mask = rng.random((count, side, side)) < rng.random()
    cloud[~mask] = 0.0
    return cloud, mask


@few
@given(st.integers(0, 4), st.integers(1, 24), st.integers(0, 2**32 - 1))
def test_rounding_moves_a_point_by_half_a_step_at_most(count: int, side: int, seed: int) -> None:
    cloud, mask = measured_clouds(count, side, seed)
    back, seen = clouds_of(cloud_batch(cloud, mask, rounded=True))
    np.testing.assert_array_equal(seen, mask)
    assert not back[~mask].any()
    off = np.abs(back.astype(np.float64) - cloud)
    half_precision = np.spacing(np.abs(cloud).astype(np.float16)).astype(np.float64)
    step = np.array([CELL_SIDE / IN_CELL_STEPS] * 2 + [HEIGHT_STEP])
    assert (off <= 0.5 * step + half_precision).all()


@few
@given(st.integers(1, 4), st.integers(1, 24), st.integers(0, 2**32 - 1))
def test_rounded_clouds_are_packed_again_without_loss(count: int, side: int, seed: int) -> None:
    once = cloud_batch(*measured_clouds(count, side, seed), rounded=True)
    cloud, mask = clouds_of(once)
    again = cloud_batch(cloud, mask, rounded=False)
    assert not again.HasField("points")
    np.testing.assert_array_equal(clouds_of(again)[0], cloud)


@pytest.mark.parametrize("spoilt", ["off its cell", "beyond the steps", "nan", "unseen, not zero"])
def test_what_does_not_fit_steps_is_kept_as_half_floats(spoilt: str) -> None:
    cloud, mask = measured_clouds(3, 24, seed=0)
    mask[1, 2, 3] = spoilt != "unseen, not zero"
    cloud[1, 2, 3] = {"off its cell": 0.9, "beyond the steps": 0, "nan": np.nan}.get(spoilt, 0.5)
    if spoilt == "beyond the steps":
        cloud[1, 2, 3, 2] = 40.0
    message = cloud_batch(cloud, mask, rounded=True)
    back, seen = clouds_of(message)
    np.testing.assert_array_equal(back, cloud.astype(np.float16))
    np.testing.assert_array_equal(seen, mask)


def test_steps_take_half_the_bytes() -> None:
    cloud, mask = measured_clouds(64, 24, seed=1)
    half_floats = cloud.astype(np.float16).nbytes + mask.size
    assert cloud_batch(cloud, mask, rounded=True).ByteSize() < 0.6 * half_floats


def damaged(**fields: object) -> CloudBatch:
    message = cloud_batch(*measured_clouds(2, 4, seed=2), rounded=True)
    for name, value in fields.items():
        if isinstance(value, np.ndarray):
            getattr(message, name).CopyFrom(to_tensor(value))
        else:
            setattr(message, name, value)
    return message


@pytest.mark.parametrize(
    "fields",
    [
        {"cells": 0},
        {"cells": 2**31},
        {"cells": 5},
        {"mask": np.zeros((2, 2), dtype=np.uint8)},
        {"mask": np.full((2, 2), 255, dtype=np.uint8)},
        {"height_bytes": np.zeros((2, 1), dtype=np.uint8)},
        {"in_cell": np.zeros((2, 1), dtype=np.int8)},
        {"in_cell": np.zeros((1, 1), dtype=np.int8)},
        {"height_step": float("nan")},
        {"cell_side": 0.0},
        {"points": np.zeros((2, 5, 5, 3), dtype=np.float16)},
        {"cells": 4000, "mask": np.zeros((3, 2_000_000), dtype=np.uint8)},
    ],
    ids=str,
)
def test_damaged_clouds_are_refused(fields: dict[str, object]) -> None:
    with pytest.raises(ContentError):
        clouds_of(damaged(**fields))


def test_more_clouds_than_a_reader_accepts_are_not_written() -> None:
    mask = np.broadcast_to(np.zeros((1, 128, 128), dtype=np.bool_), (2800, 128, 128))
    cloud = np.broadcast_to(np.zeros((1, 128, 128, 3), dtype=np.float32), (2800, 128, 128, 3))
    with pytest.raises(ArtifactError, match="samples_per_message"):
        cloud_batch(cloud, mask, rounded=True)


def test_no_chunk_holds_rows_and_clouds(tmp_path: Path, provenance: Provenance) -> None:
    path = tmp_path / "grasps.mcap"
    with ArtifactWriter(path, provenance) as artifact:
        write_grasps(artifact, [(ORIGIN, some_grasps(40)), (ORIGIN, some_grasps(7))], 16, True)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        topics = [
            {summary.channels[number].topic for number in chunk.message_index_offsets}
            for chunk in summary.chunk_indexes
        ]
    assert {"/grasps"} in topics
    assert {"/clouds"} in topics
    assert not [held for held in topics if "/clouds" in held and held & ROWS]
    with open_artifact(path) as shard:
        parts = list(read_grasps(shard))
    assert [len(grasps) for _, grasps in parts] == [16, 16, 8, 7]
    for (_, grasps), whole, at in zip(parts, [40, 40, 40, 7], [0, 16, 32, 0], strict=True):
        np.testing.assert_array_equal(
            grasps.cloud, some_grasps(whole).rows(at, at + len(grasps)).cloud
        )


def test_rows_are_read_without_decompressing_a_cloud(
    tmp_path: Path, provenance: Provenance, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "grasps.mcap"
    with ArtifactWriter(path, provenance) as artifact:
        write_grasps(artifact, [(ORIGIN, some_grasps(64))], 16, True)
    read: list[int] = []
    really = BoundedFile.read

    def counted(file: BoundedFile, size: int | None = -1, /) -> bytes:
        data = really(file, size)
        read.append(len(data))
        return data

    monkeypatch.setattr(BoundedFile, "read", counted)
    with open_artifact(path) as shard:
        rows = sum(len(grasps) for _, grasps in read_grasps(shard, clouds=False))
    assert rows == 64
    assert sum(read) < 0.3 * path.stat().st_size
    read.clear()
    with open_artifact(path) as shard:
        list(read_grasps(shard))
    assert sum(read) > 0.9 * path.stat().st_size


def test_rows_whose_clouds_are_gone_are_refused(tmp_path: Path, provenance: Provenance) -> None:
    path = tmp_path / "samples.mcap"
    grasps = some_grasps(8)
    samples = Samples(
        cloud=grasps.cloud,
        cloud_mask=grasps.cloud_mask,
        quality=grasps.quality,
        object_index=grasps.object_index,
        shape_class=grasps.status,
        level=grasps.status,
        pressure=grasps.pressure,
        proposal_weight=grasps.quality,
        pictures=grasps.pictures,
    )
    with ArtifactWriter(path, provenance) as artifact:
        write_samples(artifact, samples, ("a", "b", "c"), size=3, first=5)
    with open_artifact(path) as shard:
        assert [len(part) for part in read_samples(shard)] == [3, 3, 2]
    with ArtifactWriter(path, provenance) as artifact:
        artifact.write("/grasps", grasp_batch(ORIGIN, grasps), log_time_ns=0)
    with pytest.raises(ArtifactError, match="have no clouds"), open_artifact(path) as shard:
        list(read_grasps(shard))
    with open_artifact(path) as shard:
        ((_, message),) = shard.messages(GraspBatch)
        assert not message.HasField("cloud")
