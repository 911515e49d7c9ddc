"""The exported network is the network."""

from pathlib import Path

import pytest

import pipeline
from pipeline.config.learning import NetworkConfig
from pipeline.errors import ArtifactError
from pipeline.network.export import OnnxPredictor, checked_against, export_onnx_bytes
from pipeline.network.ga_cnn import GaCnn, build_network
from tests.network.planes import planes_with_holes
from tests.network.test_inference import lively

SAMPLES = planes_with_holes(30, seed=0)
CONFIG = NetworkConfig(layers=18, channels=(16, 16, 32, 32))


@pytest.fixture(scope="module")
def network() -> GaCnn:
    return lively(build_network(CONFIG, seed=0))


@pytest.fixture(scope="module")
def data(network: GaCnn) -> bytes:
    return export_onnx_bytes(network)


@pytest.mark.parametrize("batch_size", [1, 7, 64])
def test_export_predicts_what_the_network_predicts(
    network: GaCnn, data: bytes, batch_size: int
) -> None:
    predictor = OnnxPredictor(data, threads=1)
    difference = checked_against(predictor, network, SAMPLES.cloud, SAMPLES.mask, batch_size, 1)
    assert difference <= 1e-4


def test_export_of_another_network_is_told_apart(data: bytes) -> None:
    other = lively(build_network(CONFIG, seed=9))
    with pytest.raises(ArtifactError, match="differs from its original"):
        checked_against(OnnxPredictor(data, 1), other, SAMPLES.cloud, SAMPLES.mask, 30, 1)


def test_equal_networks_export_equal_bytes_without_a_word_of_the_machine(
    network: GaCnn, data: bytes
) -> None:
    assert export_onnx_bytes(network) == data
    assert str(Path(pipeline.__path__[0]).parent).encode() not in data
    assert b"ga_cnn.py" not in data


def test_bytes_that_are_no_export_are_refused(data: bytes) -> None:
    for bad in (b"", b"not a network at all", data[: len(data) // 2]):
        with pytest.raises(ArtifactError):
            OnnxPredictor(bad, threads=1)
