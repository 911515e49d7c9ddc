"""The pad on the measured grid: its definition, planes, steps, and the pad of the label."""

import math

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.config.grasps import CELL_SIDE, PadConfig
from pipeline.gripper.draping import drape
from pipeline.gripper.pad import build_pad
from pipeline.network.input_channels import REACH
from pipeline.network.measured_drape import draped_gap
from tests.network.planes import CELLS, grid_xy

EVERYWHERE = torch.ones(1, CELLS, CELLS, dtype=torch.bool)


def gap_as_defined(z: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """From all pairs of cells, by octile distance."""
    rows, columns = np.indices(z.shape)
    gap = np.zeros(z.shape)
    for i, j in np.argwhere(seen):
        across, down = np.abs(rows - i), np.abs(columns - j)
        distance = np.maximum(across, down) + (math.sqrt(2) - 1) * np.minimum(across, down)
        reached = np.where(seen, z, -np.inf) - CELL_SIDE * distance
        gap[i, j] = min(reached.max() - z[i, j], REACH)
    return gap


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_gap_is_that_of_the_definition(seed: int) -> None:
    rng = np.random.default_rng(seed)
    z = rng.normal(0, rng.choice([0.05, 0.2]), (CELLS, CELLS)).astype(np.float32)
    seen = rng.random((CELLS, CELLS)) < 0.8
    found = draped_gap(torch.from_numpy(z)[None], torch.from_numpy(seen)[None])[0].numpy()
    np.testing.assert_allclose(found, gap_as_defined(z, seen), atol=2e-5)


def test_the_pad_lies_on_any_slope_it_can_follow_and_on_no_steeper_one() -> None:
    x, _ = grid_xy()
    for slope, lies in ((0.0, True), (0.9, True), (-0.9, True), (1.5, False)):
        z = torch.from_numpy((slope * x).astype(np.float32))[None]
        gap = draped_gap(z, EVERYWHERE)[0]
        # The highest column is touched whatever the slope.
        assert bool((gap[:, 1:-1] < 1e-5).all()) is lies


def test_over_a_step_the_pad_comes_down_as_far_as_it_goes_sideways() -> None:
    x, _ = grid_xy()
    z = torch.from_numpy(np.where(x < 0, 0.0, -0.55).astype(np.float32))[None]
    gap = draped_gap(z, EVERYWHERE)[0, CELLS // 2]
    beyond = 0.55 - CELL_SIDE * np.arange(1, CELLS // 2 + 1)
    np.testing.assert_allclose(gap[CELLS // 2 :].numpy(), np.maximum(beyond, 0.0), atol=1e-5)


def test_what_is_not_seen_holds_nothing_up_and_has_no_gap() -> None:
    z = torch.zeros(1, CELLS, CELLS)
    z[0, 5, 5] = 1.0
    seen = EVERYWHERE.clone()
    seen[0, 5, 5] = False
    assert not draped_gap(z, seen).any()
    assert not draped_gap(z, ~EVERYWHERE).any()


def test_contact_share_follows_that_of_the_pad_itself() -> None:
    """Bumps under both pads: the share of Reg.V in contact agrees within the grids' coarseness."""
    config = PadConfig()
    pad = build_pad(config)
    x, y = grid_xy()
    in_seal = np.hypot(x, y) <= config.seal_radius_m / config.radius_m
    on_pad = pad.vertices_xy_m / config.radius_m
    weight = np.hypot(*on_pad.T)  # vertices of a polar grid lie denser towards its middle
    inside = weight <= config.seal_radius_m / config.radius_m + 1e-9
    rng = np.random.default_rng(5)
    shares = []
    for _ in range(40):
        centre, height, width = rng.uniform(-1, 1, 2), rng.uniform(0, 0.6), rng.uniform(0.1, 0.4)

        def surface(
            px: np.ndarray,
            py: np.ndarray,
            at: np.ndarray = centre,
            rise: float = height,
            over: float = width,
        ) -> np.ndarray:
            return np.asarray(rise * np.exp(-(((px - at[0]) ** 2 + (py - at[1]) ** 2) / over**2)))

        z = torch.from_numpy(surface(x, y).astype(np.float32))[None]
        grid = float((draped_gap(z, EVERYWHERE)[0].numpy() <= 0.004)[in_seal].mean())
        heights = config.radius_m * surface(*on_pad.T)
        touching = drape(pad, heights[None])[0] - heights <= config.contact_tolerance_m
        shares.append((grid, float(np.average(touching[inside], weights=weight[inside]))))
    grid_share, pad_share = np.array(shares).T
    assert pad_share.std() > 0.05
    assert np.corrcoef(grid_share, pad_share)[0, 1] > 0.9
    assert np.abs(grid_share - pad_share).mean() < 0.05
