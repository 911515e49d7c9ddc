"""Networks between the one that a training began with and the one that came of it."""

import numpy as np
import pytest
import torch
from pydantic import ValidationError
from torch import nn

from pipeline.config.learning import NetworkConfig, TrainConfig
from pipeline.network.canonical import network_input
from pipeline.network.checkpoint import checkpoint_digest
from pipeline.network.deepening import deepened
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.interpolation import choose_between, graspable_error, interpolated
from pipeline.network.samples import GraspTensors, Samples
from tests.network.planes import planes_with_holes

NETWORK = NetworkConfig(layers=18, channels=(8, 8, 16, 32))
LEARNED = planes_with_holes(300, seed=1)


def random_network(seed: int) -> GaCnn:
    """A network whose branches are not nothing; its norms have LEARNED's statistics."""
    network = build_network(NETWORK, seed).eval()
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(torch.randn(parameter.shape, generator=generator), alpha=0.1)
    return interpolated(network, network, 0.5, LEARNED, threads=1)


def as_samples(tensors: GraspTensors, object_index: np.ndarray) -> Samples:
    count = len(tensors)
    return Samples(
        cloud=tensors.cloud,
        cloud_mask=tensors.mask,
        quality=np.asarray(tensors.quality),
        object_index=object_index,
        shape_class=np.zeros(count, dtype=np.int64),
        level=np.ones(count, dtype=np.int64),
        pressure=np.zeros(count),
        proposal_weight=np.ones(count),
        pictures=np.ones(count, dtype=np.int64),
    )


def test_without_a_share_it_is_the_trained_network_and_both_stay_as_they_are() -> None:
    start, trained = random_network(1), random_network(2)
    before = checkpoint_digest(start), checkpoint_digest(trained)
    assert checkpoint_digest(interpolated(start, trained, 0.0, LEARNED, 1)) == before[1]
    interpolated(start, trained, 0.5, LEARNED, 1)
    assert (checkpoint_digest(start), checkpoint_digest(trained)) == before


@pytest.mark.parametrize("share", [0.25, 0.75])
def test_weights_lie_between_and_the_same_call_gives_the_same_bytes(share: float) -> None:
    start, trained = random_network(1), random_network(2)
    between = interpolated(start, trained, share, LEARNED, 1)
    weights = [dict(network.named_parameters()) for network in (start, trained, between)]
    for name, found in weights[2].items():
        expected = share * weights[0][name] + (1 - share) * weights[1][name]
        torch.testing.assert_close(found, expected)
    assert not between.training
    again = interpolated(start, trained, share, LEARNED, 1)
    assert checkpoint_digest(again) == checkpoint_digest(between)


def test_norms_have_the_means_and_variances_of_what_the_training_clouds_give_them() -> None:
    between = interpolated(random_network(1), random_network(2), 0.5, LEARNED, 1)
    inputs = network_input(
        torch.from_numpy(np.asarray(LEARNED.cloud)), torch.from_numpy(np.asarray(LEARNED.mask))
    )
    first, norm = between.stem[0], between.stem[1]
    assert isinstance(norm, nn.BatchNorm2d)
    with torch.no_grad():
        taken = first(inputs)
    assert norm.running_mean is not None
    assert norm.running_var is not None
    torch.testing.assert_close(norm.running_mean, taken.mean(dim=(0, 2, 3)), atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(norm.running_var, taken.var(dim=(0, 2, 3)), atol=1e-5, rtol=1e-4)
    assert norm.momentum == build_network(NETWORK, 0).stem[1].momentum


def test_of_a_network_and_itself_made_deeper_every_share_predicts_the_same() -> None:
    start = random_network(1)
    wanted = NETWORK.model_copy(update={"layers": 22})
    one, other = deepened(start, wanted, seed=0), deepened(start, wanted, seed=1)
    between = interpolated(one, other, 0.5, LEARNED, 1)
    inputs = network_input(torch.from_numpy(LEARNED.cloud), torch.from_numpy(LEARNED.mask))
    with torch.no_grad():
        torch.testing.assert_close(between(inputs), start(inputs), atol=1e-5, rtol=1e-4)


def test_val_chooses_the_share_by_the_objects_that_can_be_gripped() -> None:
    start, trained = random_network(1), random_network(2)
    held_out = planes_with_holes(120, seed=3)
    owner = np.arange(120) % 3
    config = TrainConfig(start="released", start_shares=(0.0, 0.5, 0.75), threads=1)
    wanted = interpolated(start, trained, 0.75, LEARNED, 1)
    with torch.no_grad():
        inputs = network_input(torch.from_numpy(held_out.cloud), torch.from_numpy(held_out.mask))
        quality = wanted(inputs).numpy()
    val_set = as_samples(GraspTensors(held_out.cloud, held_out.mask, quality), owner)
    chosen = choose_between(start, trained, config, LEARNED, val_set)
    assert chosen.start_share == 0.75
    assert checkpoint_digest(chosen.network) == checkpoint_digest(wanted)
    assert list(chosen.errors) == [0.0, 0.5, 0.75]
    assert chosen.errors[0.75] < 1e-5 < chosen.errors[0.5]
    assert chosen.val_mae == pytest.approx(0, abs=1e-5)
    assert chosen.headline()["start_share"] == 0.75


def test_the_error_over_objects_leaves_out_what_cannot_be_gripped() -> None:
    owner = np.array([4, 4, 9, 9, 2])
    quality = np.array([0.5, 0.7, 0.0, 0.05, 0.4])
    predicted = np.array([0.6, 0.7, 0.5, 0.05, 0.1])
    assert graspable_error(owner, quality, predicted) == pytest.approx((0.05 + 0.3) / 2)
    nothing = np.zeros(5)
    assert graspable_error(owner, nothing, predicted) == pytest.approx((0.65 + 0.275 + 0.1) / 3)


def test_a_share_without_a_start_and_one_of_all_are_refused() -> None:
    with pytest.raises(ValidationError, match="start_shares mixes in"):
        TrainConfig(start_shares=(0.0, 0.5))
    with pytest.raises(ValidationError, match="less than 1"):
        TrainConfig(start="released", start_shares=(1.0,))
