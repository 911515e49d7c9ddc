"""Checkpoints come back as they went, and anything else is refused with a reason."""

import pytest
import torch
from safetensors.torch import save

from pipeline.config.learning import NetworkConfig
from pipeline.errors import ArtifactError
from pipeline.network import checkpoint
from pipeline.network.checkpoint import load_checkpoint_bytes, save_checkpoint_bytes
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.input_channels import CHANNELS

CONFIG = NetworkConfig(layers=18, channels=(16, 16, 16, 16))


@pytest.fixture(scope="module")
def network() -> GaCnn:
    return build_network(CONFIG, seed=5).eval()


@pytest.fixture(scope="module")
def data(network: GaCnn) -> bytes:
    return save_checkpoint_bytes(network)


def test_loaded_network_predicts_the_same_bits(network: GaCnn, data: bytes) -> None:
    loaded = load_checkpoint_bytes(data)
    inputs = torch.randn(4, len(CHANNELS), 24, 24, generator=torch.Generator())
    with torch.inference_mode():
        assert torch.equal(loaded(inputs), network(inputs))
    assert loaded.config == CONFIG
    assert not loaded.training
    assert save_checkpoint_bytes(loaded) == data


@pytest.mark.parametrize("kept", [0, 4, 100, -1])
def test_truncated_bytes_are_refused(data: bytes, kept: int) -> None:
    with pytest.raises(ArtifactError, match="damaged"):
        load_checkpoint_bytes(data[:kept])


def test_any_flipped_bit_is_refused(data: bytes) -> None:
    for position in range(0, len(data), len(data) // 50):
        flipped = bytearray(data)
        flipped[position] ^= 0x10
        with pytest.raises(ArtifactError):
            load_checkpoint_bytes(bytes(flipped))


def test_bytes_of_another_kind_are_refused() -> None:
    with pytest.raises(ArtifactError, match="damaged or no safetensors"):
        load_checkpoint_bytes(b"<!doctype html><html>not a network</html>")
    with pytest.raises(ArtifactError):
        load_checkpoint_bytes(save({"weight": torch.zeros(3)}))


def test_another_version_is_refused_with_both_named(
    data: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpoint, "FORMAT_VERSION", 7)
    with pytest.raises(ArtifactError, match=r"version 1.*version 7"):
        load_checkpoint_bytes(data)


def test_weights_of_another_depth_are_refused(network: GaCnn) -> None:
    other = build_network(CONFIG.model_copy(update={"layers": 20}), seed=0)
    other.config = CONFIG
    with pytest.raises(ArtifactError, match="does not fit its own configuration"):
        load_checkpoint_bytes(save_checkpoint_bytes(other))


def test_weights_that_are_not_finite_are_refused() -> None:
    broken = build_network(CONFIG, seed=0)
    with torch.no_grad():
        next(broken.parameters())[0, 0, 0, 0] = torch.nan
    with pytest.raises(ArtifactError, match="not finite"):
        load_checkpoint_bytes(save_checkpoint_bytes(broken))
