"""How scores and loads agree: against definitions and hand-made orders."""

import numpy as np
import pytest

from pipeline.config.agreement import AgreementConfig
from pipeline.referee.agreement import (
    agreement,
    auroc,
    borne_by_tenth,
    figures_of,
    most_apart,
    spearman,
    spearman_within,
    varied,
    weighted_spearman,
)


def test_auroc_is_the_chance_of_a_right_order() -> None:
    rng = np.random.default_rng(0)
    score = rng.integers(0, 20, 60) / 20  # with ties
    holds = rng.random(60) < 0.4
    pairs = score[holds][:, None] - score[~holds][None]
    assert auroc(score, holds) == pytest.approx((pairs > 0).mean() + 0.5 * (pairs == 0).mean())
    assert auroc(score, np.ones(60, dtype=bool)) is None


def test_spearman_is_of_ranks() -> None:
    x = np.arange(10.0)
    assert spearman(x, np.exp(x)) == pytest.approx(1.0)
    assert spearman(x, -(x**3)) == pytest.approx(-1.0)
    assert spearman(np.zeros(10), x) is None


def test_a_weight_counts_a_grasp_so_often() -> None:
    rng = np.random.default_rng(2)
    score, borne = rng.integers(0, 6, 40) / 6, rng.integers(0, 9, 40) * 0.5
    often = rng.integers(1, 5, 40)
    expected = spearman(np.repeat(score, often), np.repeat(borne, often))
    assert weighted_spearman(score, borne, often.astype(float)) == pytest.approx(expected)
    assert weighted_spearman(score, borne, np.ones(40)) == pytest.approx(spearman(score, borne))
    assert weighted_spearman(np.ones(40), borne, np.ones(40)) is None


def test_within_objects_a_difference_between_them_is_no_matter() -> None:
    score = np.tile(np.arange(25.0), 2)
    objects = np.repeat([0, 1], 25)
    borne = score - 100.0 * objects
    assert spearman_within(score, borne, objects) == pytest.approx(1.0)
    pooled = spearman(score, borne)
    assert pooled is not None
    assert pooled < 0.7
    assert spearman_within(score[:10], borne[:10], objects[:10]) is None


def test_grasps_without_a_score_are_left_out() -> None:
    score = np.array([0.1, np.nan, 0.9, 0.5])
    found = agreement(
        score,
        np.arange(4.0),
        np.array([0, 0, 1, 1]),
        np.ones(4),
        (1.5,),
        50,
        np.random.default_rng(0),
    )
    assert found["grasps"] == 3
    assert found["auroc"] == {"1.5": 1.0}
    low, high = found["spearman_interval"]
    assert -1 <= low <= found["spearman"] <= high <= 1


def test_tenths_have_quartiles() -> None:
    rows = borne_by_tenth(np.array([0.05, 0.05, 0.05, 1.0]), np.array([1.0, 2.0, 3.0, 9.0]))
    assert rows[0]["count"] == 3
    assert rows[0]["quartiles_n"] == [1.5, 2.0, 2.5]
    assert rows[9]["quartiles_n"] == [9.0, 9.0, 9.0]
    assert rows[5] == {"tenth": 5, "count": 0, "quartiles_n": [None] * 3}


def test_the_most_overrated_come_first_then_the_most_underrated() -> None:
    score = np.array([0.9, 0.1, 0.5, 0.6])
    borne = np.array([0.0, 9.0, 5.0, 6.0])
    assert most_apart(score, borne, 2).tolist() == [0, 1]


def test_figures_have_the_names_that_others_rely_on() -> None:
    rng = np.random.default_rng(1)
    quality = rng.random(50)
    found = {"borne_n": 4 * quality, "straight_n": quality**2}
    config = AgreementConfig(resamples=10)
    figures = figures_of({"q": quality}, found, np.arange(50) % 5, np.ones(50), config, rng)
    assert figures["grasps"] == 50
    assert figures["spearman"] == pytest.approx(1.0)
    assert figures["auroc"]["2"] == 1.0
    scores = {"q": quality, "p": 1 - quality}
    again = varied(scores, found["borne_n"], {"half": 2 * quality}, config)
    assert list(again) == ["as configured", "half"]
    assert again["half"]["median_borne_n"] == pytest.approx(2 * np.median(quality))
    assert again["half"]["scores"]["q"]["spearman"] == pytest.approx(1.0)
    assert again["half"]["scores"]["p"]["spearman"] == pytest.approx(-1.0)
