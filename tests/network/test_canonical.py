"""The input is invariant where the label is, and augmentation is what turning a cloud does."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.network.canonical import (
    apply_symmetry,
    inverse_symmetry,
    network_input,
    reference_height,
    turn_batch,
)
from pipeline.network.input_channels import CHANNELS, CHANNELS_0_1, KNOWN_CHANNELS, SYMMETRIES
from tests.network.planes import CELLS, HALF_SIDE, grid_xy

seeds = st.integers(0, 2**32 - 1)


def scattered_points(seed: int) -> np.ndarray:
    """One point somewhere in each of some cells, with an unrelated height; (n, 3)."""
    rng = np.random.default_rng(seed)
    x, y = grid_xy()
    step = 2 * HALF_SIDE / CELLS
    points = np.stack((x, y, rng.normal(0, 0.5, x.shape)), axis=-1)
    points[..., :2] += rng.uniform(-0.4 * step, 0.4 * step, (CELLS, CELLS, 2))
    return points[rng.random((CELLS, CELLS)) < 0.7].astype(np.float32)


def organised(points: np.ndarray) -> tuple[torch.Tensor, torch.Tensor]:
    """Points sorted into the cells they lie in: what sensing does, written independently."""
    step = 2 * HALF_SIDE / CELLS
    cloud = np.full((1, CELLS, CELLS, 3), np.nan, dtype=np.float32)
    mask = np.zeros((1, CELLS, CELLS), dtype=np.bool_)
    for point in points:
        column, row = np.floor((point[:2] + HALF_SIDE) / step).astype(int)
        cloud[0, row, column] = point
        mask[0, row, column] = True
    return torch.from_numpy(cloud), torch.from_numpy(mask)


def moved(points: np.ndarray, element: int) -> np.ndarray:
    """The points mirrored (x becomes -x) for elements from 4 on, then turned about z."""
    result = points.copy()
    if element >= 4:
        result[:, 0] *= -1
    for _ in range(element % 4):
        result[:, :2] = np.stack((-result[:, 1], result[:, 0]), axis=1)
    return result


@pytest.mark.parametrize("element", range(SYMMETRIES))
def test_augmentation_equals_the_input_of_the_moved_cloud(element: int) -> None:
    points = scattered_points(seed=element)
    augmented = apply_symmetry(network_input(*organised(points)), torch.tensor([element]))
    expected = network_input(*organised(moved(points, element)))
    assert torch.equal(augmented, expected)


def test_the_eight_elements_are_eight() -> None:
    inputs = network_input(*organised(scattered_points(seed=0))).expand(SYMMETRIES, -1, -1, -1)
    turned = apply_symmetry(inputs, torch.arange(SYMMETRIES))
    assert len({tensor.numpy().tobytes() for tensor in turned}) == SYMMETRIES
    assert torch.equal(turned[0], inputs[0])


@pytest.mark.parametrize("channels", KNOWN_CHANNELS)
@pytest.mark.parametrize("element", range(SYMMETRIES))
def test_a_whole_batch_turns_as_each_of_it_and_lies_channels_last(
    element: int, channels: tuple[str, ...]
) -> None:
    batch = torch.cat(
        [network_input(*organised(scattered_points(seed)), channels) for seed in range(3)]
    )
    turned = turn_batch(batch, element, channels)
    assert torch.equal(turned, apply_symmetry(batch, torch.full((3,), element), channels))
    assert turned.is_contiguous(memory_format=torch.channels_last)


@settings(max_examples=25, deadline=None)
@given(seed=seeds, element=st.integers(0, SYMMETRIES - 1))
def test_an_element_then_its_inverse_is_the_identity(seed: int, element: int) -> None:
    inputs = network_input(*organised(scattered_points(seed)))
    elements = torch.tensor([element])
    back = apply_symmetry(apply_symmetry(inputs, elements), inverse_symmetry(elements))
    assert torch.equal(back, inputs)


@settings(max_examples=25, deadline=None)
@given(seed=seeds, shift_quarters=st.integers(-40, 40))
def test_moving_along_the_approach_axis_changes_nothing(seed: int, shift_quarters: int) -> None:
    points = scattered_points(seed)
    # Heights and shifts of few bits add without rounding, so equality is exact.
    points[:, 2] = np.round(points[:, 2] * 256) / 256
    shifted = points + np.array([0, 0, shift_quarters / 4], dtype=np.float32)
    assert torch.equal(network_input(*organised(points)), network_input(*organised(shifted)))


@settings(max_examples=25, deadline=None)
@given(seed=seeds)
def test_channels_are_bounded_and_zero_where_unseen(seed: int) -> None:
    cloud, mask = organised(scattered_points(seed) * np.array([1, 1, 50], dtype=np.float32))
    inputs = network_input(cloud, mask)[0]
    assert bool(torch.isfinite(inputs).all())
    assert bool((inputs[:, ~mask[0]] == 0).all())
    assert float(inputs[CHANNELS.index("z")].abs().max()) <= 1.2 + 1e-6
    assert float(inputs[CHANNELS.index("z_fine")].abs().max()) <= 1
    assert torch.equal(inputs[CHANNELS.index("x")][mask[0]], cloud[0, ..., 0][mask[0]])


def test_reference_is_the_median_of_the_middle_and_outliers_do_not_move_it() -> None:
    z = torch.full((1, CELLS, CELLS), 0.25)
    mask = torch.ones(1, CELLS, CELLS, dtype=torch.bool)
    z[:, :8] = 7.0  # outside the middle third
    z[:, 9:12, 9:12] = -3.0  # nine of its 64 cells
    assert float(reference_height(z, mask)) == 0.25


def test_reference_without_a_seen_middle_falls_back_to_all_then_to_zero() -> None:
    z = torch.full((2, CELLS, CELLS), 0.5)
    mask = torch.zeros(2, CELLS, CELLS, dtype=torch.bool)
    mask[0, 0, 0] = True
    assert reference_height(z, mask).tolist() == [0.5, 0.0]


def test_in_its_cell_a_point_is_told_to_a_border_of_one() -> None:
    step = 2 * HALF_SIDE / CELLS
    x, y = grid_xy()
    points = np.stack((x + 0.25 * step, y - 0.5 * step + 1e-4, 0 * x), axis=-1).reshape(-1, 3)
    inputs = network_input(*organised(points.astype(np.float32)))[0]
    in_cell = inputs[[CHANNELS.index("x_in_cell"), CHANNELS.index("y_in_cell")]]
    torch.testing.assert_close(in_cell[0], torch.full_like(in_cell[0], 0.5), atol=1e-4, rtol=0)
    torch.testing.assert_close(in_cell[1], torch.full_like(in_cell[1], -0.998), atol=1e-4, rtol=0)


def test_what_lies_beyond_the_pad_holds_it_up_no_more() -> None:
    x, y = grid_xy()
    for distance, held in ((0.9, True), (1.15, False)):
        z = np.where(np.hypot(x - distance, y) < 0.08, 1.25, 0.0)
        points = np.stack((x, y, z), axis=-1).reshape(-1, 3).astype(np.float32)
        inputs = network_input(*organised(points))[0]
        contact = inputs[CHANNELS.index("pad_contact")].bool()
        assert bool(contact[np.hypot(x, y) > 1.0].any()) is False
        assert bool(contact[np.hypot(x, y) < 0.5].all()) is not held
        old = network_input(*organised(points), channels=CHANNELS_0_1)[0]
        assert not bool(old[CHANNELS_0_1.index("contact")][np.hypot(x, y) < 0.1].any())


@pytest.mark.parametrize("channels", KNOWN_CHANNELS)
def test_every_known_set_of_channels_turns_with_the_cloud(channels: tuple[str, ...]) -> None:
    points = scattered_points(seed=5)
    augmented = apply_symmetry(
        network_input(*organised(points), channels), torch.tensor([6]), channels
    )
    assert torch.equal(augmented, network_input(*organised(moved(points, 6)), channels))
