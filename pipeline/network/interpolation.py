"""A network part of the way between the one that a training began with and the one that came of it.

Training on from a network wins on what it now sees and loses some of what it saw before. Weights in
between can keep much of both (WiSE-FT, Wortsman et al., 2022). What the norms took of their inputs
is neither network's there, and is taken anew from training clouds.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Integer
from torch import Tensor
from torch.optim.swa_utils import update_bn

from pipeline.config.learning import TrainConfig
from pipeline.network.by_object import errors_by_object
from pipeline.network.canonical import network_input
from pipeline.network.figures import mean_absolute_error
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.inference import predict
from pipeline.network.reproducible import reproducible
from pipeline.network.samples import SampleReader, Samples
from pipeline.spread import choose_evenly

_STATISTICS_CLOUDS = 10_240  # that the norms take their means and variances from
_AT_A_TIME = 512  # clouds: as many as a batch of the larger trainings, some 100 MB of maps


@dataclass(frozen=True)
class ChosenShare:
    """What the samples of val chose.

    Attributes
    ----------
    network
        The network, ready to predict.
    start_share
        Share of the starting network's weights in it.
    errors
        Of each share: mean over val's objects that can be gripped of the error of one prediction.
    val_mae
        Error of one prediction of the chosen network, over all of val.
    """

    network: GaCnn
    start_share: float
    errors: dict[float, float]
    val_mae: float

    def headline(self) -> dict[str, Any]:
        """The choice by the names that the stage's summary uses."""
        return {
            "start_share": self.start_share,
            "val_mae_by_start_share": {f"{share:g}": e for share, e in self.errors.items()},
        }


def choose_between(
    start: GaCnn, trained: GaCnn, config: TrainConfig, learned: SampleReader, val_set: Samples
) -> ChosenShare:
    """The one of least error on val among the networks that ``train.start_shares`` names.

    Parameters
    ----------
    start
        The network that training began with.
    trained
        The network that came of it, of the same layers and channels.
    config
        The shares, and the threads to compute with.
    learned
        Training samples, for the statistics of the norms.
    val_set
        The run's val split.

    Returns
    -------
    The network and its share; of equal errors the first share's.
    """
    networks = {
        share: interpolated(start, trained, share, learned, config.threads)
        for share in config.start_shares
    }
    predicted = {share: _predicted(network, config, val_set) for share, network in networks.items()}
    quality = np.asarray(val_set.quality)
    errors = {
        share: graspable_error(val_set.object_index, quality, found)
        for share, found in predicted.items()
    }
    best = min(errors, key=errors.__getitem__)
    val_mae = mean_absolute_error(predicted[best], quality)
    return ChosenShare(networks[best], best, errors, val_mae)


def interpolated(
    start: GaCnn, trained: GaCnn, start_share: float, learned: SampleReader, threads: int
) -> GaCnn:
    """The network whose weights lie between those of two of the same layers and channels.

    Parameters
    ----------
    start
        One network.
    trained
        The other.
    start_share
        Share of the first one's weights in [0, 1]; 0: the other, as it is.
    learned
        Training samples; some, equally far apart, give the norms their statistics.
    threads
        Threads of PyTorch.

    Returns
    -------
    The network, on the CPU and ready to predict.
    """
    network = build_network(trained.config, 0, trained.channels)
    if start_share == 0:
        network.load_state_dict(trained.state_dict())
        return network.eval()
    begun = start.state_dict()
    network.load_state_dict(
        {
            name: torch.lerp(tensor, begun[name], start_share)
            if tensor.is_floating_point()
            else tensor
            for name, tensor in trained.state_dict().items()
        }
    )
    with reproducible(threads), torch.no_grad():
        update_bn(_some_inputs(learned), network)
    return network.eval()


def _some_inputs(learned: SampleReader) -> Iterator[Float[Tensor, "b c h w"]]:
    """Canonical inputs of training samples, equally far apart."""
    chosen = np.array(choose_evenly(len(learned), _STATISTICS_CLOUDS))
    for numbers in np.array_split(chosen, -(-len(chosen) // _AT_A_TIME)):
        rows = learned.rows(numbers)
        yield network_input(torch.from_numpy(rows.cloud), torch.from_numpy(rows.mask))


def _predicted(network: GaCnn, config: TrainConfig, samples: Samples) -> Float[np.ndarray, " n"]:
    return predict(
        *(network, samples.cloud, samples.cloud_mask),
        *(config.batch_size, config.threads),
        average_symmetries=False,
    )


def graspable_error(
    object_index: Integer[np.ndarray, " n"],
    quality: Float[np.ndarray, " n"],
    predicted: Float[np.ndarray, " n"],
) -> float:
    """Mean over objects that can be gripped of mean |q̂ − q|; over all where none can."""
    names = [str(index) for index in range(int(np.max(object_index)) + 1)]
    unweighted = np.ones(len(quality))
    errors = errors_by_object(names, object_index, quality, predicted, predicted, unweighted)
    return float(
        np.mean([one.mae for one in errors if one.graspable] or [one.mae for one in errors])
    )
