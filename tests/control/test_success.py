"""Success rates carry Wilson's interval."""

import pytest

from pipeline.control.success import success_rate


def test_wilson_interval_of_eight_in_ten() -> None:
    """Closed form: (p + z²/2n ± z sqrt(p(1-p)/n + z²/4n²)) / (1 + z²/n), z = 1.959964."""
    assert success_rate(8, 10) == pytest.approx((0.8, 0.490162, 0.943318), abs=1e-5)


def test_no_attempt_says_nothing() -> None:
    assert success_rate(0, 0) == (0.0, 0.0, 1.0)
