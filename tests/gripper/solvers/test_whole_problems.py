"""Sums add in NumPy's order, to the last bit; what is formed and written is what NumPy gives."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pipeline.gripper.problem import GraspStatus
from pipeline.gripper.solvers.whole_problems import form_into, pairwise_sum, write_into

SPREAD = 0.37


@given(st.integers(0, 1100), st.integers(0, 2**32))
def test_sums_have_the_bits_of_numpy(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=count) * 10.0 ** rng.integers(-8, 8, count)
    assert pairwise_sum(values) == values.sum()
    assert pairwise_sum(values) == values.reshape(1, 1, -1).sum(axis=2)[0, 0]


@given(st.integers(0, 2**32))
def test_problems_are_formed_as_numpy_forms_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    counts = rng.integers(1, 300, 5)
    matrices, forces = rng.normal(size=(5, 4, 300)), rng.uniform(0.1, 2.0, 5)
    chosen = np.flatnonzero(rng.random(5) < 0.6)
    rows, centres = np.full((len(chosen), 4, 300), np.nan), np.empty((len(chosen), 4))
    form_into(matrices, counts, forces, SPREAD, chosen, rows, centres)
    for at, i in enumerate(chosen):
        of_all = matrices[i : i + 1, :, : counts[i]] / forces[i]
        expected = SPREAD * (of_all - of_all.mean(axis=2, keepdims=True))
        np.testing.assert_array_equal(rows[at, :, : counts[i]], expected[0])
        np.testing.assert_array_equal(centres[at], of_all.sum(axis=2)[0])
        assert np.isnan(rows[at, :, counts[i] :]).all()


def test_weights_are_written_for_the_chosen_problems_alone() -> None:
    rng = np.random.default_rng(0)
    counts, status = np.array([3, 4, 2]), np.array([0, 0, int(GraspStatus.INFEASIBLE)])
    found, weights = rng.uniform(-1, 1, (2, 4)), np.full((3, 5), np.nan)
    write_into(np.array([1, 2]), counts, SPREAD, found, status, weights)
    np.testing.assert_array_equal(weights[1, :4], 1.0 + SPREAD * found[0])
    np.testing.assert_array_equal(weights[2, :2], [1.0, 1.0])
    assert np.isnan(weights[0]).all()
    assert np.isnan(weights[1:, 4]).all()
