"""Training GA-CNN: one loop to read from top to bottom; Supplement IV.

The figure of merit is the mean |q̂ − q| of Supplement IV, so the loss is that absolute error, made
square within ``loss_beta`` of the truth (smooth L1): the median it aims at is what minimises the
figure, and the rounded corner keeps the last steps from jumping about zero error.

Everything drawn at random follows from (seed, epoch): the order of the samples and the symmetries
applied to them. A run killed in an epoch begins that epoch again from the state saved before it,
and arrives at the same bytes as a run never killed.
"""

import json
import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from pipeline.artifacts.publishing import publish_bytes
from pipeline.config.learning import NetworkConfig, TrainConfig
from pipeline.errors import ArtifactError, MachineError
from pipeline.network.canonical import SYMMETRIES, apply_symmetry, network_input
from pipeline.network.checkpoint import tensors_from_bytes, tensors_to_bytes
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.samples import GraspTensors

STATE_FILE = "training.safetensors"
# Rises whenever the loop changes what it computes: a state of another version is not continued.
STATE_VERSION = 1


@dataclass(frozen=True)
class EpochMetrics:
    """One epoch in figures.

    Attributes
    ----------
    epoch : counted from 0.
    learning_rate : at the epoch's last step.
    train_loss : mean loss over the epoch's samples, as they were seen (augmented, in training).
    train_mae : mean |q̂ − q| over the same.
    val_mae : mean |q̂ − q| over the validation samples after the epoch.
    """

    epoch: int
    learning_rate: float
    train_loss: float
    train_mae: float
    val_mae: float


@dataclass(frozen=True)
class TrainedNetwork:
    """What a training leaves.

    Attributes
    ----------
    network : weights of the best epoch, on the CPU, ready to predict.
    best_epoch : the epoch of the lowest validation error.
    val_mae : that error.
    history : every epoch, those before an interruption too.
    stopped_early : patience ran out before the last epoch.
    """

    network: GaCnn
    best_epoch: int
    val_mae: float
    history: tuple[EpochMetrics, ...]
    stopped_early: bool


def train(
    config: TrainConfig,
    network: NetworkConfig,
    seed: int,
    train_set: GraspTensors,
    val_set: GraspTensors,
    state_dir: Path,
    on_epoch: Callable[[EpochMetrics], None],
) -> TrainedNetwork:
    """Train a network; continue where an interrupted call with the same arguments stopped.

    Parameters
    ----------
    state_dir : where the resume state lives. A state of other arguments there is overwritten.
    on_epoch : called once after each epoch of this call, when its state is safe on disk.

    Raises
    ------
    ConfigError : ``network`` names no member of the family.
    MachineError : ``config.device`` asks for a GPU and there is none.
    ArtifactError : the resume state is damaged.
    """
    device = chosen_device(config.device)
    identity = _identity(config, network, seed, train_set, val_set, device)
    with reproducible(config.threads):
        model = build_network(network, seed).to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]
        optimizer = build_optimizer(model, config)
        best_weights = _copied_weights(model)
        history: list[EpochMetrics] = []

        state_path = state_dir / STATE_FILE
        if state_path.exists():
            history, best_weights = _load_state(
                state_path, identity, model, optimizer, best_weights
            )

        batches_per_epoch = math.ceil(len(train_set) / config.batch_size)
        total_steps = config.epochs * batches_per_epoch
        while len(history) < config.epochs and not _patience_ran_out(history, config):
            epoch = len(history)
            rng = np.random.default_rng((seed, epoch))
            loss_sum = error_sum = 0.0
            rate = 0.0
            model.train()
            order = rng.permutation(len(train_set))
            for batch, indices in enumerate(np.array_split(order, batches_per_epoch)):
                rate = learning_rate_at(epoch * batches_per_epoch + batch, total_steps, config)
                for group in optimizer.param_groups:
                    group["lr"] = rate
                inputs, quality = load_batch(train_set, np.sort(indices), device)
                if config.augment:
                    elements = rng.integers(0, SYMMETRIES, size=len(indices))
                    inputs = apply_symmetry(inputs, torch.from_numpy(elements).to(device))

                with mixed_precision(device):
                    predicted = model(inputs.contiguous(memory_format=torch.channels_last))
                loss = nn.functional.smooth_l1_loss(predicted, quality, beta=config.loss_beta)
                optimizer.zero_grad(set_to_none=True)
                loss.backward()
                nn.utils.clip_grad_norm_(model.parameters(), config.gradient_norm_max)
                optimizer.step()

                loss_sum += loss.item() * len(indices)
                error_sum += (predicted.detach() - quality).abs().sum().item()

            metrics = EpochMetrics(
                epoch=epoch,
                learning_rate=rate,
                train_loss=loss_sum / len(train_set),
                train_mae=error_sum / len(train_set),
                val_mae=_mean_absolute_error(model, val_set, config.batch_size, device),
            )
            if not history or metrics.val_mae < min(past.val_mae for past in history):
                best_weights = _copied_weights(model)
            history.append(metrics)
            _save_state(state_path, identity, model, optimizer, best_weights, history)
            on_epoch(metrics)

        model.load_state_dict(best_weights)
    best = min(history, key=lambda metrics: metrics.val_mae)
    return TrainedNetwork(
        network=model.cpu().eval(),
        best_epoch=best.epoch,
        val_mae=best.val_mae,
        history=tuple(history),
        stopped_early=len(history) < config.epochs,
    )


def learning_rate_at(step: int, total_steps: int, config: TrainConfig) -> float:
    """Linear rise over the warm-up, then half a cosine down towards zero; both leave out zero."""
    warmup = round(config.warmup_fraction * total_steps)
    if step < warmup:
        return config.learning_rate * (step + 1) / warmup
    progress = (step - warmup) / (total_steps - warmup)
    return config.learning_rate * 0.5 * (1.0 + math.cos(math.pi * progress))


def build_optimizer(model: GaCnn, config: TrainConfig) -> torch.optim.AdamW:
    """AdamW that decays the weights of convolutions and fully connected layers alone."""
    parameters = list(model.parameters())
    groups = [
        {"params": [p for p in parameters if p.ndim > 1], "weight_decay": config.weight_decay},
        {"params": [p for p in parameters if p.ndim <= 1], "weight_decay": 0.0},
    ]
    return torch.optim.AdamW(groups, lr=config.learning_rate, fused=True)


def load_batch(
    samples: GraspTensors, indices: Int[np.ndarray, " b"], device: torch.device
) -> tuple[Float[Tensor, "b c h w"], Float[Tensor, " b"]]:
    """Canonical inputs and qualities of some samples; sorted indices read a mapped file best."""
    cloud = torch.from_numpy(samples.cloud[indices]).to(device)
    mask = torch.from_numpy(samples.mask[indices]).to(device)
    quality = torch.from_numpy(samples.quality[indices].astype(np.float32)).to(device)
    return network_input(cloud, mask), quality


def chosen_device(wanted: str) -> torch.device:
    """The device to train on.

    Raises
    ------
    MachineError : a GPU is asked for by name and there is none.
    """
    available = torch.cuda.is_available()
    if wanted == "cuda" and not available:
        raise MachineError(
            "train.device = 'cuda', and PyTorch finds no GPU", "Choose 'auto' or 'cpu'."
        )
    return torch.device("cuda" if available and wanted != "cpu" else "cpu")


def mixed_precision(device: torch.device) -> torch.autocast:
    """bfloat16 where it pays: on a GPU. Its range is single precision's: no loss scaling."""
    return torch.autocast(device.type, dtype=torch.bfloat16, enabled=device.type == "cuda")


@contextmanager
def reproducible(threads: int) -> Iterator[None]:
    """Fixed thread count and deterministic kernels within; as it was before afterwards."""
    threads_before = torch.get_num_threads()
    deterministic_before = torch.are_deterministic_algorithms_enabled()
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
    torch.set_num_threads(threads)
    torch.use_deterministic_algorithms(True)
    try:
        yield
    finally:
        torch.use_deterministic_algorithms(deterministic_before)
        torch.set_num_threads(threads_before)


def _mean_absolute_error(
    model: GaCnn, samples: GraspTensors, batch_size: int, device: torch.device
) -> float:
    model.eval()
    error_sum = 0.0
    with torch.inference_mode():
        for start in range(0, len(samples), batch_size):
            indices = np.arange(start, min(start + batch_size, len(samples)))
            inputs, quality = load_batch(samples, indices, device)
            with mixed_precision(device):
                predicted = model(inputs.contiguous(memory_format=torch.channels_last))
            error_sum += (predicted - quality).abs().sum().item()
    return error_sum / len(samples)


def _patience_ran_out(history: list[EpochMetrics], config: TrainConfig) -> bool:
    if not history:
        return False
    best = min(history, key=lambda metrics: metrics.val_mae)
    return history[-1].epoch - best.epoch >= config.patience_epochs


def _copied_weights(model: GaCnn) -> dict[str, Tensor]:
    return {name: tensor.detach().clone() for name, tensor in model.state_dict().items()}


def _identity(
    config: TrainConfig,
    network: NetworkConfig,
    seed: int,
    train_set: GraspTensors,
    val_set: GraspTensors,
    device: torch.device,
) -> str:
    """All that the result depends on, as text: only a state of the same is continued."""
    parts = {
        "version": STATE_VERSION,
        "train": config.model_dump(mode="json"),
        "network": network.model_dump(mode="json"),
        "seed": seed,
        "train_set": train_set.sha256(),
        "val_set": val_set.sha256(),
        "device": device.type,
        "torch": torch.__version__,
    }
    return json.dumps(parts, sort_keys=True)


def _save_state(
    path: Path,
    identity: str,
    model: GaCnn,
    optimizer: torch.optim.AdamW,
    best_weights: dict[str, Tensor],
    history: list[EpochMetrics],
) -> None:
    """Everything the next epoch needs; the schedule and the generators follow from its number."""
    tensors = {f"model/{name}": tensor for name, tensor in model.state_dict().items()}
    tensors |= {f"best/{name}": tensor for name, tensor in best_weights.items()}
    for name, parameter in model.named_parameters():
        for key, tensor in optimizer.state[parameter].items():
            tensors[f"optimizer/{name}/{key}"] = tensor
    metadata = {"identity": identity, "history": json.dumps([asdict(past) for past in history])}
    publish_bytes(path, tensors_to_bytes(tensors, metadata))


def _load_state(
    path: Path,
    identity: str,
    model: GaCnn,
    optimizer: torch.optim.AdamW,
    best_weights: dict[str, Tensor],
) -> tuple[list[EpochMetrics], dict[str, Tensor]]:
    """Put a saved state in place; leave all as given where it is of other arguments.

    Returns the history and the best weights.
    """
    tensors, metadata = tensors_from_bytes(path.read_bytes(), str(path))
    if metadata.get("identity") != identity:
        return [], best_weights
    try:
        history = [EpochMetrics(**past) for past in json.loads(metadata["history"])]
        model.load_state_dict({name: tensors[f"model/{name}"] for name in model.state_dict()})
        for name, parameter in model.named_parameters():
            # In the parameter's own memory order, or the next step rounds differently.
            optimizer.state[parameter] = {
                key: torch.zeros_like(parameter).copy_(tensors[f"optimizer/{name}/{key}"])
                for key in ("exp_avg", "exp_avg_sq")
            }
            step = tensors[f"optimizer/{name}/step"].to(parameter.device)
            optimizer.state[parameter]["step"] = step
        best = {
            name: torch.zeros_like(given).copy_(tensors[f"best/{name}"])
            for name, given in best_weights.items()
        }
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        raise ArtifactError(
            f"{path} cannot be continued: {error}", "Delete it to train from the start."
        ) from error
    return history, best
