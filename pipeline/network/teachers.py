"""Learning from several trained networks beside the labels: distillation into one.

Networks that were trained on other grasps, or in another order, err on other grasps, and the mean
of their predictions errs less than each. One network that learns this mean beside the label comes
near to it, at the time of one (Hinton, Vinyals and Dean, 2015; Furlanello et al., 2018). The label
of one noisy cloud is one draw of what clouds like it have; the mean stands for many.

Each teacher is asked in a turn of its own, drawn for each batch: turned or mirrored, q is the same
(`canonical`) and a network's answer only nearly so. What is learned is then, on average over
batches, the mean of each teacher over all eight turns, which errs less than its answer in one.
"""

from collections.abc import Sequence

import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from pipeline.config.learning import TrainConfig
from pipeline.network.canonical import turn_batch
from pipeline.network.checkpoint import network_of_this_program
from pipeline.network.devices import Predict, compile_network, mixed_precision
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.parallel import ALONE


def teaching_network(data: bytes, named: str) -> GaCnn:
    """A network to learn from, of any depth and width.

    Parameters
    ----------
    data
        Its checkpoint.
    named
        What messages call it.

    Returns
    -------
    The network, on the CPU.

    Raises
    ------
    ArtifactError
        The bytes are no network, or its input is an older program's.
    """
    return network_of_this_program(data, named, "Leave it out of train.teachers")


class Teachers:
    """Trained networks that are asked together, and left as they are."""

    def __init__(
        self, networks: Sequence[GaCnn], config: TrainConfig, device: torch.device
    ) -> None:
        """Raise MachineError where ``config.compiled`` asks for a compiler that is not there."""
        self._config, self._device = config, device
        self._networks: list[Predict] = []
        for network in networks:
            ready = network.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]
            ready.eval()
            self._networks.append(
                compile_network(ready, device, ALONE) if config.compiled else ready
            )

    def mean_prediction(
        self, inputs: Float[Tensor, "b c h w"], turns: Int[Tensor, " t"]
    ) -> Float[Tensor, " b"]:
        """Mean q-hat of the networks, each asked in its own turn.

        Parameters
        ----------
        inputs
            Canonical inputs, shape (b, c, h, w).
        turns
            For each network the element of the square's symmetries by which the whole batch is
            turned or mirrored before it is asked, shape (t,).

        Returns
        -------
        Shape (b,).
        """
        views = [turn_batch(inputs, int(turn)) for turn in turns]
        with torch.no_grad(), mixed_precision(self._device, self._config.precision):
            asked = zip(self._networks, views, strict=True)
            told = [network(view).float() for network, view in asked]
        return torch.stack(told).mean(dim=0)


def training_loss(
    predicted: Float[Tensor, " b"],
    quality: Float[Tensor, " b"],
    taught: Float[Tensor, " b"] | None,
    config: TrainConfig,
) -> Float[Tensor, ""]:
    """Sum over a batch of the smooth absolute error, against label and teachers.

    Parameters
    ----------
    predicted
        q-hat, shape (b,).
    quality
        q, shape (b,).
    taught
        Mean prediction of the teachers, shape (b,); None: the label alone counts.
    config
        ``loss_beta``, and ``teacher_share``, which weighs the teachers.

    Returns
    -------
    The sum.
    """
    from_label = _smooth_error(predicted, quality, config.loss_beta)
    if taught is None:
        return from_label
    from_teachers = _smooth_error(predicted, taught, config.loss_beta)
    return (1.0 - config.teacher_share) * from_label + config.teacher_share * from_teachers


def _smooth_error(
    predicted: Float[Tensor, " b"], wanted: Float[Tensor, " b"], beta: float
) -> Float[Tensor, ""]:
    return nn.functional.smooth_l1_loss(predicted, wanted, beta=beta, reduction="sum")
