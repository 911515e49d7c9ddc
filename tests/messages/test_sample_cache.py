"""Shards are decoded once, in order, for as long as their content is the same."""

import shutil
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from pipeline.artifacts import ArtifactWriter, Provenance
from pipeline.artifacts.publishing import scratch_beside
from pipeline.artifacts.sharding import shard_entry, shard_path, write_index
from pipeline.errors import ArtifactError
from pipeline.messages.sample_cache import cached_split, first_samples, first_shards, read_parts
from pipeline.messages.samples import read_chosen, read_rows, read_split, write_samples
from pipeline.network.samples import Samples, join_samples


def some_samples(count: int, seed: int) -> Samples:
    rng = np.random.default_rng(seed)
    return Samples(
        cloud=rng.normal(size=(count, 24, 24, 3)).astype(np.float16),
        cloud_mask=rng.random((count, 24, 24)) < 0.5,
        quality=rng.random(count).astype(np.float32),
        object_index=rng.integers(0, 5, count),
        shape_class=rng.integers(0, 3, count),
        level=rng.integers(1, 10, count),
        pressure=rng.random(count).astype(np.float32),
        proposal_weight=rng.random(count).astype(np.float32),
        pictures=rng.integers(1, 4, count),
    )


def sharded(folder: Path, provenance: Provenance, parts: list[Samples]) -> Path:
    """An index over one shard a part, two messages each, and over a shard of another split."""
    index, entries = folder / "shards.mcap", []
    for number, part in enumerate([*parts, some_samples(3, seed=99)]):
        path = shard_path(folder / "shards", number, len(parts) + 1)
        with ArtifactWriter(path, provenance) as artifact:
            write_samples(artifact, part, ("a",), size=-(-len(part) // 2))
        split = "train" if number < len(parts) else "test"
        entries.append(shard_entry(path, folder, len(part), split))
    write_index(index, provenance, entries, np.zeros(10))
    return index


PARTS = [some_samples(7, seed=0), some_samples(5, seed=1)]


def test_mapped_samples_are_those_of_the_shards_in_order(
    tmp_path: Path, provenance: Provenance
) -> None:
    index = sharded(tmp_path, provenance, PARTS)
    mapped = cached_split(index, "train", tmp_path / "cache")
    whole = join_samples(PARTS)
    for field in fields(Samples):
        found = getattr(mapped, field.name)
        assert isinstance(found, np.memmap)
        np.testing.assert_array_equal(found, getattr(whole, field.name))
    assert mapped.cloud_mask.dtype == np.bool_
    assert len(cached_split(index, "test", tmp_path / "cache")) == 3


def test_equal_content_is_decoded_once_and_other_content_anew(
    tmp_path: Path, provenance: Provenance
) -> None:
    cache = tmp_path / "cache"
    cached_split(sharded(tmp_path / "a", provenance, PARTS), "train", cache)
    (made,) = cache.glob("train-*")
    before = (made / "cloud.npy").stat().st_mtime_ns
    cached_split(sharded(tmp_path / "b", provenance, PARTS), "train", cache)
    assert (made / "cloud.npy").stat().st_mtime_ns == before
    other = cached_split(sharded(tmp_path / "c", provenance, PARTS[::-1]), "train", cache)
    (now,) = cache.glob("train-*")
    assert now != made
    np.testing.assert_array_equal(other.quality[:5], PARTS[1].quality)


def test_a_kill_while_decoding_leaves_nothing_that_passes_for_whole(
    tmp_path: Path, provenance: Provenance
) -> None:
    index, cache = sharded(tmp_path, provenance, PARTS), tmp_path / "cache"
    left = scratch_beside(cache / "train")
    left.mkdir(parents=True)
    (left / "cloud.npy").write_bytes(b"half")
    mapped = cached_split(index, "train", cache)
    np.testing.assert_array_equal(mapped.cloud, join_samples(PARTS).cloud)
    assert not list(cache.glob(".*.part"))


@pytest.mark.parametrize("call", ["mkdir", "rename"])
def test_an_interrupt_leaves_nothing_half(
    tmp_path: Path, provenance: Provenance, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    """A signal during a system call is raised as the call returns."""
    index, cache = sharded(tmp_path, provenance, PARTS), tmp_path / "cache"
    really = getattr(Path, call)

    def interrupted(path: Path, *args: Path, **options: bool) -> None:
        really(path, *args, **options)
        if path.name.startswith(".train-") and path.suffix == ".part":
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Path, call, interrupted)
        with pytest.raises(KeyboardInterrupt):
            cached_split(index, "train", cache)
    assert not list(cache.glob(".*.part"))
    np.testing.assert_array_equal(
        cached_split(index, "train", cache).cloud, join_samples(PARTS).cloud
    )


def test_a_shard_that_is_not_the_indexs_is_named(tmp_path: Path, provenance: Provenance) -> None:
    index = sharded(tmp_path, provenance, PARTS)
    shard_path(tmp_path / "shards", 0, 3).write_bytes(
        shard_path(tmp_path / "shards", 1, 3).read_bytes()
    )
    with pytest.raises(ArtifactError, match=r"00000-of-00003\.mcap is not the shard"):
        cached_split(index, "train", tmp_path / "cache")
    assert not list((tmp_path / "cache").glob("train-*"))


def test_a_split_without_samples_is_refused(tmp_path: Path, provenance: Provenance) -> None:
    index = sharded(tmp_path, provenance, PARTS)
    with pytest.raises(ArtifactError, match="no samples"):
        cached_split(index, "val", tmp_path / "cache")


@pytest.mark.parametrize("wanted", [1, 6, 9, 50])
def test_the_first_samples_are_those_of_the_cache(
    tmp_path: Path, provenance: Provenance, wanted: int
) -> None:
    index = sharded(tmp_path, provenance, PARTS)
    mapped = cached_split(index, "train", tmp_path / "cache")
    first = first_samples(index, "train", wanted)
    for field in fields(Samples):
        found, same = getattr(first, field.name), getattr(mapped, field.name)[:wanted]
        np.testing.assert_array_equal(found, same)
        assert found.dtype == same.dtype


def test_of_the_first_samples_no_later_shard_is_opened(
    tmp_path: Path, provenance: Provenance
) -> None:
    index = sharded(tmp_path, provenance, PARTS)
    (tmp_path / "shards" / "00001-of-00003.mcap").write_bytes(b"damaged")
    assert len(first_samples(index, "train", 7)) == 7
    with pytest.raises(ArtifactError, match="is not the shard that its index names"):
        first_samples(index, "train", 8)
    with pytest.raises(ArtifactError, match="is not the shard that its index names"):
        list(read_parts(index, "train"))


def test_the_first_samples_need_no_other_shard(tmp_path: Path, provenance: Provenance) -> None:
    index = sharded(tmp_path, provenance, PARTS)
    alone = tmp_path / "alone"
    for path in (index, *first_shards(index, "train", 7)):
        there = alone / path.relative_to(tmp_path)
        there.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, there)
    found = first_samples(alone / index.relative_to(tmp_path), "train", 7)
    np.testing.assert_array_equal(found.cloud, join_samples(PARTS).cloud[:7])
    with pytest.raises(ArtifactError, match=r"00001-of-00003\.mcap is missing"):
        first_samples(alone / index.relative_to(tmp_path), "train", 8)


def test_a_split_of_no_samples_has_no_first_ones(tmp_path: Path, provenance: Provenance) -> None:
    with pytest.raises(ArtifactError, match="a split holds no samples"):
        first_samples(sharded(tmp_path, provenance, PARTS), "val", 1)


def test_chosen_samples_come_in_the_order_asked_for_and_rows_without_clouds(
    tmp_path: Path, provenance: Provenance
) -> None:
    index = sharded(tmp_path, provenance, PARTS)
    whole, numbers = read_split(index, "train"), np.array([11, 0, 6, 7, 0])
    chosen, rows = read_chosen(index, "train", numbers), read_rows(index, "train")
    for field in fields(Samples):
        same = getattr(whole, field.name)
        np.testing.assert_array_equal(getattr(chosen, field.name), same[numbers])
        if field.name not in {"cloud", "cloud_mask"}:
            np.testing.assert_array_equal(getattr(rows, field.name), same)
    assert rows.cloud.size == rows.cloud_mask.size == 0
