"""Grasps and samples survive their messages; shards are named, kept and checked."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.artifacts import ArtifactWriter, Provenance
from pipeline.artifacts.sharding import (
    is_current,
    listed_shards,
    read_index,
    shard_entry,
    shard_path,
    write_index,
)
from pipeline.errors import ArtifactError
from pipeline.labelling.grasps import GraspOrigin, LabelledGrasps
from pipeline.labelling.shown_pads import ShownPads
from pipeline.messages.clouds import cloud_batch
from pipeline.messages.grasps import (
    grasp_batch,
    grasp_messages,
    grasps_of,
    pads_message,
    pads_of,
    portions_by_key,
    read_portion,
    write_grasps,
    write_messages,
)
from pipeline.messages.samples import sample_batch, samples_of
from pipeline.network.samples import Samples, join_samples
from schemas.softgrip.v1.grasps_pb2 import DrapedPads, GraspBatch, ShardEntry
from schemas.softgrip.v1.samples_pb2 import SampleBatch
from tests.checked_shapes import unchecked


def some_grasps(count: int, vertices: int = 586) -> LabelledGrasps:
    rng = np.random.default_rng(count)
    return LabelledGrasps(
        object_index=rng.integers(0, 3, count),
        body_id=rng.integers(1, 9, count),
        world_from_gripper=rng.normal(size=(count, 4, 4)),
        quality=rng.random(count),
        pressure=rng.random(count),
        wrench=rng.normal(size=(count, 4)),
        limit_slack=rng.random((count, 8)),
        weight_summary=rng.random((count, 3)),
        contact_mask=rng.random((count, vertices)) < 0.5,
        status=rng.integers(0, 4, count).astype(np.uint8),
        iterations=rng.integers(0, 100, count),
        tilt_rad=rng.random(count),
        proposal=rng.integers(0, 3, count),
        keep_probability=rng.random(count),
        cloud=rng.normal(size=(count, 24, 24, 3)).astype(np.float16),
        cloud_mask=rng.random((count, 24, 24)) < 0.5,
        touch_height_m=rng.random(count),
        pictures=rng.integers(1, 4, count),
    )


ORIGIN = GraspOrigin("s1", "static", 3, "train", ("a", "b", "c"), ("Fx",), ("solved",), ("n",))


@pytest.mark.parametrize("count", [0, 1, 7])
def test_grasps_round_trip(count: int) -> None:
    grasps = some_grasps(count)
    wire = grasp_batch(ORIGIN, grasps).SerializeToString()
    clouds = cloud_batch(grasps.cloud, grasps.cloud_mask, rounded=False)
    origin, back = grasps_of(GraspBatch.FromString(wire), clouds)
    assert origin == ORIGIN
    for field in fields(grasps):
        then, now = getattr(grasps, field.name), getattr(back, field.name)
        narrow = field.name in ("tilt_rad", "keep_probability")
        np.testing.assert_allclose(now, then, rtol=1e-6 if narrow else 0)


def test_pads_round_trip_and_must_fit_together() -> None:
    pads = ShownPads(np.array([4, 2]), np.full((2, 586), -1e-3), np.full((2, 1125), 0.5))
    wire = pads_message(pads).SerializeToString()
    back = pads_of(DrapedPads.FromString(wire))
    for field in fields(pads):
        now, then = getattr(back, field.name), getattr(pads, field.name)
        np.testing.assert_allclose(now, then, rtol=1e-6)
    with unchecked(), pytest.raises(ArtifactError, match="pressure"):
        pads_of(pads_message(replace(pads, pressure=np.zeros((3, 1125)))))


def test_samples_round_trip_and_join() -> None:
    rng = np.random.default_rng(0)
    samples = Samples(
        cloud=rng.normal(size=(9, 24, 24, 3)).astype(np.float16),
        cloud_mask=rng.random((9, 24, 24)) < 0.5,
        quality=rng.random(9).astype(np.float32),
        object_index=rng.integers(0, 5, 9),
        shape_class=rng.integers(0, 3, 9),
        level=rng.integers(1, 10, 9),
        pressure=rng.random(9).astype(np.float32),
        proposal_weight=rng.random(9).astype(np.float32),
        pictures=rng.integers(1, 4, 9),
    )
    parts = [samples.take(slice(0, 4)), samples.take(slice(4, 9))]
    wired = [
        samples_of(
            SampleBatch.FromString(sample_batch(p, ("a",)).SerializeToString()),
            cloud_batch(p.cloud, p.cloud_mask, rounded=False),
        )
        for p in parts
    ]
    back = join_samples(wired)
    for field in fields(samples):
        np.testing.assert_array_equal(getattr(back, field.name), getattr(samples, field.name))


def make_shards(folder: Path, provenance: Provenance) -> tuple[Path, list[ShardEntry]]:
    index = folder / "grasps.mcap"
    entries = []
    for i, split in enumerate(("train", "test")):
        path = shard_path(folder / "grasps", i, 2)
        with ArtifactWriter(path, provenance) as artifact:
            write_grasps(artifact, [(ORIGIN, some_grasps(2))], size=2, rounded=True)
        entries.append(shard_entry(path, folder, 2, split))
    write_index(index, provenance, entries, np.arange(10))
    return index, entries


def test_index_names_its_shards_by_split(tmp_path: Path, provenance: Provenance) -> None:
    index, _ = make_shards(tmp_path, provenance)
    assert [p.name for p in listed_shards(index)] == ["00000-of-00002.mcap", "00001-of-00002.mcap"]
    assert [p.name for p in listed_shards(index, ["test"])] == ["00001-of-00002.mcap"]
    assert read_index(index).samples == 4


def test_publishing_an_index_clears_strays(tmp_path: Path, provenance: Provenance) -> None:
    index, entries = make_shards(tmp_path, provenance)
    stray = shard_path(tmp_path / "grasps", 2, 3)
    stray.write_bytes(b"old")
    write_index(index, provenance, entries, np.arange(10))
    assert not stray.exists()


def test_a_missing_shard_is_named(tmp_path: Path, provenance: Provenance) -> None:
    index, _ = make_shards(tmp_path, provenance)
    shard_path(tmp_path / "grasps", 1, 2).unlink()
    with pytest.raises(ArtifactError, match=r"00001-of-00002\.mcap is missing"):
        listed_shards(index)


@pytest.mark.parametrize("path", ["../secret.mcap", "grasps/../../secret.mcap", "/secret.mcap"])
def test_an_index_cannot_lead_out_of_its_folder(
    tmp_path: Path, provenance: Provenance, path: str
) -> None:
    index = tmp_path / "run" / "grasps.mcap"
    outside = [ShardEntry(path=path, samples=1, split="train")]
    write_index(index, provenance, outside, np.arange(10))
    with pytest.raises(ArtifactError, match="leads out of its folder"):
        listed_shards(index)


def test_a_link_out_of_the_folder_is_told_and_one_to_the_whole_folder_is_followed(
    tmp_path: Path, provenance: Provenance
) -> None:
    make_shards(tmp_path / "run", provenance)
    (tmp_path / "linked").symlink_to(tmp_path / "run")
    assert len(listed_shards(tmp_path / "linked" / "grasps.mcap")) == 2
    (tmp_path / "run" / "grasps").rename(tmp_path / "large")
    (tmp_path / "run" / "grasps").symlink_to(tmp_path / "large")
    with pytest.raises(ArtifactError, match=r"grasps/.* is reached by a link that leads out of"):
        listed_shards(tmp_path / "run" / "grasps.mcap")


def test_only_whole_shards_of_this_key_are_current(tmp_path: Path, provenance: Provenance) -> None:
    make_shards(tmp_path, provenance)
    path = shard_path(tmp_path / "grasps", 0, 2)
    assert is_current(path, provenance.key)
    assert not is_current(path, "another")
    path.write_bytes(path.read_bytes()[:-200])
    assert not is_current(path, provenance.key)


def test_a_portion_is_read_from_the_shard_that_holds_it_and_from_no_damaged_one(
    tmp_path: Path, provenance: Provenance
) -> None:
    batches = [(ORIGIN, some_grasps(5)), (ORIGIN, some_grasps(3))]
    first, second = (grasp_messages(batches, 4, True, key) for key in ("one", "two"))
    shard = tmp_path / "0.mcap"
    with ArtifactWriter(shard, provenance) as artifact:
        assert write_messages(artifact, [*first, *second]) == 16
    (tmp_path / "1.mcap").write_bytes(shard.read_bytes()[:-50])
    assert portions_by_key(tmp_path) == {"one": shard, "two": shard}
    assert portions_by_key(tmp_path, besides="another") == {"one": shard, "two": shard}
    assert portions_by_key(tmp_path, besides=provenance.key) == {}
    assert read_portion(shard, "two") == second
    assert read_portion(shard, "three") == []
    assert read_portion(tmp_path / "1.mcap", "one") == []
    assert read_portion(tmp_path / "gone.mcap", "one") == []
