"""Every sample once an epoch, whoever reads it; a resumed epoch reads exactly what is left."""

import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.errors import ConfigError
from pipeline.network.loading import (
    SampleBatches,
    WaitClock,
    batch_count,
    epoch_batches,
    epoch_order,
    load_batches,
    part_of_rank,
    readers_with_room,
)
from pipeline.network.samples import GraspTensors
from tests.network.planes import planes_with_holes

SAMPLES = planes_with_holes(53, seed=0)


@given(
    samples=st.integers(8, 500),
    batch_size=st.integers(8, 64),
    ranks=st.integers(1, 4),
    done=st.integers(0, 10),
    seed=st.integers(0, 2**32),
    window=st.integers(0, 600),
)
def test_ranks_share_an_epoch_without_loss_or_double(
    samples: int, batch_size: int, ranks: int, done: int, seed: int, window: int
) -> None:
    batches = epoch_batches(samples, batch_size, np.random.default_rng(seed), window)
    assert len(batches) == batch_count(samples, batch_size)
    assert max(len(batch) for batch in batches) <= batch_size
    parts = [part_of_rank(batches, rank, ranks) for rank in range(ranks)]
    seen = np.concatenate([indices for part in parts for indices in part])
    assert np.array_equal(np.sort(seen), np.arange(samples))
    # Resumed after ``done`` batches, what comes is what had not come.
    before = np.concatenate([np.zeros(0, int), *(i for p in parts for i in p[:done])])
    after = np.concatenate([np.zeros(0, int), *(i for p in parts for i in p[done:])])
    assert np.array_equal(np.sort(np.concatenate([before, after])), np.arange(samples))


def test_epochs_differ_and_mix_all_samples() -> None:
    first, second = (epoch_batches(4000, 100, np.random.default_rng((0, e))) for e in (0, 1))
    assert not np.array_equal(first[0], second[0])
    # Each batch holds samples from all over: of every quarter of the file about a quarter.
    for batch in first:
        assert np.bincount(batch // 1000, minlength=4).min() > 5


@given(window=st.integers(1, 60), windows=st.integers(1, 9), seed=st.integers(0, 2**32))
def test_within_a_window_neighbours_are_mixed_and_nobody_else(
    window: int, windows: int, seed: int
) -> None:
    samples = window * windows
    order = epoch_order(samples, window, np.random.default_rng(seed))
    assert np.array_equal(np.sort(order), np.arange(samples))
    for block in np.split(order, windows):
        # Neighbours, though the last sample's neighbour is the first.
        gaps = np.diff(np.sort(block), append=block.min() + samples)
        assert (gaps > 1).sum() <= 1


def test_a_window_of_all_is_the_order_without_one() -> None:
    orders = [epoch_order(100, window, np.random.default_rng(7)) for window in (0, 100, 1000)]
    assert np.array_equal(orders[0], orders[1])
    assert np.array_equal(orders[0], orders[2])


def test_windows_of_epochs_begin_elsewhere_and_follow_in_another_order() -> None:
    first, second = (epoch_order(4000, 500, np.random.default_rng((0, e))) for e in (0, 1))
    blocks = {tuple(sorted(block)) for block in np.split(first, 8)}
    assert not blocks & {tuple(sorted(block)) for block in np.split(second, 8)}


@pytest.mark.parametrize("cut", [slice(None), slice(7, 40)])
def test_readers_that_are_spawned_map_the_files_themselves(tmp_path: Path, cut: slice) -> None:
    """What a loader hands to a process that is spawned is what is pickled here."""
    arrays = []
    for name in ("cloud", "mask", "quality"):
        np.save(tmp_path / f"{name}.npy", getattr(SAMPLES, name))
        arrays.append(np.load(tmp_path / f"{name}.npy", mmap_mode="c")[cut])
    samples = GraspTensors(*arrays)
    batches = epoch_batches(len(samples), 10, np.random.default_rng(0))
    sent = pickle.dumps(SampleBatches(samples, batches))
    assert len(sent) < 8192 < samples.cloud.nbytes
    there = pickle.loads(sent)  # noqa: S301 - our own bytes
    for number, batch in enumerate(batches):
        _, cloud, mask, quality = there[number]
        assert np.array_equal(cloud.numpy(), SAMPLES.cloud[cut][batch])
        assert np.array_equal(mask.numpy(), SAMPLES.mask[cut][batch])
        assert np.array_equal(quality.numpy(), SAMPLES.quality[cut][batch])


def test_samples_in_memory_travel_as_they_are() -> None:
    batches = [np.array([3, 5])]
    there = pickle.loads(pickle.dumps(SampleBatches(SAMPLES, batches)))  # noqa: S301 - our own
    assert np.array_equal(there[0][1].numpy(), SAMPLES.cloud[batches[0]])


def test_nobody_reads_ahead_where_shared_memory_is_too_small(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for free, readers in ((1 << 20, 0), (1 << 30, 4)):
        used = shutil.disk_usage("/")._replace(free=free)
        with monkeypatch.context() as patch:
            patch.setattr(shutil, "disk_usage", lambda folder, used=used: used)
            assert readers_with_room(4, batch_bytes=128 * 4036) == readers


@pytest.mark.parametrize("workers", [0, 2])
def test_loader_workers_give_the_samples_asked_for_in_order(workers: int) -> None:
    batches = part_of_rank(epoch_batches(len(SAMPLES), 10, np.random.default_rng(0)), 0, 1)
    loaded = list(load_batches(SAMPLES, batches, workers, pinned=False))
    assert len(loaded) == len(batches)
    for wanted, (indices, cloud, mask, quality) in zip(batches, loaded, strict=True):
        assert np.array_equal(indices.numpy(), wanted)
        assert np.array_equal(cloud.numpy(), SAMPLES.cloud[wanted])
        assert np.array_equal(mask.numpy(), SAMPLES.mask[wanted])
        assert np.array_equal(quality.numpy(), SAMPLES.quality[wanted])


def test_batches_too_small_to_divide_are_refused() -> None:
    batches = epoch_batches(3, 2, np.random.default_rng(0))
    with pytest.raises(ConfigError, match=r"batches of 1 samples .* 2 processes"):
        part_of_rank(batches, 0, 2)


def test_waiting_counts_the_time_before_each_item() -> None:
    waiting = WaitClock()
    assert waiting.share_of(1.0) is None
    assert list(waiting.watch(range(3))) == [0, 1, 2]
    assert waiting.waiting_s > 0
    assert waiting.working_s > 0
    assert 0 < (waiting.share_of(waiting.waiting_s) or 0) < 1
