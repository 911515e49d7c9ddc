"""Errors by object: the mean over objects weighs each alike, and what cannot be gripped apart."""

import numpy as np
import pytest

from pipeline.errors import ArtifactError
from pipeline.network.by_object import (
    check_labels,
    errors_by_object,
    interval_of_mean,
    macro_error,
)

NAMES = ("peg", "ball", "fork")  # the first has no grasps
INDEX = np.array([1, 1, 1, 2])
WEIGHT = np.array([1, 0, 3, 1], dtype=np.float32)
QUALITY = np.array([0.5, 0.6, 0.7, 0.01], dtype=np.float32)


def test_each_object_counts_once() -> None:
    single, averaged = QUALITY + np.float32(0.1), QUALITY + np.float32(0.02)
    single[3] = 0.01
    found = errors_by_object(NAMES, INDEX, QUALITY, single, averaged, WEIGHT)
    assert [(one.name, one.grasps, one.graspable) for one in found] == [
        ("ball", 3, True),
        ("fork", 1, False),
    ]
    assert [one.mae for one in found] == pytest.approx([0.1, 0.0], abs=1e-6)
    assert [one.mae_averaged for one in found] == pytest.approx([0.02, 0.02], abs=1e-6)
    assert macro_error(found, graspable_alone=False) == pytest.approx(0.05, abs=1e-6)
    assert macro_error(found, graspable_alone=True) == pytest.approx(0.1, abs=1e-6)


def test_where_nothing_can_be_gripped_there_is_no_mean() -> None:
    low = np.full(4, 0.01, dtype=np.float32)
    found = errors_by_object(NAMES, INDEX, low, low, low, WEIGHT)
    assert macro_error(found, graspable_alone=True) is None
    assert macro_error(found, graspable_alone=False) == 0.0


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -0.1, 1.1])
def test_a_label_that_is_no_quality_is_told_with_its_object(wrong: float) -> None:
    check_labels(NAMES, INDEX, QUALITY)
    quality = QUALITY.copy()
    quality[3] = wrong
    with pytest.raises(ArtifactError, match=r"1 of 4 labels .* on fork"):
        check_labels(NAMES, INDEX, quality)


def test_grasps_as_proposed_are_weighed() -> None:
    single = QUALITY + np.array([0.4, 0.9, 0.0, 0.1], dtype=np.float32)
    ball, _ = errors_by_object(NAMES, INDEX, QUALITY, single, single, WEIGHT)
    assert ball.mae_as_proposed == pytest.approx((0.4 * 1 + 0.0 * 3) / 4, abs=1e-6)
    unknown = np.full(4, np.nan, dtype=np.float32)
    assert (
        errors_by_object(NAMES, INDEX, QUALITY, single, single, unknown)[0].mae_as_proposed is None
    )


def test_the_interval_is_that_of_a_mean_of_many_objects() -> None:
    values = np.random.default_rng(0).normal(0.05, 0.02, 400)
    found = interval_of_mean(values.tolist(), 4000, np.random.default_rng(1))
    assert found is not None
    half = 1.96 * values.std() / np.sqrt(len(values))  # of the normal distribution
    assert found == pytest.approx((values.mean() - half, values.mean() + half), abs=0.1 * half)
    assert interval_of_mean([0.05], 4000, np.random.default_rng(1)) is None
