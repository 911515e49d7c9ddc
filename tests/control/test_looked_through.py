"""What has moved is looked through; what comes into view or is hidden is not held against it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.control.cloud import DepthPicture
from pipeline.control.looked_through import looked_through
from tests.control.fakes import picture_of

EYE = np.array([0.12, 0.05, 0.4])
MIDDLE = np.array([0.0, 0.0, 0.03])
SIDE_M = 0.08
STEPS_M = np.arange(-0.1, 0.1, 8e-4)


def block(shift_m: float = 0.0) -> np.ndarray:
    """The top of a block on a table, and the table around it."""
    x, y = np.meshgrid(STEPS_M, STEPS_M)
    on_top = (np.abs(x - shift_m) < SIDE_M / 2) & (np.abs(y) < SIDE_M / 2)
    return np.column_stack([x.ravel(), y.ravel(), np.where(on_top, 0.03, 0.0).ravel()])


def top_of(points: np.ndarray) -> np.ndarray:
    return points[points[:, 2] > 0.02][::3]


STILL = picture_of(block(), EYE, MIDDLE)


def test_what_stands_still_is_not_looked_through() -> None:
    assert looked_through(top_of(block()), STILL) < 0.01


@pytest.mark.parametrize("shift_m", [0.02, -0.02, 0.04])
def test_the_share_is_what_the_shift_laid_bare(shift_m: float) -> None:
    """An edge is known to 4 mm only; what lies nearer to it than that is not counted."""
    share = looked_through(top_of(block()), picture_of(block(shift_m), EYE, MIDDLE))
    bare = (abs(shift_m) - 0.004) / SIDE_M
    assert share == pytest.approx(bare, abs=0.03)


def test_what_comes_into_view_or_is_hidden_says_nothing() -> None:
    tower = block() + np.array([0.0, 0.0, 0.05])
    grown = np.concatenate([block(), tower[tower[:, 0] > 0.01]])
    assert looked_through(top_of(block()), picture_of(grown, EYE, MIDDLE)) < 0.01


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_noise_and_lost_pixels_move_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    depth = STILL.depth_m + rng.normal(0.0, 0.001, STILL.depth_m.shape)
    depth[rng.random(depth.shape) < 0.3] = rng.choice([0.0, np.nan])
    assert looked_through(top_of(block()), DepthPicture(depth, STILL.camera)) < 0.03


def test_without_points_or_without_depth_nothing_is_known() -> None:
    blind = DepthPicture(np.full_like(STILL.depth_m, np.nan), STILL.camera)
    assert looked_through(np.empty((0, 3)), STILL) == 0.0
    assert looked_through(top_of(block()), blind) == 0.0
    behind = top_of(block()) + np.array([0.0, 0.0, 5.0])
    assert looked_through(behind, STILL) == 0.0
