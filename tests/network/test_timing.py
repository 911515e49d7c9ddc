"""Times a grasp are medians of calls over the batch's size."""

import time

import numpy as np
import pytest

from pipeline.network.timing import milliseconds_a_grasp
from tests.network.planes import planes_with_holes

FEW = planes_with_holes(5, seed=0)


def test_each_batch_size_is_timed_at_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock that the test moves: a call takes four milliseconds, one of them a second."""
    sizes: list[int] = []
    now_s = 0.0

    def predict(cloud: np.ndarray, mask: np.ndarray) -> np.ndarray:
        nonlocal now_s
        assert len(cloud) == len(mask)
        sizes.append(len(cloud))
        now_s += 1.0 if len(sizes) == 2 else 0.004
        return np.zeros(len(cloud))

    monkeypatch.setattr(time, "perf_counter", lambda: now_s)
    figures = milliseconds_a_grasp(predict, FEW.cloud, FEW.mask, (1, 8), seconds=0.0)
    assert sizes == [1] * 4 + [8] * 4
    assert set(figures) == {"1", "8"}
    assert figures["1"] == pytest.approx(4.0)
    assert figures["8"] == pytest.approx(0.5)
