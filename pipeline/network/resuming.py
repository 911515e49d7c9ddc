"""The state of a training on disk, so that a killed one resumes and arrives at the same bytes."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor

from pipeline.artifacts.publishing import publish_bytes
from pipeline.errors import ArtifactError
from pipeline.network.checkpoint import tensors_from_bytes, tensors_to_bytes
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.training_figures import EpochMetrics

STATE_FILE = "training.safetensors"


@dataclass
class TrainingState:
    """How far a training has come.

    Attributes
    ----------
    history
        The finished epochs.
    kept_weights
        Weights of the finished epoch that is to be kept; initial ones before any.
    batch
        Batches done of the current epoch.
    sums
        Loss, |q̂ − q| and samples, summed over those batches and all processes, shape (3,).
    """

    history: list[EpochMetrics]
    kept_weights: dict[str, Tensor]
    batch: int
    sums: Float[Tensor, " 3"]


def save_training_state(
    path: Path, identity: str, model: GaCnn, optimizer: torch.optim.AdamW, state: TrainingState
) -> None:
    """Save all that the next batch needs; schedule and generators follow from its number.

    Parameters
    ----------
    path
        The file.
    identity
        All that the training's result depends on, as text.
    model
        The network as it is now.
    optimizer
        Its optimizer.
    state
        How far the training has come.
    """
    tensors = {f"model/{name}": tensor for name, tensor in model.state_dict().items()}
    tensors |= {f"kept/{name}": tensor for name, tensor in state.kept_weights.items()}
    tensors["sums"] = state.sums
    for name, parameter in model.named_parameters():
        for key, tensor in optimizer.state[parameter].items():
            tensors[f"optimizer/{name}/{key}"] = tensor
    metadata = {
        "identity": identity,
        "history": json.dumps([asdict(past) for past in state.history]),
        "batch": str(state.batch),
    }
    publish_bytes(path, tensors_to_bytes(tensors, metadata))


def load_training_state(
    path: Path, identity: str, model: GaCnn, optimizer: torch.optim.AdamW, fresh: TrainingState
) -> TrainingState:
    """Load a saved state into network and optimizer.

    Parameters
    ----------
    path
        The file.
    identity
        All that the training's result depends on, as text.
    model
        Receives the saved weights.
    optimizer
        Receives the saved moments.
    fresh
        State of a training that begins.

    Returns
    -------
    The saved state; ``fresh`` where the file has another identity, and nothing is loaded.

    Raises
    ------
    ArtifactError
        The state is damaged.
    """
    tensors, metadata = tensors_from_bytes(path.read_bytes(), str(path))
    if metadata.get("identity") != identity:
        return fresh
    try:
        state = TrainingState(
            history=[EpochMetrics(**past) for past in json.loads(metadata["history"])],
            kept_weights={
                name: torch.zeros_like(given).copy_(tensors[f"kept/{name}"])
                for name, given in fresh.kept_weights.items()
            },
            batch=int(metadata["batch"]),
            sums=tensors["sums"].to(fresh.sums.device),
        )
        model.load_state_dict({name: tensors[f"model/{name}"] for name in model.state_dict()})
        for name, parameter in model.named_parameters():
            # In the parameter's own memory order, or the next step rounds differently.
            optimizer.state[parameter] = {
                key: torch.zeros_like(parameter).copy_(tensors[f"optimizer/{name}/{key}"])
                for key in ("exp_avg", "exp_avg_sq")
            }
            step = tensors[f"optimizer/{name}/step"].to(parameter.device)
            optimizer.state[parameter]["step"] = step
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        raise ArtifactError(
            f"{path} cannot be continued: {error}", "Delete it to train from the start."
        ) from error
    return state
