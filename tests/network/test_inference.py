"""Predictions do not depend on how they are batched, and averaging is invariant."""

import numpy as np
import pytest
import torch

from pipeline.config.learning import NetworkConfig
from pipeline.network.canonical import network_input
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.inference import predict
from tests.network.planes import planes_with_holes

SAMPLES = planes_with_holes(40, seed=0)


@pytest.fixture(scope="module")
def network() -> GaCnn:
    return lively(build_network(NetworkConfig(layers=18, channels=(16, 16, 32, 32)), seed=0))


def lively(network: GaCnn) -> GaCnn:
    """The network as a training might leave it: norms fitted, every branch and cell matters."""
    generator = torch.Generator().manual_seed(0)
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            torch.nn.init.uniform_(module.weight, 0.5, 1.5, generator=generator)
            torch.nn.init.uniform_(module.bias, -0.2, 0.2, generator=generator)
            module.momentum = 1.0  # running statistics become those of the one batch below
    inputs = network_input(torch.from_numpy(SAMPLES.cloud), torch.from_numpy(SAMPLES.mask))
    with torch.no_grad():
        network.train()(inputs)
        for parameter in network.head.parameters():
            parameter.mul_(3.0)
    return network.eval()


def test_batches_do_not_change_predictions(network: GaCnn) -> None:
    whole = predict(network, SAMPLES.cloud, SAMPLES.mask, 40, 1, False)
    parts = predict(network, SAMPLES.cloud, SAMPLES.mask, 7, 1, False)
    assert whole.dtype == np.float32
    assert np.ptp(whole) > 1e-3
    assert parts == pytest.approx(whole, abs=1e-5)


def test_average_over_symmetries_is_the_same_for_a_mirrored_cloud(network: GaCnn) -> None:
    cloud = SAMPLES.cloud[:, :, ::-1] * np.array([-1, 1, 1], dtype=np.float16)
    mask = np.ascontiguousarray(SAMPLES.mask[:, :, ::-1])
    straight = predict(network, SAMPLES.cloud, SAMPLES.mask, 16, 1, True)
    mirrored = predict(network, cloud, mask, 16, 1, True)
    assert mirrored == pytest.approx(straight, abs=1e-5)
    single = predict(network, SAMPLES.cloud, SAMPLES.mask, 16, 1, False)
    assert np.abs(single - predict(network, cloud, mask, 16, 1, False)).max() > 1e-4


def test_threads_and_determinism_are_left_as_found(network: GaCnn) -> None:
    before = torch.get_num_threads()
    predict(network, SAMPLES.cloud[:2], SAMPLES.mask[:2], 2, before + 1, False)
    assert torch.get_num_threads() == before
    assert not torch.are_deterministic_algorithms_enabled()
