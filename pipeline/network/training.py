"""Training GA-CNN: one loop to read from top to bottom; Supplement IV.

The figure of merit is the mean |q̂ − q| of Supplement IV. The loss is that absolute error, squared
within ``loss_beta`` of the truth (smooth L1): its minimum is the median, which also minimises the
figure of merit, and the squared part makes the last steps small where the error is near zero.

Everything drawn at random follows from (seed, epoch): the order of the samples, the symmetries
applied to them and those in which teachers are asked. A run killed at any batch resumes from the
last state saved before it, and arrives at the same bytes as a run never killed. Several processes
(``parallel``) take the steps that one takes, up to rounding.
"""

import json
import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor, nn
from torch.nn.parallel import DistributedDataParallel

from pipeline.config.learning import NetworkConfig, TrainConfig
from pipeline.network.canonical import apply_symmetry, network_input
from pipeline.network.checkpoint import checkpoint_digest
from pipeline.network.devices import Predict, choose_device, compile_network, mixed_precision
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.input_channels import CHANNELS, SYMMETRIES
from pipeline.network.loading import (
    RawBatch,
    WaitClock,
    batch_count,
    epoch_batches,
    load_batches,
    part_of_rank,
)
from pipeline.network.parallel import ALONE, Ranks, sync_batch_norms
from pipeline.network.reproducible import reproducible
from pipeline.network.resuming import (
    STATE_FILE,
    TrainingState,
    load_training_state,
    save_training_state,
)
from pipeline.network.samples import GraspTensors, SampleReader
from pipeline.network.teachers import Teachers, training_loss
from pipeline.network.training_figures import EpochMetrics
from pipeline.progress import progress

# Rises whenever the loop changes what it computes: a state of another version is not continued.
STATE_VERSION = 4
_NOT_OF_THE_LOOP = {"start_shares"}  # what becomes of the trained weights afterwards
SAVE_EVERY_S = 120.0  # what a kill may cost; a state of 52 layers takes a third of a second

Batch = tuple[Float[Tensor, "b c h w"], Float[Tensor, " b"]]


@dataclass(frozen=True)
class TrainedNetwork:
    """Result of a training.

    Attributes
    ----------
    network
        Weights of the epoch that ``train.keep`` names, on the CPU, ready to predict.
    kept_epoch
        That epoch, the first is 0.
    val_mae
        Its validation error.
    history
        Every epoch, those before an interruption too.
    stopped_early
        Whether patience ran out before all epochs were done.
    waiting_share
        Share of this call's time spent waiting for samples to be read; None where no step was
        taken.
    preparing_share
        Share of this call's time spent making canonical inputs; None where no step was taken.
    """

    network: GaCnn
    kept_epoch: int
    val_mae: float
    history: tuple[EpochMetrics, ...]
    stopped_early: bool
    waiting_share: float | None
    preparing_share: float | None


def train(
    config: TrainConfig,
    network: NetworkConfig,
    seed: int,
    train_set: SampleReader,
    val_set: GraspTensors,
    state_dir: Path,
    on_epoch: Callable[[EpochMetrics], None],
    ranks: Ranks = ALONE,
    loader_workers: int = 0,
    save_every_s: float = SAVE_EVERY_S,
    show_progress: bool = False,
    start: GaCnn | None = None,
    teachers: Sequence[GaCnn] = (),
) -> TrainedNetwork:
    """Train a network; continue where an interrupted call with the same arguments stopped.

    Parameters
    ----------
    config
        Epochs, batches, learning rate and device.
    network
        Depth, channels and attention.
    seed
        Seed of the weights, the order of samples and their symmetries.
    train_set
        Samples to train on.
    val_set
        Samples that each epoch is measured on; with ``config.keep`` "best" they choose the epoch.
    state_dir
        Folder of the resume state, seen by all processes. A state of other arguments there is
        overwritten.
    on_epoch
        Called by the first process after each epoch of this call, when its state is saved.
    ranks
        This process's place among those that train together; all call this alike.
    loader_workers
        Processes that read batches ahead; 0: this process reads each batch when it is needed.
    save_every_s
        Time between two saved states within an epoch [s].
    show_progress
        Whether to show a progress bar for each epoch.
    start
        A network like ``network`` whose weights are the first ones; None: drawn from the seed.
    teachers
        Networks whose mean prediction is learned beside the label; none: the label alone.

    Returns
    -------
    The network of the kept epoch, with its history.

    Raises
    ------
    ConfigError
        ``network`` names no member of the family, batches are too small to divide, or several
        processes are to train a compiled network.
    MachineError
        ``config.device`` asks for a GPU and there is none, or ``config.compiled`` for a compiler.
    ArtifactError
        The resume state is damaged.
    """
    device = choose_device(config.device, ranks)
    identity = _identity(config, network, seed, train_set, val_set, device, start, teachers)
    with reproducible(config.threads):
        model = build_network(network, seed)
        if start is not None:
            model.load_state_dict(start.state_dict())
        model = model.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]
        if ranks.count > 1:
            sync_batch_norms(model)
        optimizer = build_optimizer(model, config)
        state = TrainingState([], _copied_weights(model), 0, _no_sums(device))
        state_path = state_dir / STATE_FILE
        if state_path.exists():
            state = load_training_state(state_path, identity, model, optimizer, state)
        forward: Predict = model
        if ranks.count > 1:
            forward = DistributedDataParallel(model, forward_sync_buffers=False)
        if config.compiled:
            forward = compile_network(model, device, ranks)
        taught_by = Teachers(teachers, config, device)

        batches_per_epoch = batch_count(len(train_set), config.batch_size)
        total_steps = config.epochs * batches_per_epoch
        reading, preparing, saved_at = WaitClock(), WaitClock(), time.monotonic()
        while not _finished(state.history, config):
            epoch = len(state.history)
            rng = np.random.default_rng((seed, epoch))
            batches = epoch_batches(len(train_set), config.batch_size, rng, config.shuffle_window)
            symmetry = rng.integers(0, SYMMETRIES, len(train_set)) if config.augment else None
            turns = torch.from_numpy(rng.integers(0, SYMMETRIES, (len(batches), len(teachers))))
            mine = part_of_rank(batches, ranks.rank, ranks.count)[state.batch :]
            loaded = load_batches(train_set, mine, loader_workers, pinned=device.type == "cuda")
            ready = preparing.watch(ready_batches(reading.watch(loaded), symmetry, device))
            if show_progress and ranks.first:
                name = f"train: epoch {epoch + 1} of {config.epochs}"
                ready = iter(progress(ready, len(mine), name, "batch"))

            model.train()
            for inputs, quality in ready:
                step = epoch * batches_per_epoch + state.batch
                rate = learning_rate_at(step, total_steps, config)
                for group in optimizer.param_groups:
                    group["lr"] = rate

                with mixed_precision(device, config.precision):
                    predicted = forward(inputs)
                asked = turns[state.batch]
                taught = taught_by.mean_prediction(inputs, asked) if teachers else None
                loss = training_loss(predicted, quality, taught, config)
                optimizer.zero_grad(set_to_none=True)
                # Processes average their gradients: that of the batch's mean is what comes out.
                (loss * ranks.count / len(batches[state.batch])).backward()
                nn.utils.clip_grad_norm_(model.parameters(), config.gradient_norm_max)
                optimizer.step()

                state.sums += ranks.summed(_sums(loss, predicted, quality))
                state.batch += 1
                if ranks.first and time.monotonic() - saved_at >= save_every_s:
                    save_training_state(state_path, identity, model, optimizer, state)
                    saved_at = time.monotonic()

            loss_sum, error_sum, seen = state.sums.tolist()
            metrics = EpochMetrics(
                epoch=epoch,
                learning_rate=learning_rate_at(
                    (epoch + 1) * batches_per_epoch - 1, total_steps, config
                ),
                train_loss=loss_sum / seen,
                train_mae=error_sum / seen,
                val_mae=_mean_absolute_error(model, val_set, config.batch_size, device, ranks),
                samples=round(seen),
            )
            state.history.append(metrics)
            if _kept(state.history, config) is metrics:
                state.kept_weights = _copied_weights(model)
            state.batch, state.sums = 0, _no_sums(device)
            if ranks.first:
                save_training_state(state_path, identity, model, optimizer, state)
                saved_at = time.monotonic()
                on_epoch(metrics)

    kept = _kept(state.history, config)
    trained = build_network(network, seed)
    trained.load_state_dict(state.kept_weights)
    return TrainedNetwork(
        network=trained.eval(),
        kept_epoch=kept.epoch,
        val_mae=kept.val_mae,
        history=tuple(state.history),
        stopped_early=len(state.history) < config.epochs,
        waiting_share=preparing.share_of(reading.waiting_s),
        preparing_share=preparing.share_of(preparing.waiting_s - reading.waiting_s),
    )


def ready_batches(
    loaded: Iterable[RawBatch], symmetry: Int[np.ndarray, " n"] | None, device: torch.device
) -> Iterator[Batch]:
    """Make canonical inputs of loaded batches, on the device.

    Parameters
    ----------
    loaded
        Indices, clouds, masks and qualities, batch by batch.
    symmetry
        For each sample of the set the element that turns or mirrors it, shape (n,); None: none.
    device
        Where the results lie.

    Yields
    ------
    Batch
        Canonical inputs, shape (b, c, h, w), and qualities, shape (b,).
    """
    for indices, cloud, mask, quality in loaded:
        inputs = network_input(
            cloud.to(device, non_blocking=True), mask.to(device, non_blocking=True)
        )
        if symmetry is not None:
            inputs = apply_symmetry(inputs, torch.from_numpy(symmetry[indices]).to(device))
        yield inputs.contiguous(memory_format=torch.channels_last), quality.to(device)


def learning_rate_at(step: int, total_steps: int, config: TrainConfig) -> float:
    """Learning rate of a step: a linear rise over the warm-up, then half a cosine; never zero."""
    warmup = round(config.warmup_fraction * total_steps)
    if step < warmup:
        return config.learning_rate * (step + 1) / warmup
    progress = (step - warmup) / (total_steps - warmup)
    return config.learning_rate * 0.5 * (1.0 + math.cos(math.pi * progress))


def build_optimizer(model: GaCnn, config: TrainConfig) -> torch.optim.AdamW:
    """AdamW with weight decay on the weights of convolutions and fully connected layers alone."""
    parameters = list(model.parameters())
    groups = [
        {"params": [p for p in parameters if p.ndim > 1], "weight_decay": config.weight_decay},
        {"params": [p for p in parameters if p.ndim <= 1], "weight_decay": 0.0},
    ]
    return torch.optim.AdamW(groups, lr=config.learning_rate, fused=True)


def _mean_absolute_error(
    model: GaCnn, samples: GraspTensors, batch_size: int, device: torch.device, ranks: Ranks
) -> float:
    """Mean |q̂ − q|, each process predicting every ``ranks.count``-th sample."""
    mine = np.arange(ranks.rank, len(samples), ranks.count)
    batches = [mine[at : at + batch_size] for at in range(0, len(mine), batch_size)]
    error_sum = torch.zeros(1, dtype=torch.float64, device=device)
    model.eval()
    with torch.inference_mode():
        loaded = load_batches(samples, batches, workers=0, pinned=False)
        for inputs, quality in ready_batches(loaded, None, device):
            with mixed_precision(device, "auto"):  # as it will be asked
                predicted = model(inputs)
            error_sum += (predicted - quality).abs().sum()
    return ranks.summed(error_sum).item() / len(samples)


def _sums(
    loss: Float[Tensor, ""], predicted: Float[Tensor, " b"], quality: Float[Tensor, " b"]
) -> Float[Tensor, " 3"]:
    """Loss, |q̂ − q| and samples of a process's part of a batch."""
    error = (predicted.detach() - quality).abs().sum()
    count = torch.tensor(float(len(quality)), device=error.device)
    return torch.stack((loss.detach(), error, count)).double()


def _no_sums(device: torch.device) -> Float[Tensor, " 3"]:
    return torch.zeros(3, dtype=torch.float64, device=device)


def _finished(history: list[EpochMetrics], config: TrainConfig) -> bool:
    """All epochs are done, or patience ran out."""
    if not history:
        return False
    waited = history[-1].epoch - _kept(history, config).epoch >= config.patience_epochs
    return waited or len(history) >= config.epochs


def _kept(history: list[EpochMetrics], config: TrainConfig) -> EpochMetrics:
    """The epoch whose weights would be the network's if training ended now."""
    if config.keep == "last":
        return history[-1]
    return min(history, key=lambda metrics: metrics.val_mae)


def _copied_weights(model: GaCnn) -> dict[str, Tensor]:
    return {name: tensor.detach().clone() for name, tensor in model.state_dict().items()}


def _identity(
    config: TrainConfig,
    network: NetworkConfig,
    seed: int,
    train_set: SampleReader,
    val_set: GraspTensors,
    device: torch.device,
    start: GaCnn | None,
    teachers: Sequence[GaCnn],
) -> str:
    """All that the result depends on, as text: only a state of the same is continued."""
    parts = {
        "version": STATE_VERSION,
        "train": config.model_dump(mode="json", exclude=_NOT_OF_THE_LOOP),
        "network": network.model_dump(mode="json"),
        "channels": CHANNELS,
        "seed": seed,
        "train_set": train_set.sha256(),
        "val_set": val_set.sha256(),
        "device": device.type,
        "torch": torch.__version__,
        "start": checkpoint_digest(start) if start else None,
        "teachers": [checkpoint_digest(each) for each in teachers],
    }
    return json.dumps(parts, sort_keys=True)
