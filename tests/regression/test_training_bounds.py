"""A sound training of run `ci` keeps the measured bounds from its first epochs on, a broken not."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from torch import Tensor, nn

from pipeline.config import load_run_config
from pipeline.execution import RunFolder
from pipeline.messages.samples import read_split
from pipeline.network import training
from pipeline.network.samples import GraspTensors, Samples
from pipeline.network.training_figures import EpochMetrics
from pipeline.regression.comparison import Difference, differences
from pipeline.regression.spread import (
    EARLY_EPOCH,
    early_figures,
    read_spread,
    trained_figures,
    training_reference,
)
from stages.regress import SPREAD

Loss = Callable[..., Tensor]


class EnoughSeenError(Exception):
    """Ends a training after its first epochs."""


def tensors(samples: Samples) -> GraspTensors:
    return GraspTensors(samples.cloud, samples.cloud_mask, samples.quality)


def early_training_error(run: RunFolder, state: Path, shuffled: bool) -> list[float]:
    """Training error of the run's first epochs, trained here and now."""
    config = load_run_config(run.config)
    learned, held_out = (
        tensors(read_split(run.artifact("shards"), split)) for split in ("train", "val")
    )
    if shuffled:
        quality = np.random.default_rng(0).permutation(learned.quality)
        learned = GraspTensors(learned.cloud, learned.mask, quality)
    errors: list[float] = []

    def on_epoch(metrics: EpochMetrics) -> None:
        errors.append(metrics.train_mae)
        if len(errors) == EARLY_EPOCH:
            raise EnoughSeenError

    with pytest.raises(EnoughSeenError):
        training.train(
            config.train, config.network, config.seed, learned, held_out, state, on_epoch
        )
    return errors


def told(errors: list[float]) -> list[Difference]:
    """What the regression says of the first epochs."""
    now = {"trained": early_figures(errors)}
    reference = training_reference(read_spread(SPREAD))
    known = {
        group: {name: reference[group][name] for name in now["trained"]}
        for group in ("trained", "trained_low", "trained_high")
    }
    return list(differences(now, known))


def test_a_sound_training_keeps_them(ci_run: RunFolder, tmp_path: Path) -> None:
    assert told(early_training_error(ci_run, tmp_path, shuffled=False)) == []


def test_labels_of_other_grasps_miss_them(ci_run: RunFolder, tmp_path: Path) -> None:
    assert len(told(early_training_error(ci_run, tmp_path, shuffled=True))) == 1


def signed(predicted: Tensor, quality: Tensor, beta: float, reduction: str) -> Tensor:
    """An error without its absolute value: the lowest prediction is always the best."""
    return (predicted - quality).sum()


def to_the_square_root(predicted: Tensor, quality: Tensor, beta: float, reduction: str) -> Tensor:
    """The right form, towards the wrong target."""
    return (predicted - quality.sqrt()).abs().sum()


@pytest.mark.parametrize("loss", [signed, to_the_square_root])
def test_a_broken_loss_misses_them(
    loss: Loss, ci_run: RunFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(nn.functional, "smooth_l1_loss", loss)
    assert len(told(early_training_error(ci_run, tmp_path, shuffled=False))) == 1


def test_a_network_that_answers_the_mean_misses_all() -> None:
    reference = training_reference(read_spread(SPREAD))
    mean_predictor = 0.262  # error on run ci's test split
    epochs = [mean_predictor] * 12
    now = {"trained": trained_figures(epochs, epochs, mean_predictor)}
    missed = {difference.quantity for difference in differences(now, reference)}
    assert missed == set(now["trained"])
