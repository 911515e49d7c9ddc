"""A network made deeper predicts the same, and its new layers are trained."""

from pathlib import Path

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.artifacts.named_inputs import RELEASED_CHECKPOINT
from pipeline.config.learning import (
    DEEPEST,
    LAYERS_PER_BLOCK,
    SHALLOWEST,
    NetworkConfig,
    TrainConfig,
)
from pipeline.network.checkpoint import checkpoint_digest
from pipeline.network.deepening import can_be_deepened, deepened
from pipeline.network.fine_tuning import starting_network
from pipeline.network.ga_cnn import (
    GaCnn,
    blocks_per_stage,
    build_network,
    parameter_count,
    weighted_layer_count,
)
from pipeline.network.training import train
from pipeline.network.training_figures import EpochMetrics
from tests.network.planes import planes_with_holes

CHANNELS = (8, 8, 16, 32)
FAMILY = st.integers(0, (DEEPEST - SHALLOWEST) // LAYERS_PER_BLOCK).map(
    lambda more: SHALLOWEST + LAYERS_PER_BLOCK * more
)


def trained_for_a_little(layers: int) -> GaCnn:
    """A network whose norms and branches are no longer those it was drawn with."""
    network = build_network(NetworkConfig(layers=layers, channels=CHANNELS), seed=0).train()
    generator = torch.Generator().manual_seed(1)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(torch.randn(parameter.shape, generator=generator), alpha=0.1)
    network(torch.randn(16, 10, 24, 24, generator=generator))
    return network.eval()


@given(FAMILY, FAMILY)
def test_a_deeper_member_has_no_stage_of_fewer_blocks(one: int, other: int) -> None:
    few, many = (blocks_per_stage(layers) for layers in sorted((one, other)))
    assert all(a <= b for a, b in zip(few, many, strict=True))


@settings(max_examples=10, deadline=None)
@given(layers=st.sampled_from((20, 26, 52)), seed=st.integers(0, 2**31))
def test_it_predicts_the_same_to_the_bit(layers: int, seed: int) -> None:
    network = trained_for_a_little(18)
    wanted = NetworkConfig(layers=layers, channels=CHANNELS)
    deeper = deepened(network, wanted, seed)
    inputs = torch.randn(8, 10, 24, 24, generator=torch.Generator().manual_seed(seed))
    assert torch.equal(deeper(inputs), network(inputs))
    assert weighted_layer_count(deeper) == layers
    assert parameter_count(deeper) > parameter_count(network)


def test_the_network_that_is_made_deeper_stays_as_it_is_and_a_seed_gives_the_same() -> None:
    network = trained_for_a_little(18)
    before = checkpoint_digest(network)
    wanted = NetworkConfig(layers=24, channels=CHANNELS)
    one, same, other = (deepened(network, wanted, seed) for seed in (3, 3, 4))
    assert checkpoint_digest(network) == before
    assert checkpoint_digest(one) == checkpoint_digest(same) != checkpoint_digest(other)


@pytest.mark.parametrize(
    ("changed", "can"),
    [
        ({"layers": 20}, True),
        ({}, False),
        ({"layers": 20, "attention": "none"}, False),
        ({"layers": 20, "channels": (8, 8, 16, 64)}, False),
    ],
)
def test_only_more_layers_can_be_added(changed: dict[str, object], can: bool) -> None:
    own = NetworkConfig(layers=18, channels=CHANNELS)
    assert can_be_deepened(own, own.model_copy(update=changed)) is can
    assert not can_be_deepened(own.model_copy(update=changed), own)


def test_training_changes_the_added_layers(tmp_path: Path) -> None:
    network = trained_for_a_little(18)
    wanted = NetworkConfig(layers=20, channels=CHANNELS)
    start = deepened(network, wanted, seed=0)
    learned, held_out = planes_with_holes(128, seed=1), planes_with_holes(64, seed=2)
    config = TrainConfig(epochs=1, batch_size=64, learning_rate=4e-3, threads=1, device="cpu")
    epochs: list[EpochMetrics] = []
    trained = train(config, wanted, 0, learned, held_out, tmp_path, epochs.append, start=start)
    before, after = start.state_dict(), trained.network.state_dict()
    added = sorted(before.keys() - network.state_dict().keys())
    gains = [name for name in added if name.endswith("channels_norm.weight")]
    assert len(gains) == 1
    assert not before[gains[0]].any()
    assert after[gains[0]].any()


def test_the_released_network_can_be_begun_with_at_a_greater_depth() -> None:
    wanted = NetworkConfig(layers=60, channels=(32, 64, 128, 256))
    deeper = starting_network(RELEASED_CHECKPOINT.read_bytes(), "released", wanted, seed=0)
    assert weighted_layer_count(deeper) == 60
