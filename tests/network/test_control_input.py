"""The compiled input of control is that of the tensors."""

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.network.canonical import network_input
from pipeline.network.control_input import control_input
from pipeline.network.input_channels import CHANNELS
from tests.network.planes import grid_xy, planes_with_holes


def assert_as_tensors(cloud: np.ndarray, mask: np.ndarray) -> None:
    expected = network_input(torch.from_numpy(cloud), torch.from_numpy(mask)).numpy()
    found = control_input(cloud, mask)
    assert found.dtype == expected.dtype
    for name, channel, wanted in zip(
        CHANNELS, found.swapaxes(0, 1), expected.swapaxes(0, 1), strict=True
    ):
        # Products and their sum may be rounded once or twice, as the processor can.
        last_bit = 2e-7 if name == "radius" else 0.0
        np.testing.assert_allclose(channel, wanted, rtol=last_bit, atol=0, err_msg=name)


@settings(deadline=None)  # the first call compiles
@given(
    seed=st.integers(0, 2**32 - 1),
    rough=st.sampled_from([0.0, 1e-3, 0.1, 3.0]),
    seen=st.sampled_from([0.0, 0.002, 0.3, 0.9, 1.0]),
)
def test_it_is_that_of_the_tensors(seed: int, rough: float, seen: float) -> None:
    """Walls six radii high, holes, empty middles, nothing at all; rubbish where nothing is seen."""
    rng = np.random.default_rng(seed)
    x, y = grid_xy()
    cloud = np.empty((3, *x.shape, 3), dtype=np.float32)
    cloud[..., 0] = x + rng.uniform(-0.05, 0.05, x.shape)
    cloud[..., 1] = y + rng.uniform(-0.05, 0.05, x.shape)
    cloud[..., 2] = rng.uniform(-1.0, 6.0, (3, 1, 1)) + rough * rng.standard_normal(x.shape)
    cloud[1, :, 14:, 2] += rng.uniform(0.0, 6.0)
    mask = rng.random((3, *x.shape)) < seen
    mask[2, 8:16, 8:16] = False
    cloud[~mask] = rng.choice([np.nan, np.inf, 7.0])
    assert_as_tensors(cloud, mask)


def test_samples_of_half_precision_are_read_alike() -> None:
    samples = planes_with_holes(20, seed=1)
    assert_as_tensors(samples.cloud, samples.mask)


def test_no_clouds_have_no_input() -> None:
    samples = planes_with_holes(1, seed=1)
    assert control_input(samples.cloud[:0], samples.mask[:0]).shape == (0, len(CHANNELS), 24, 24)
