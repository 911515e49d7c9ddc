"""Sums around points, against a search of all pairs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from pipeline.labelling.neighbourhood import sums_within


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    radius=st.sampled_from([1e-4, 0.01, 0.1, 3.0]),
    flat=st.booleans(),
)
def test_sums_are_those_of_all_pairs_bit_by_bit(seed: int, radius: float, flat: bool) -> None:
    """Added in the order of the points, as a tree's sorted answers would be."""
    rng = np.random.default_rng(seed)
    points = rng.normal(scale=0.05, size=(rng.integers(1, 400), 3)) * [1, 1, 0 if flat else 1]
    values = rng.normal(size=points.shape)
    # On points, beside them, and far from all.
    around = np.concatenate([points[:20], rng.normal(scale=0.05, size=(20, 3)), [[9.0, 9, 9]]])
    sums, counts = sums_within(points, values, around, radius)
    near = cKDTree(points).query_ball_point(around, radius)
    expected = np.zeros((len(around), 3))
    for row, indices in enumerate(near):
        for index in sorted(indices):
            expected[row] += values[index]
    np.testing.assert_array_equal(counts, [len(indices) for indices in near])
    assert sums.tobytes() == expected.tobytes()


def test_points_at_the_radius_count() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0]])
    sums, counts = sums_within(points, points, np.zeros((1, 3)), 1.0)
    np.testing.assert_array_equal(counts, [2])
    np.testing.assert_array_equal(sums, [[1.0, 0, 0]])


@pytest.mark.parametrize("points", [0, 1])
def test_no_place_has_no_sum(points: int) -> None:
    """Nothing is asked; and one point alone is its own sum."""
    sums, counts = sums_within(np.ones((1, 3)), np.ones((1, 3)), np.ones((points, 3)), 0.1)
    np.testing.assert_array_equal(sums, np.ones((points, 3)))
    np.testing.assert_array_equal(counts, np.ones(points))
