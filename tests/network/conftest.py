"""A small network with something to say, and its export; some modules have others of their own."""

import pytest

from pipeline.config.learning import NetworkConfig
from pipeline.network.export import export_onnx_bytes
from pipeline.network.ga_cnn import GaCnn, build_network
from tests.network.test_inference import lively

CONFIG = NetworkConfig(layers=18, channels=(16, 16, 32, 32))


@pytest.fixture(scope="module")
def network() -> GaCnn:
    return lively(build_network(CONFIG, seed=0))


@pytest.fixture(scope="module")
def data(network: GaCnn) -> bytes:
    return export_onnx_bytes(network, cells=24)
