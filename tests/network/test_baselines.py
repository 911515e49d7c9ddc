"""The baselines do what their names say on clouds whose answer is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pipeline.network import baselines
from pipeline.network.baselines import (
    fit_monotone,
    mean_predictor_mae,
    seal_ratio,
    weighted_mean_predictor_mae,
)
from pipeline.network.figures import mean_absolute_error
from tests.network.planes import SEAL_RADIUS, grid_xy, planes_with_holes

TOLERANCE = 0.04


def test_mean_predictor_by_hand() -> None:
    train = np.array([0.0, 1.0], dtype=np.float32)
    test = np.array([0.0, 0.5, 1.0], dtype=np.float32)
    assert mean_predictor_mae(train, test) == pytest.approx(1 / 3)


def test_full_tilted_plane_seals_and_half_a_plane_half() -> None:
    x, y = grid_xy()
    cloud = np.stack((x, y, 0.3 * x - 0.1 * y + 0.2), axis=-1)[None].repeat(3, axis=0)
    mask = np.ones(cloud.shape[:3], dtype=np.bool_)
    mask[1, :, :12] = False
    cloud[2, :, 18:, 2] -= 1.0  # a step that leaves x < 0.6: the plane stays that of the rest
    ratios = seal_ratio(cloud, mask, SEAL_RADIUS, TOLERANCE)
    share = (x[np.hypot(x, y) <= SEAL_RADIUS] < 0.6).mean()
    assert ratios == pytest.approx([1.0, 0.5, share])


def test_nothing_seen_is_no_seal() -> None:
    cloud = np.zeros((1, 24, 24, 3))
    assert seal_ratio(cloud, np.zeros((1, 24, 24), dtype=np.bool_), 0.8, TOLERANCE) == [0.0]


def test_seal_ratios_do_not_depend_on_how_many_clouds_are_held_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    planes = planes_with_holes(20, seed=3)
    whole = seal_ratio(planes.cloud, planes.mask, SEAL_RADIUS, TOLERANCE)
    monkeypatch.setattr(baselines, "PART", 7)
    parts = seal_ratio(planes.cloud, planes.mask, SEAL_RADIUS, TOLERANCE)
    np.testing.assert_array_equal(parts, whole)


def test_seal_ratio_regressor_beats_the_mean_on_planes_with_holes() -> None:
    train, test = planes_with_holes(300, seed=0), planes_with_holes(300, seed=1)
    regressor = fit_monotone(
        seal_ratio(train.cloud, train.mask, SEAL_RADIUS, TOLERANCE), train.quality
    )
    predicted = regressor.predict(seal_ratio(test.cloud, test.mask, SEAL_RADIUS, TOLERANCE))
    mae = mean_absolute_error(predicted, test.quality)
    assert mae < 0.5 * mean_predictor_mae(train.quality, test.quality)


@given(arrays(np.float64, (2, 20), elements=st.floats(0, 1)))
def test_monotone_regressor_rises_and_keeps_the_mean(pair: np.ndarray) -> None:
    feature, quality = pair
    regressor = fit_monotone(feature, quality)
    assert bool(np.all(np.diff(regressor.quality) >= -1e-12))
    assert regressor.predict(feature).mean() == pytest.approx(quality.mean())


def test_the_weighted_mean_is_weighted_in_what_it_predicts_and_in_its_error() -> None:
    learned, test = np.array([0.0, 1.0]), np.array([0.25, 1.0])
    found = weighted_mean_predictor_mae(learned, np.array([3.0, 1.0]), test, np.array([1.0, 2.0]))
    assert found == pytest.approx((1 * 0.0 + 2 * 0.75) / 3)
    even = weighted_mean_predictor_mae(learned, np.ones(2), test, np.ones(2))
    assert even == pytest.approx(mean_predictor_mae(learned, test))
    assert weighted_mean_predictor_mae(learned, np.full(2, np.nan), test, np.ones(2)) is None


def test_a_regressor_without_repeats_is_the_same_function() -> None:
    feature = np.linspace(0, 1, 40)
    fitted = fit_monotone(feature, np.floor(4 * feature) / 4)
    short = fitted.without_repeats()
    assert len(short.feature) < 12
    at = np.linspace(-0.2, 1.2, 999)
    np.testing.assert_array_equal(short.predict(at), fitted.predict(at))
