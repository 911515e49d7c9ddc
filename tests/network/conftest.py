"""A small network with something to say, and its export; some modules have others of their own."""

import pytest

from pipeline.config.learning import NetworkConfig, TrainConfig
from pipeline.network.export import export_onnx_bytes
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.samples import GraspTensors
from pipeline.network.training import train
from pipeline.network.training_figures import EpochMetrics
from tests.network.planes import planes_with_holes
from tests.network.test_inference import lively

CONFIG = NetworkConfig(layers=18, channels=(16, 16, 32, 32))
TAUGHT = NetworkConfig(layers=18, channels=(8, 8, 16, 32))
TEACHING = TrainConfig(epochs=3, batch_size=64, learning_rate=4e-3, threads=1, device="cpu")


def ignored(metrics: EpochMetrics) -> None:
    assert metrics.samples > 0


@pytest.fixture(scope="module")
def network() -> GaCnn:
    return lively(build_network(CONFIG, seed=0))


@pytest.fixture(scope="module")
def data(network: GaCnn) -> bytes:
    return export_onnx_bytes(network, cells=24)


@pytest.fixture(scope="module")
def known() -> GraspTensors:
    return planes_with_holes(200, seed=1)


@pytest.fixture(scope="module")
def taught_planes(known: GraspTensors, tmp_path_factory: pytest.TempPathFactory) -> GaCnn:
    """A network that has learned planes with holes."""
    learned, state = planes_with_holes(600, seed=2), tmp_path_factory.mktemp("taught")
    return train(TEACHING, TAUGHT, 1, learned, known, state, ignored).network
