"""Every sample once an epoch, whoever reads it; a resumed epoch reads exactly what is left."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.errors import ConfigError
from pipeline.network.loading import (
    WaitClock,
    batch_count,
    epoch_batches,
    load_batches,
    part_of_rank,
)
from tests.network.planes import planes_with_holes

SAMPLES = planes_with_holes(53, seed=0)


@given(
    samples=st.integers(8, 500),
    batch_size=st.integers(8, 64),
    ranks=st.integers(1, 4),
    done=st.integers(0, 10),
    seed=st.integers(0, 2**32),
)
def test_ranks_share_an_epoch_without_loss_or_double(
    samples: int, batch_size: int, ranks: int, done: int, seed: int
) -> None:
    batches = epoch_batches(samples, batch_size, np.random.default_rng(seed))
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
