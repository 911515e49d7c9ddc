"""Samples go to parts and within parts at random, and lie where they are put."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.errors import ArtifactError
from pipeline.network.samples import Samples, join_samples
from pipeline.network.shuffling import (
    draw_parts,
    near_equal_sizes,
    part_count,
    placed,
    positions_by_part,
    positions_in,
)


def numbered(count: int, first: int = 0) -> Samples:
    """Samples whose pressure is their number."""
    number = np.arange(first, first + count)
    return Samples(
        cloud=np.broadcast_to(number[:, None, None, None], (count, 2, 2, 3)).astype(np.float16),
        cloud_mask=np.ones((count, 2, 2), np.bool_),
        quality=np.zeros(count),
        object_index=number,
        shape_class=number % 3,
        level=number % 9,
        pressure=number.astype(np.float64),
        proposal_weight=np.ones(count),
        pictures=np.ones(count, np.int64),
    )


def test_parts_but_the_last_are_equally_likely_and_as_large_as_wanted() -> None:
    samples, wanted = 90_000, 20_000
    part = draw_parts(samples, samples, wanted, np.random.default_rng(0))
    sizes = np.bincount(part, minlength=part_count(samples, wanted))
    expected = np.array([wanted] * 4 + [10_000])
    assert len(sizes) == len(expected)
    # Each is binomial: five standard deviations.
    assert (np.abs(sizes - expected) < 5 * np.sqrt(expected)).all()


@given(
    samples=st.integers(1, 200),
    wanted=st.integers(1, 70),
    pieces=st.integers(1, 5),
    seed=st.integers(0, 2**32),
)
def test_placed_by_part_is_sorted_by_part(
    samples: int, wanted: int, pieces: int, seed: int
) -> None:
    """Against NumPy's own indexing of all samples at once."""
    part = draw_parts(samples, samples, wanted, np.random.default_rng(seed))
    cuts = np.array_split(np.arange(samples), pieces)
    batches = [numbered(len(cut), int(cut[0])) for cut in cuts if len(cut)]
    found = placed(batches, positions_by_part(part))
    expected = join_samples(batches).take(np.argsort(part, kind="stable"))
    np.testing.assert_array_equal(found.pressure, expected.pressure)
    np.testing.assert_array_equal(found.cloud, expected.cloud)
    order = np.random.default_rng(seed).permutation(samples)
    np.testing.assert_array_equal(
        placed(batches, positions_in(order)).object_index,
        join_samples(batches).take(order).pressure,
    )


@pytest.mark.parametrize("there", [4, 6])
def test_grasps_other_than_the_index_names_are_refused(there: int) -> None:
    with pytest.raises(ArtifactError, match="not the 5 grasps"):
        placed([numbered(there)], np.arange(5))


@given(count=st.integers(1, 10_000), most=st.integers(1, 500))
def test_pieces_are_few_and_nearly_equal(count: int, most: int) -> None:
    sizes = near_equal_sizes(count, most)
    assert sum(sizes) == count
    assert max(sizes) <= most
    assert max(sizes) - min(sizes) <= 1
    assert (len(sizes) - 1) * most < count
