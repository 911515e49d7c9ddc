"""Samples read by number are those of the shards, however few decoded shards there is room for."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pipeline.artifacts import Provenance
from pipeline.artifacts.publishing import scratch_beside
from pipeline.artifacts.sharding import shard_path
from pipeline.errors import ArtifactError, ConfigError
from pipeline.messages.bounded_samples import DECODED, BoundedSamples, open_training
from pipeline.network.samples import Samples, join_samples
from tests.messages.test_sample_cache import sharded, some_samples

PARTS = [some_samples(count, seed=count) for count in (7, 5, 9, 6)]
WHOLE = join_samples(PARTS)
LARGEST = max(len(part) for part in PARTS)
MIB = 2**20


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four shards of the train split and one of the test split."""
    provenance = Provenance("shards", "0" * 64, "1" * 64, "2" * 64, 0, (), "0.1.0")
    return sharded(tmp_path_factory.mktemp("bounded"), provenance, PARTS)


def bounded(index: Path, cache: Path, shards: float) -> BoundedSamples:
    """With room for so many of the largest shard."""
    samples = BoundedSamples(index, "train", cache, 0)
    samples.limit_bytes = int(shards * LARGEST * samples.sample_bytes)
    return samples


def assert_read(samples: BoundedSamples, numbers: np.ndarray) -> None:
    cloud, mask, quality = samples.rows(numbers)
    np.testing.assert_array_equal(cloud, WHOLE.cloud[numbers])
    np.testing.assert_array_equal(mask, WHOLE.cloud_mask[numbers])
    np.testing.assert_array_equal(quality, WHOLE.quality[numbers])
    assert mask.dtype == np.bool_


def decoded_bytes(cache: Path) -> int:
    """What the arrays take; each file has a header of 128 bytes."""
    return sum(path.stat().st_size - 128 for path in (cache / DECODED).glob("*/*.npy"))


@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data(), shards=st.sampled_from([1.1, 2.1, 10.0]))
def test_any_samples_are_read_whatever_the_room(
    index: Path, tmp_path: Path, data: st.DataObject, shards: float
) -> None:
    samples = bounded(index, tmp_path, shards)
    assert len(samples) == len(WHOLE)
    for _ in range(3):
        numbers = data.draw(st.lists(st.integers(0, len(WHOLE) - 1), min_size=1, max_size=30))
        assert_read(samples, np.array(numbers))
        assert decoded_bytes(tmp_path) <= samples.limit_bytes


def test_a_shard_that_fits_is_decoded_once_and_what_was_used_longest_ago_goes(
    index: Path, tmp_path: Path
) -> None:
    samples = bounded(index, tmp_path, 2.1)
    for first in (0, 7, 12):  # of the first three shards
        assert_read(samples, np.array([first]))
    there = {path.name: path.stat().st_ino for path in (tmp_path / DECODED).iterdir()}
    assert len(there) == 3  # two shards and the lock
    assert_read(samples, np.array([7, 12]))
    assert {p.name: p.stat().st_ino for p in (tmp_path / DECODED).iterdir()} == there
    assert_read(samples, np.array([0]))
    assert {p.name for p in (tmp_path / DECODED).iterdir()} != set(there)


def test_another_process_gets_paths_and_opens_the_files_itself(index: Path, tmp_path: Path) -> None:
    samples = bounded(index, tmp_path, 10)
    assert_read(samples, np.arange(len(WHOLE)))
    sent = pickle.dumps(samples)
    assert len(sent) < 4096 < WHOLE.cloud.nbytes
    assert_read(pickle.loads(sent), np.array([20, 3]))  # noqa: S301 - our own bytes


def test_what_another_process_freed_is_decoded_again(index: Path, tmp_path: Path) -> None:
    one, other = bounded(index, tmp_path, 1.1), bounded(index, tmp_path, 1.1)
    for numbers in ([0], [8], [0], [8, 1]):
        assert_read(one, np.array(numbers))
        assert_read(other, np.array(numbers[::-1]))


def test_a_kill_while_decoding_leaves_nothing_that_passes_for_whole(
    index: Path, tmp_path: Path
) -> None:
    samples = bounded(index, tmp_path, 1.1)
    assert_read(samples, np.array([0]))
    (made,) = (path for path in (tmp_path / DECODED).iterdir() if path.is_dir())
    left = scratch_beside(made)
    made.rename(left)
    (left / "cloud.npy").write_bytes(b"half")
    assert_read(bounded(index, tmp_path, 1.1), np.array([0]))
    assert_read(bounded(index, tmp_path, 1.1), np.array([8]))
    assert not left.exists()  # it takes room as any


def test_a_shard_that_is_not_the_indexs_is_named(tmp_path: Path, provenance: Provenance) -> None:
    index = sharded(tmp_path, provenance, PARTS)
    paths = [shard_path(tmp_path / "shards", number, 5) for number in (0, 1)]
    samples = bounded(index, tmp_path / "cache", 2.1)
    paths[0].write_bytes(paths[1].read_bytes())
    with pytest.raises(ArtifactError, match=r"00000-of-00005\.mcap is not the shard"):
        samples.rows(np.array([0]))
    assert_read(samples, np.array([9]))


def test_a_limit_below_what_a_window_needs_is_told_with_the_remedy(
    index: Path, tmp_path: Path
) -> None:
    samples = BoundedSamples(index, "train", tmp_path, 27 * 100)
    with pytest.raises(ConfigError, match=r"loading\.cache_mib.*train\.shuffle_window"):
        samples.check_room(4)
    roomy = bounded(index, tmp_path, 10)
    roomy.check_room(4)
    roomy.check_room(0)


def test_training_opens_all_or_what_it_needs(index: Path, tmp_path: Path) -> None:
    everything = open_training(index, tmp_path, 1, 0)
    assert isinstance(everything, Samples)
    windows = open_training(index, tmp_path, 1, 5)
    assert isinstance(windows, BoundedSamples)
    assert len(windows) == len(everything) == len(WHOLE)
    assert windows.limit_bytes == MIB - 3 * windows.sample_bytes  # of the test split


def test_one_way_of_keeping_what_is_decoded_leaves_nothing_of_the_other(
    index: Path, tmp_path: Path
) -> None:
    for shards, left in ((10.0, "train-*"), (1.1, DECODED), (10.0, "train-*")):
        assert_read(bounded(index, tmp_path, shards), np.array([0]))
        assert list(tmp_path.glob("train-*")) + list(tmp_path.glob(DECODED)) == list(
            tmp_path.glob(left)
        )
    assert_read(bounded(index, tmp_path, 1.1), np.array([0]))
    open_training(index, tmp_path, 1, 0)
    assert not (tmp_path / DECODED).exists()


def test_the_first_samples_are_whole(index: Path, tmp_path: Path) -> None:
    found = bounded(index, tmp_path, 1.1).first(10)
    np.testing.assert_array_equal(found.level, WHOLE.level[:10])
    np.testing.assert_array_equal(found.cloud, WHOLE.cloud[:10])
    assert len(bounded(index, tmp_path, 1.1).first(1000)) == len(WHOLE)
