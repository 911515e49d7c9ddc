"""Points are joined by distance: no grid parts neighbours."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.geometry.welding import weld


def test_neighbours_on_two_sides_of_any_cell_are_joined() -> None:
    """Pairs a third of the tolerance apart, at every place within a cell of a grid."""
    centres = np.linspace(0, 1, 1001)[:, None] * np.ones(3) + np.arange(1001)[:, None] * 10
    pairs = np.concatenate([centres, centres + 0.01])
    first, group = weld(pairs, tolerance=0.03)
    np.testing.assert_array_equal(first, np.arange(1001))
    np.testing.assert_array_equal(group, np.tile(np.arange(1001), 2))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(*[st.integers(-3, 3)] * 3), min_size=1, max_size=60))
def test_equal_points_are_joined_and_others_are_not(rows: list[tuple[int, int, int]]) -> None:
    points = np.array(rows, dtype=np.float64)
    first, group = weld(points, tolerance=0.0)
    seen: dict[tuple[int, int, int], int] = {}
    expected = [seen.setdefault(row, len(seen)) for row in rows]
    assert group.tolist() == expected
    np.testing.assert_array_equal(points[first], points[first][np.unique(expected)])
    np.testing.assert_array_equal(points[first][group], points)


def test_a_chain_is_one_and_a_crowd_is_bounded() -> None:
    chain = np.arange(50)[:, None] * np.array([0.9, 0, 0])
    crowd = np.random.default_rng(0).uniform(0, 0.1, (3000, 3)) + 1000
    first, group = weld(np.concatenate([chain, crowd]), tolerance=1.0)
    assert first.tolist() == [0, 50]
    assert set(group[:50].tolist()) == {0}
    assert set(group[50:].tolist()) == {1}


def test_points_of_equal_sums_are_told_apart() -> None:
    """What the sort is by may be the same for different points."""
    points = np.array([[np.sqrt(2.0), 0, 0], [0, 1, 0], [np.sqrt(2.0), 0, 0], [0, 1, 0]])
    _, group = weld(points, tolerance=0.0)
    assert group.tolist() == [0, 1, 0, 1]


def test_no_points() -> None:
    first, group = weld(np.zeros((0, 3)), tolerance=1.0)
    assert len(first) == len(group) == 0
