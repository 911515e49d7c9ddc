"""Distances of labels against their definition, and p against chance that is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import wasserstein_distance

from pipeline.reporting.differences import (
    BINS,
    Labels,
    counts_by_clutter,
    distances,
    error_change,
    label_distance,
    label_distances,
)


def labels(quality: np.ndarray, clutters: int = 10, **groups: np.ndarray) -> Labels:
    return Labels(quality, np.arange(len(quality)) % clutters, groups)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_distance_is_wassersteins_to_a_bin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mine, other = rng.beta(2, 3, 80), rng.beta(3, 2, 50)
    counts = [counts_by_clutter(labels(q)).sum(axis=0)[None] for q in (mine, other)]
    (found,) = distances(*counts)
    assert found == pytest.approx(wasserstein_distance(mine, other), abs=1 / BINS)


def test_a_shift_is_its_own_distance_and_no_chance() -> None:
    quality = np.random.default_rng(0).uniform(0.1, 0.5, 2000)
    ours, theirs = labels(quality), labels(quality + 0.3)
    found = label_distance("all", ours, theirs, np.random.default_rng(1))
    assert found.distance == pytest.approx(0.3, abs=0.01)
    assert found.p == pytest.approx(1 / 2001)
    assert not found.is_chance
    assert found.interval[0] < found.distance < found.interval[1]


def test_equal_labels_are_chance() -> None:
    same = labels(np.random.default_rng(0).uniform(0, 1, 300))
    found = label_distance("all", same, same, np.random.default_rng(1))
    assert found.distance == 0.0
    assert found.p == 1.0
    assert found.is_chance


def test_clutters_that_differ_among_themselves_are_no_difference_of_runs() -> None:
    """Grasps of one clutter share its mean: taken one by one, they would seem to differ."""
    rejected = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        means = rng.uniform(0.2, 0.8, (2, 8))
        ours, theirs = (
            labels(np.clip(np.tile(m, 50) + 0.02 * rng.normal(size=400), 0, 1), clutters=8)
            for m in means
        )
        rejected += not label_distance("all", ours, theirs, rng).is_chance
    assert rejected <= 4  # one is expected; five and more have a chance of 3 in 1000


def test_one_clutter_tells_nothing_of_chance() -> None:
    ours = labels(np.full(50, 0.2), clutters=1)
    found = label_distance("all", ours, labels(np.full(50, 0.9)), np.random.default_rng(0))
    assert found.distance == pytest.approx(0.7, abs=0.01)
    assert found.p is None


def test_groups_that_both_have_are_compared_one_by_one() -> None:
    quality = np.linspace(0, 0.99, 40)
    ours = labels(quality, level=np.repeat([1, 2], 20))
    theirs = labels(quality, level=np.repeat([2, 3], 20))
    found = label_distances(ours, theirs, lambda name: np.random.default_rng(len(name)))
    assert [one.group for one in found] == ["all", "level 2"]
    assert found[1].grasps == (20, 20)
    assert found[1].distance == pytest.approx(0.5, abs=0.02)


def test_errors_on_the_same_objects_are_paired() -> None:
    ours = np.linspace(0.02, 0.2, 12)
    better = error_change(ours.tolist(), (ours - 0.01).tolist())
    assert better is not None
    assert better.mean[0] - better.mean[1] == pytest.approx(0.01)
    assert better.p is not None
    assert better.p < 0.01
    assert error_change([], []) is None
    single = error_change([0.1], [0.2])
    assert single is not None
    assert single.p is None
    equal = error_change([0.1, 0.2], [0.1, 0.2])
    assert equal is not None
    assert equal.p == 1.0
