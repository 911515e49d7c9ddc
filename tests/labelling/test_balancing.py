"""Balancing: never more than asked, flatter, honest about its probabilities."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pipeline.labelling.balancing import (
    balance_labels,
    draw_rare_grasps,
    proposal_weights,
    quality_histogram,
    tenth_of,
)
from pipeline.labelling.sampling import Proposal

LABELS = hnp.arrays(np.float64, st.integers(1, 200), elements=st.floats(0, 1))


def test_tenths_at_their_borders() -> None:
    np.testing.assert_array_equal(
        tenth_of(np.array([0.0, 0.0999, 0.1, 0.95, 1.0])), [0, 0, 1, 9, 9]
    )


@given(LABELS, st.integers(1, 300), st.floats(0, 1), st.integers(0, 5))
def test_kept_are_distinct_sorted_and_as_many_as_there_can_be(
    quality: np.ndarray, wanted: int, balance: float, seed: int
) -> None:
    kept, probability = balance_labels(quality, wanted, balance, np.random.default_rng(seed))
    assert len(kept) == min(wanted, len(quality))
    assert (np.diff(kept) > 0).all()
    assert ((probability > 0) & (probability <= 1)).all()


@given(LABELS, st.integers(1, 200), st.floats(0, 1))
def test_probability_is_the_share_of_the_tenth_that_was_kept(
    quality: np.ndarray, wanted: int, balance: float
) -> None:
    kept, probability = balance_labels(quality, wanted, balance, np.random.default_rng(0))
    there, left = quality_histogram(quality), quality_histogram(quality[kept])
    tenths = tenth_of(quality[kept])
    np.testing.assert_allclose(probability, (left / np.maximum(there, 1))[tenths])


def test_full_balance_is_flat_where_there_are_enough() -> None:
    quality = np.concatenate([np.full(1000, 0.05), np.full(200, 0.45), np.full(30, 0.95)])
    kept, _ = balance_labels(quality, 330, 1.0, np.random.default_rng(0))
    np.testing.assert_array_equal(quality_histogram(quality[kept])[[0, 4, 9]], [150, 150, 30])


def test_no_balance_keeps_the_proportions() -> None:
    quality = np.concatenate([np.full(900, 0.05), np.full(100, 0.95)])
    kept, _ = balance_labels(quality, 100, 0.0, np.random.default_rng(0))
    np.testing.assert_array_equal(quality_histogram(quality[kept])[[0, 9]], [90, 10])


def test_rare_labels_are_drawn_as_often_as_common_ones() -> None:
    quality = np.concatenate([np.full(990, 0.05), np.full(10, 0.55)])
    drawn = draw_rare_grasps(quality, 4000, np.random.default_rng(0))
    # Binomial(4000, 1/2): five standard deviations are 0.04.
    assert abs((quality[drawn] > 0.5).mean() - 0.5) < 0.04


def test_weights_undo_what_balancing_did() -> None:
    rng = np.random.default_rng(0)
    quality = np.concatenate([rng.beta(0.2, 1.0, 6000), rng.random(9000)])
    proposal = np.repeat([Proposal.NORMAL, Proposal.TILTED, Proposal.NEARBY], [3000, 3000, 9000])
    kept, probability = balance_labels(quality, 5000, 0.7, rng)
    weight = proposal_weights(proposal[kept], probability)
    assert (weight[proposal[kept] == Proposal.NEARBY] == 0).all()
    assert abs(quality[kept].mean() - quality[:6000].mean()) > 0.1
    # Some 1500 kept of a spread of 0.25: four standard errors are 0.03.
    assert np.average(quality[kept], weights=weight) == pytest.approx(
        quality[:6000].mean(), abs=0.03
    )
    assert weight.sum() == pytest.approx(6000, rel=0.05)
