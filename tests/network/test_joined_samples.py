"""Several sets of samples read as one, here and in other processes."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.errors import ArtifactError
from pipeline.network.joined_samples import JoinedSamples
from pipeline.network.loading import load_batches
from pipeline.network.samples import GraspTensors, SampleReader
from tests.network.planes import planes_with_holes

SETS = [planes_with_holes(count, seed=count) for count in (5, 1, 9)]
TOGETHER = GraspTensors(
    np.concatenate([one.cloud for one in SETS]),
    np.concatenate([one.mask for one in SETS]),
    np.concatenate([one.quality for one in SETS]),
)


@given(st.lists(st.integers(0, len(TOGETHER) - 1), min_size=1, max_size=20))
def test_rows_are_those_of_the_sets_one_behind_the_other(numbers: list[int]) -> None:
    joined = JoinedSamples(SETS)
    assert isinstance(joined, SampleReader)
    assert len(joined) == len(TOGETHER)
    asked = np.array(numbers)
    for got, true in zip(joined.rows(asked), TOGETHER.rows(asked), strict=True):
        assert got.dtype == true.dtype
        np.testing.assert_array_equal(got, true)


def test_the_digest_tells_sets_and_their_order() -> None:
    digests = {JoinedSamples(sets).sha256() for sets in (SETS, SETS[::-1], SETS[:2])}
    assert len(digests) == 3


def test_another_process_maps_the_files_and_reads_the_same(tmp_path: Path) -> None:
    sets = [mapped(one, tmp_path / str(number)) for number, one in enumerate(SETS)]
    joined = JoinedSamples(sets)
    batches = [np.array([0, 4, 5, 6, 14]), np.array([2, 13])]
    assert len(pickle.dumps(joined)) < SETS[0].cloud.nbytes / 10  # paths travel, not samples
    here = list(load_batches(JoinedSamples(SETS), batches, 0, pinned=False))
    there = list(load_batches(joined, batches, 1, pinned=False, start_method="spawn"))
    for one, other in zip(here, there, strict=True):
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a.numpy(), b.numpy())


def mapped(samples: GraspTensors, folder: Path) -> GraspTensors:
    """The same samples, mapped from files."""
    folder.mkdir()
    arrays = {"cloud": samples.cloud, "mask": samples.mask, "quality": samples.quality}
    for name, array in arrays.items():
        np.save(folder / f"{name}.npy", array)
    return GraspTensors(*(np.load(folder / f"{name}.npy", mmap_mode="c") for name in arrays))


def test_sets_of_other_grids_are_told() -> None:
    small = GraspTensors(SETS[0].cloud[:, 4:-4, 4:-4], SETS[0].mask[:, 4:-4, 4:-4], SETS[0].quality)
    with pytest.raises(ArtifactError, match="grids of 16 and 24 cells a side"):
        JoinedSamples([SETS[0], small])
