"""The threshold of «good» against samples whose probability is known."""

import numpy as np
import pytest

from pipeline.network.calibration import Calibration, fit_calibration, kept_by


def drawn(n: int = 40_000) -> tuple[np.ndarray, np.ndarray]:
    """q-hat uniform; q is 1 with probability q-hat squared, else 0."""
    rng = np.random.default_rng(0)
    predicted = rng.random(n)
    return predicted, (rng.random(n) < predicted**2).astype(np.float64)


def test_the_probability_is_found() -> None:
    predicted, quality = drawn()
    fitted = fit_calibration(predicted, quality, np.ones(len(predicted)), 0.5)
    for at in (0.3, 0.5, 0.8):
        assert fitted.at(at) == pytest.approx(at**2, abs=0.04)
    assert fitted.threshold(0.64) == pytest.approx(0.8, abs=0.03)
    assert (np.diff(fitted.probability) >= 0).all()


def test_weights_make_rare_grasps_count() -> None:
    predicted, quality = np.full(10, 0.5), np.repeat([0.0, 1.0], 5)
    weight = np.repeat([1.0, 4.0], 5)
    assert fit_calibration(predicted, quality, weight, 0.5).at(0.5) == pytest.approx(0.8)
    without = fit_calibration(predicted, quality, np.repeat([1.0, 0.0], 5), 0.5)
    assert without.at(0.5) == 0.0


def test_no_threshold_where_none_is_sure_enough() -> None:
    predicted, quality = drawn()
    fitted = fit_calibration(predicted, 0.4 * quality, np.ones(len(predicted)), 0.5)
    assert fitted.threshold(0.5) is None
    assert Calibration(np.array([0.2, 0.6]), np.array([0.1, 0.9])).at(0.1) == 0.1


def test_precision_and_recall_of_a_threshold() -> None:
    predicted = np.array([0.1, 0.6, 0.7, 0.9])
    quality = np.array([0.9, 0.2, 0.8, 0.9])
    kept = kept_by(0.6, predicted, quality, np.array([1.0, 1.0, 1.0, 2.0]), 0.5)
    assert kept.above == 3
    assert kept.precision == pytest.approx(3 / 4)
    assert kept.recall == pytest.approx(3 / 4)
    assert kept_by(0.95, predicted, quality, np.ones(4), 0.5).precision is None
