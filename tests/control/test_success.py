"""Success rates carry Wilson's interval."""

import pytest

from pipeline.control.success import Outcome, advantage, bootstrap_interval, success_rate


def test_wilson_interval_of_eight_in_ten() -> None:
    """Closed form: (p + z²/2n ± z sqrt(p(1-p)/n + z²/4n²)) / (1 + z²/n), z = 1.959964."""
    assert success_rate(8, 10) == pytest.approx((0.8, 0.490162, 0.943318), abs=1e-5)


def test_without_attempts_the_interval_is_all_of_0_to_1() -> None:
    assert success_rate(0, 0) == (0.0, 0.0, 1.0)


def test_attempts_at_one_clutter_and_object_are_not_independent() -> None:
    """Ten attempts that are alike within a clutter say as much as the clutters do."""
    lifted = [True] * 30 + [False] * 10
    each = [str(number) for number in range(40)]
    apart = bootstrap_interval(lifted, each, [""] * 40)
    wilson = success_rate(30, 40)[1:]
    assert apart == pytest.approx(wilson, abs=0.03)
    four = [str(number // 10) for number in range(40)]
    by_clutter = bootstrap_interval(lifted, four, [""] * 40)
    by_object = bootstrap_interval(lifted, each, four)
    for low, high in (by_clutter, by_object):
        assert high - low > 2 * (apart[1] - apart[0])
    assert bootstrap_interval(lifted, four, four) == bootstrap_interval(lifted, four, four)
    assert bootstrap_interval([], [], []) == (0.0, 1.0)
    assert bootstrap_interval([True], ["a"], ["b"]) == (1.0, 1.0)


def test_a_policy_that_is_always_better_is_significantly_so() -> None:
    """Eight clutters, each won: of 2^8 exchanges two are as extreme, so p = 2 / 256."""
    ours = [Outcome(9, 10)] * 8
    theirs = [Outcome(3 + i % 3, 10) for i in range(8)]
    found = advantage(ours, theirs)
    assert found.p_paired == pytest.approx(2 / 256)
    assert found.rate == pytest.approx(0.9)
    assert found.p_fisher < 1e-6


def test_equal_policies_do_not_differ() -> None:
    same = [Outcome(5, 10), Outcome(0, 0)]
    found = advantage(same, same)
    assert (found.p_paired, found.p_fisher) == (1.0, 1.0)
