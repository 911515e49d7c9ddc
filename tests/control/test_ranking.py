"""The value by which candidates are ranked."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.control.ranking import Predict, join_predictions

CLOUD, SEEN = np.zeros((3, 2, 2, 3)), np.ones((3, 2, 2), dtype=bool)
NETWORK, ANALYTIC = np.array([0.1, 0.5, 0.9]), np.array([0.3, 0.2, 1.0])


def told(values: np.ndarray) -> Predict:
    """A prediction that says the same of whatever it is given."""
    return lambda cloud, seen: values


@given(st.floats(0.0, 1.0))
def test_joined_q_hat_is_the_weighted_mean(share: float) -> None:
    joined = join_predictions(told(NETWORK), told(ANALYTIC), share)
    expected = (1 - share) * NETWORK + share * ANALYTIC
    assert joined(CLOUD, SEEN) == pytest.approx(expected, abs=1e-12)
