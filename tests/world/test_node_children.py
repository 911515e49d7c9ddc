"""A node's children in the order in which they are walked."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pipeline.world.node_children import rank_by_top
from pipeline.world.point_cells import cells_of
from pipeline.world.triangle_blocks import LANES

CORNERS = cells_of(np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]))
SIDE = len(CORNERS.rows)
HEIGHTS = st.floats(-1e3, 1e3, width=32)


@given(
    tops=st.lists(HEIGHTS, min_size=1, max_size=LANES),
    under=st.floats(-1e3, 1e3, width=32),
    over_points=st.lists(st.booleans(), min_size=LANES, max_size=LANES),
)
def test_children_over_points_come_first_and_the_highest_of_them_last(
    tops: list[float], under: float, over_points: list[bool]
) -> None:
    children = len(tops)
    low_high = np.full(2 * LANES, -np.inf, dtype=np.float32)
    low_high[:children] = np.array(tops) - 1.0
    low_high[LANES : LANES + children] = tops
    # Either all cells, which hold the four points, or none.
    cells = np.zeros(4 * LANES, dtype=np.int32)
    cells[LANES : 2 * LANES] = cells[3 * LANES :] = np.where(over_points, SIDE, 0)
    keys, rank = np.empty(LANES, dtype=np.int32), np.empty(LANES, dtype=np.int32)
    kept = rank_by_top(under, CORNERS.within, cells, low_high, children, keys, rank)

    wanted = [k for k in range(children) if over_points[k] and low_high[k] <= under]
    assert kept == len(wanted)
    assert sorted(rank) == list(range(LANES))
    assert {int(rank[k]) for k in wanted} == set(range(kept))
    in_order = np.array(sorted(wanted, key=lambda k: rank[k]), dtype=np.int64)
    heights = np.array(tops, dtype=np.float32)[in_order].astype(np.float64)
    # The last four bits of a height in single precision are not compared.
    assert np.all(np.diff(heights) >= -(2.0**-19) * np.maximum(np.abs(heights[1:]), 1e-30))
