"""Figures against hand-counted cases."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pipeline.errors import ArtifactError
from pipeline.network.figures import (
    BINS,
    calibration,
    error_by_group,
    error_by_quality_bin,
    mean_absolute_error,
    weighted_error,
)

PREDICTED = np.array([0.1, 0.4, 0.95, 1.0], dtype=np.float32)
QUALITY = np.array([0.0, 0.5, 1.0, 0.9], dtype=np.float32)

unit_pairs = arrays(np.float64, (2, 30), elements=st.floats(0, 1))


def test_mean_absolute_error_by_hand() -> None:
    assert mean_absolute_error(PREDICTED, QUALITY) == pytest.approx((0.1 + 0.1 + 0.05 + 0.1) / 4)


def test_no_samples_are_an_error_and_not_a_number() -> None:
    with pytest.raises(ArtifactError, match="no error can be taken"):
        mean_absolute_error(PREDICTED[:0], QUALITY[:0])


def test_bins_by_hand_with_one_in_the_last() -> None:
    rows = error_by_quality_bin(PREDICTED, QUALITY)
    assert [row.count for row in rows] == [1, 0, 0, 0, 0, 1, 0, 0, 0, 2]
    assert rows[9].mae == pytest.approx(0.075)
    assert rows[1].mae is None


def test_classes_by_hand() -> None:
    classes = np.array(["typical", "basic", "basic", "typical"])
    errors = error_by_group(PREDICTED, QUALITY, classes)
    assert list(errors) == ["basic", "typical"]
    assert errors["basic"] == pytest.approx(0.075)
    assert errors["typical"] == pytest.approx(0.1)


@given(unit_pairs)
def test_bins_together_are_the_whole(pair: np.ndarray) -> None:
    predicted, quality = pair
    rows = error_by_quality_bin(predicted, quality)
    assert sum(row.count for row in rows) == len(quality)
    total = sum(row.count * row.mae for row in rows if row.mae is not None)
    assert total / len(quality) == pytest.approx(mean_absolute_error(predicted, quality))


@given(arrays(np.float64, 30, elements=st.floats(0, 1)))
def test_perfect_predictions_are_calibrated(quality: np.ndarray) -> None:
    rows = calibration(quality, quality)
    assert len(rows) == BINS
    for row in rows:
        assert row.mean_predicted == row.mean_quality
        if row.mean_predicted is not None:
            assert row.low - 1e-12 <= row.mean_predicted <= row.high + 1e-12


def test_weighted_error_by_hand_and_none_without_weights() -> None:
    weight = np.array([3.0, 0.0, 1.0, 0.0])
    errors = np.abs(PREDICTED - QUALITY)
    expected = (3 * errors[0] + errors[2]) / 4
    assert weighted_error(PREDICTED, QUALITY, weight) == pytest.approx(expected)
    assert weighted_error(PREDICTED, QUALITY, np.ones(4)) == pytest.approx(errors.mean())
    assert weighted_error(PREDICTED, QUALITY, np.full(4, np.nan)) is None
    assert weighted_error(PREDICTED, QUALITY, np.zeros(4)) is None
