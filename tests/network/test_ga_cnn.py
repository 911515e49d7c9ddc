"""The family: layers, parameters, valid depths, range of the output."""

import pytest
import torch
from pydantic import ValidationError

from pipeline.config.learning import DEEPEST, SHALLOWEST, NetworkConfig
from pipeline.errors import ConfigError
from pipeline.network.ga_cnn import (
    blocks_per_stage,
    build_network,
    parameter_count,
    weighted_layer_count,
)
from pipeline.network.input_channels import CHANNELS

PUBLISHED = NetworkConfig(layers=52, channels=(64, 128, 256, 512))
SMALL = NetworkConfig(layers=18, channels=(16, 32, 64, 128))


def test_published_network_has_52_layers_and_3_23_million_parameters() -> None:
    network = build_network(PUBLISHED, seed=0)
    assert weighted_layer_count(network) == 52
    assert parameter_count(network) == pytest.approx(3.23e6, rel=0.01)


@pytest.mark.parametrize("layers", range(SHALLOWEST, DEEPEST + 1, 2))
def test_every_even_depth_is_built_with_blocks_in_every_stage(layers: int) -> None:
    blocks = blocks_per_stage(layers)
    assert 4 + 2 * sum(blocks) == layers
    assert max(blocks) - min(blocks) <= 1
    assert min(blocks) >= 1


@pytest.mark.parametrize("channels", [(8, 16, 32, 64), (16, 32, 64, 128), (32, 64, 128, 256)])
@pytest.mark.parametrize("layers", [18, 20, 50, 102])
def test_built_network_counts_the_layers_asked_for(
    layers: int, channels: tuple[int, int, int, int]
) -> None:
    network = build_network(NetworkConfig(layers=layers, channels=channels), seed=0)
    assert weighted_layer_count(network) == layers


def test_more_depth_and_more_channels_are_more_parameters() -> None:
    def parameters(layers: int, first: int) -> int:
        channels = (first, 2 * first, 4 * first, 8 * first)
        return parameter_count(build_network(NetworkConfig(layers=layers, channels=channels), 0))

    assert parameters(18, 16) < parameters(20, 16) < parameters(52, 16)
    assert parameters(18, 16) < parameters(18, 32) < parameters(18, 64)


@pytest.mark.parametrize("layers", [19, 51, 101])
def test_depth_outside_the_family_names_the_depths_inside(layers: int) -> None:
    with pytest.raises(ConfigError, match=f"{layers}.*even number from 18 to 102"):
        blocks_per_stage(layers)


def test_channels_that_cannot_be_grouped_are_refused() -> None:
    with pytest.raises(ValidationError, match="multiples of 16"):
        build_network(NetworkConfig(channels=(24, 32, 64, 128)), seed=0)


def test_ablation_differs_by_the_attention_alone() -> None:
    attended = build_network(SMALL, seed=0)
    plain = build_network(SMALL.model_copy(update={"attention": "none"}), seed=0)
    missing = set(attended.state_dict()) - set(plain.state_dict())
    assert missing
    assert all(".attention." in name for name in missing)
    assert set(plain.state_dict()) < set(attended.state_dict())
    assert weighted_layer_count(plain) == weighted_layer_count(attended)


def test_quality_lies_between_0_and_1_for_any_finite_input() -> None:
    network = build_network(SMALL, seed=0).eval()
    inputs = 100 * torch.randn(16, len(CHANNELS), 24, 24, generator=torch.Generator())
    with torch.inference_mode():
        quality = network(inputs)
    assert quality.shape == (16,)
    assert bool(((quality >= 0) & (quality <= 1)).all())


def test_seed_alone_decides_the_initial_weights() -> None:
    torch.manual_seed(1)
    before = torch.random.get_rng_state()
    first = build_network(SMALL, seed=3)
    assert torch.equal(torch.random.get_rng_state(), before)
    torch.manual_seed(2)
    second, other = build_network(SMALL, seed=3), build_network(SMALL, seed=4)
    weights = "stem.0.weight"
    assert torch.equal(first.state_dict()[weights], second.state_dict()[weights])
    assert not torch.equal(first.state_dict()[weights], other.state_dict()[weights])
