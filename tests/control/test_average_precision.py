"""Average precision: analytic cases, and a plain implementation of SuctionNet's that owes nothing.

`plainly` follows the definition step by step, in lists and loops.
"""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.config.evaluation import PrecisionConfig
from pipeline.control.average_precision import (
    AveragePrecision,
    average_precision,
    mean_over_scenes,
    precision_by_rank,
    suppress_near,
)

CONFIG = PrecisionConfig()


def apart(count: int) -> np.ndarray:
    """Contacts on a line, a decimetre apart: none suppresses another."""
    return np.column_stack([0.1 * np.arange(count), np.zeros(count), np.zeros(count)])


def plainly(
    places: list[tuple[float, float, float]],
    objects: list[int],
    values: list[float],
    qualities: list[float],
    threshold: float,
) -> Fraction:
    """AP_s of one scene by the definition."""
    left = sorted(range(len(values)), key=lambda i: (-values[i], i))
    kept: list[int] = []
    while left:
        best = left.pop(0)
        kept.append(best)
        left = [i for i in left if math.dist(places[i], places[best]) >= CONFIG.apart_m]
    of_object: dict[int, int] = {}
    ranked = []
    for i in kept:
        of_object[objects[i]] = of_object.get(objects[i], 0) + 1
        if of_object[objects[i]] <= 10:
            ranked.append(qualities[i])
    ranked = ranked[:50]
    total = Fraction(0)
    for k in range(1, 51):
        good = sum(1 for q in ranked[:k] if q >= threshold)
        total += Fraction(good, k)
    return total / 50


def test_fifty_good_contacts_are_perfect_in_any_order() -> None:
    objects, quality = np.arange(60) // 6, np.full(60, 0.9)
    found = average_precision(apart(60), objects, np.zeros(60), quality, CONFIG)
    assert found.by_threshold == {0.2: 1.0, 0.4: 1.0, 0.6: 1.0, 0.8: 1.0}
    assert (found.mean, found.judged) == (1.0, 50)


def test_a_perfect_ranking_of_half_good_contacts() -> None:
    """Precision is 1 up to k = 25, and 25 / k beyond."""
    objects = np.arange(50)
    quality = np.where(np.arange(50) < 25, 0.5, 0.1)
    expected = (25 + sum(25 / k for k in range(26, 51))) / 50
    found = average_precision(apart(50), objects, quality, quality, CONFIG)
    assert found.by_threshold[0.2] == pytest.approx(expected)
    assert found.by_threshold[0.4] == pytest.approx(expected)
    assert found.by_threshold[0.6] == 0.0
    assert found.mean == pytest.approx(expected / 2)
    reverse = average_precision(apart(50), objects, -quality, quality, CONFIG)
    assert reverse.by_threshold[0.2] == pytest.approx(sum((k - 25) / k for k in range(26, 51)) / 50)


def test_where_all_are_bad_it_is_none() -> None:
    found = average_precision(apart(50), np.arange(50), np.ones(50), np.full(50, 0.01), CONFIG)
    assert found.mean == 0.0


def test_contacts_that_are_missing_count_as_bad() -> None:
    """Of one good contact precision at k is 1 / k."""
    one = average_precision(apart(1), np.zeros(1, dtype=int), np.ones(1), np.ones(1), CONFIG)
    assert one.by_threshold[0.8] == pytest.approx(sum(1 / k for k in range(1, 51)) / 50)
    none = average_precision(
        np.empty((0, 3)), np.empty(0, dtype=int), np.empty(0), np.empty(0), CONFIG
    )
    assert (none.mean, none.judged) == (0.0, 0)


def test_of_one_object_ten_are_judged() -> None:
    same = average_precision(apart(50), np.zeros(50, dtype=int), np.ones(50), np.ones(50), CONFIG)
    assert same.judged == 10
    assert same.mean == pytest.approx((10 + sum(10 / k for k in range(11, 51))) / 50)


def test_the_better_of_two_near_contacts_is_kept_and_does_not_reach_beyond_two_centimetres() -> (
    None
):
    places = np.array([[0.0, 0, 0], [0.019, 0, 0], [0.038, 0, 0], [0.019, 0, 0.0201]])
    value = np.array([0.5, 0.9, 0.7, 0.1])
    assert suppress_near(places, value, 0.02).tolist() == [1, 3]
    assert suppress_near(places, np.array([0.9, 0.5, 0.7, 0.1]), 0.02).tolist() == [0, 2, 3]
    assert suppress_near(places[:2], np.zeros(2), 0.019).tolist() == [0, 1]


def test_precision_by_rank_by_hand() -> None:
    found = precision_by_rank(np.array([True, False, True]), top=4)
    assert found == pytest.approx([1, 1 / 2, 2 / 3, 2 / 4])


def test_scenes_count_alike() -> None:
    mean = mean_over_scenes([AveragePrecision({0.2: 1.0}, 50), AveragePrecision({0.2: 0.5}, 10)])
    assert mean == AveragePrecision({0.2: 0.75}, 30)


# Off whole centimetres: no rounding of a distance of 2 cm decides what is near.
coordinate = st.integers(0, 12).map(lambda n: n / 99)
contact = st.tuples(
    st.tuples(coordinate, coordinate, coordinate),
    st.integers(0, 2),
    st.integers(0, 4).map(lambda n: n / 4),
    st.integers(0, 20).map(lambda n: n / 20),
)


@given(st.lists(contact, min_size=1, max_size=60))
def test_it_is_what_the_definition_says(
    contacts: list[tuple[tuple[float, float, float], int, float, float]],
) -> None:
    places, objects, values, qualities = map(list, zip(*contacts, strict=True))
    found = average_precision(
        np.array(places), np.array(objects), np.array(values), np.array(qualities), CONFIG
    )
    for threshold, value in found.by_threshold.items():
        assert value == pytest.approx(
            float(plainly(places, objects, values, qualities, threshold)), abs=1e-12
        )
