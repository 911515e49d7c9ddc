"""Outcomes against q-hat by definitions, and as samples that a network learns from."""

from itertools import product

import numpy as np
import pytest

from pipeline.errors import ArtifactError
from pipeline.network.outcomes import (
    TriedContacts,
    against_outcomes,
    outcome_samples,
    with_outcomes,
)
from tests.network.planes import planes_with_holes


def tried(count: int, seed: int = 0) -> TriedContacts:
    samples = planes_with_holes(count, seed)
    rng = np.random.default_rng(seed)
    return TriedContacts(
        np.asarray(samples.cloud),
        np.asarray(samples.mask),
        rng.random(count),
        np.asarray(samples.quality) > 0.5,
    )


def test_auroc_is_the_share_of_pairs_in_the_right_order() -> None:
    rng = np.random.default_rng(1)
    predicted, lifted = rng.integers(0, 8, 60) / 8, rng.random(60) < 0.4
    pairs = list(product(predicted[lifted], predicted[~lifted]))
    share = np.mean([1.0 if a > b else 0.5 if a == b else 0.0 for a, b in pairs])
    found = against_outcomes(predicted, lifted)
    assert found["auroc"] == pytest.approx(share)
    assert found["brier"] == pytest.approx(np.mean((predicted - lifted) ** 2))
    assert against_outcomes(predicted, np.ones(60, dtype=bool))["auroc"] is None


def test_bins_hold_every_contact_once_with_its_share() -> None:
    predicted = np.array([0.0, 0.19, 0.2, 0.5, 0.99, 1.0])
    lifted = np.array([False, True, False, True, True, True])
    found = against_outcomes(predicted, lifted)
    assert [one["contacts"] for one in found["bins"]] == [2, 1, 1, 2]
    assert [one["share"] for one in found["bins"]] == [0.5, 0.0, 1.0, 1.0]
    for one in (*found["bins"], found):
        low, high = one["interval_95"]
        assert 0 <= low <= one["share"] <= high <= 1
    assert (found["contacts"], found["lifted"]) == (6, 4)


def test_a_network_that_knows_has_points_on_the_diagonal() -> None:
    rng = np.random.default_rng(2)
    predicted = rng.random(4000)
    found = against_outcomes(predicted, rng.random(4000) < predicted)
    for one in found["bins"]:
        low, high = one["interval_95"]
        assert low - 0.03 < one["mean_predicted"] < high + 0.03
    assert found["brier"] == pytest.approx(1 / 6, abs=0.01)


def test_outcomes_are_labelled_by_the_mean_q_of_their_side() -> None:
    quality = np.array([0.0, 0.1, 0.3, 0.6, 0.9], dtype=np.float32)
    contacts = tried(12)
    mask = contacts.mask.copy()
    mask[3] = False  # nothing was measured around it
    samples = outcome_samples(
        TriedContacts(contacts.cloud, mask, contacts.predicted, contacts.lifted), quality, 0.5
    )
    assert len(samples) == 11
    expected = np.where(np.delete(contacts.lifted, 3), 0.75, 0.4 / 3)
    assert samples.quality == pytest.approx(expected)
    assert samples.quality.dtype == quality.dtype


def test_outcomes_stand_behind_the_samples_so_many_times() -> None:
    samples, contacts = planes_with_holes(20, 5), tried(6)
    outcomes = outcome_samples(contacts, np.asarray(samples.quality), 0.5)
    joined = with_outcomes(samples, outcomes, 3)
    assert len(joined) == 20 + 3 * 6
    assert joined.quality[:20] == pytest.approx(samples.quality)
    for part in range(3):
        own = slice(20 + 6 * part, 26 + 6 * part)
        assert (joined.cloud[own] == contacts.cloud).all()
        assert joined.quality[own] == pytest.approx(outcomes.quality)


def test_what_says_nothing_is_told() -> None:
    contacts, quality = tried(4), np.array([0.1, 0.9])
    empty = TriedContacts(
        contacts.cloud, np.zeros_like(contacts.mask), contacts.predicted, contacts.lifted
    )
    with pytest.raises(ArtifactError, match="no tried contact has a measured cloud"):
        outcome_samples(empty, quality, 0.5)
    with pytest.raises(ArtifactError, match=r"all training samples lie on one side of q = 0\.95"):
        outcome_samples(contacts, quality, 0.95)
    small = TriedContacts(
        contacts.cloud[:, :12, :12], contacts.mask[:, :12, :12], contacts.predicted, contacts.lifted
    )
    with pytest.raises(ArtifactError, match="a grid of 12 cells a side, and the run's samples 24"):
        with_outcomes(planes_with_holes(4, 0), outcome_samples(small, quality, 0.5), 1)
