"""The baselines of a report of error: each by hand, or against an independent computation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.config import GripperConfig
from pipeline.network.analytic import SMOOTHINGS, TOLERANCES
from pipeline.network.fitted_baselines import (
    ANALYTIC,
    MEAN,
    MEDIAN,
    SEAL_RATIO,
    baseline_errors,
    fit_baselines,
    pad_seal_ratio,
    weighted_median,
)
from pipeline.network.samples import Samples
from tests.network.planes import planes_with_holes

GRIPPER = GripperConfig()


def samples_of(count: int, seed: int, weight: np.ndarray) -> Samples:
    planes = planes_with_holes(count, seed)
    none = np.zeros(count, dtype=np.int64)
    return Samples(
        cloud=planes.cloud.astype(np.float32),
        cloud_mask=planes.mask,
        quality=planes.quality,
        object_index=none,
        shape_class=none,
        level=none,
        pressure=planes.quality,
        proposal_weight=weight,
        pictures=none + 1,
    )


@pytest.fixture(scope="module")
def learned() -> Samples:
    return samples_of(60, 1, np.arange(60.0))


def test_constants_are_the_mean_and_the_median_of_the_training_samples(learned: Samples) -> None:
    fitted = fit_baselines(learned, GRIPPER, analytic_samples=16)
    held_out = samples_of(20, 2, np.ones(20))
    errors = baseline_errors(fitted, held_out)
    for name, constant in ((MEAN, np.mean), (MEDIAN, np.median)):
        value = float(constant(learned.quality.astype(np.float64)))
        expected = np.abs(held_out.quality - value).mean()
        assert errors.balanced[name] == pytest.approx(expected, abs=1e-6)
    # No constant errs less on what it was fitted to than the median.
    own = baseline_errors(fitted, learned)
    assert own.balanced[MEDIAN] <= own.balanced[MEAN]
    assert own.as_proposed[MEDIAN] <= own.as_proposed[MEAN]


def test_what_looks_at_the_cloud_beats_a_constant(learned: Samples) -> None:
    fitted = fit_baselines(learned, GRIPPER, analytic_samples=60)
    errors = baseline_errors(fitted, samples_of(60, 3, np.ones(60)))
    assert errors.balanced[SEAL_RATIO] < 0.7 * errors.balanced[MEDIAN]
    assert errors.balanced[ANALYTIC] < 0.7 * errors.balanced[MEDIAN]
    assert fitted.analytic.tolerance in TOLERANCES
    assert fitted.analytic.smoothing in SMOOTHINGS


def test_where_proposals_are_not_known_errors_over_them_are_left_out() -> None:
    unknown = samples_of(20, 1, np.full(20, np.nan))
    errors = baseline_errors(fit_baselines(unknown, GRIPPER, 16), unknown)
    assert errors.as_proposed == {}
    assert errors.summary()["analytic_mae_as_proposed"] is None
    assert errors.summary()["median_predictor_mae"] == errors.balanced[MEDIAN]


def test_a_full_flat_cloud_seals_whole() -> None:
    planes = planes_with_holes(1, seed=0)
    cloud = planes.cloud.astype(np.float32)
    cloud[..., 2] = 0.0
    ratio = pad_seal_ratio(cloud, np.ones_like(planes.mask), GRIPPER.pad)
    assert ratio == pytest.approx([1.0])


def test_weighted_median_by_hand() -> None:
    values = np.array([3.0, 1.0, 2.0])
    assert weighted_median(values, np.array([1.0, 0.0, 0.0])) == 3.0
    assert weighted_median(values, np.array([1.0, 5.0, 1.0])) == 1.0


@given(st.lists(st.tuples(st.floats(0, 1), st.integers(1, 4)), min_size=1, max_size=12))
def test_a_weight_counts_as_so_many_equal_values(weighted: list[tuple[float, int]]) -> None:
    values, counts = (np.array(part, dtype=np.float64) for part in zip(*weighted, strict=True))
    repeated = np.sort(np.repeat(values, counts.astype(int)))
    assert weighted_median(values, counts) == repeated[(len(repeated) - 1) // 2]
