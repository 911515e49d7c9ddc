"""How a network is computed while it trains: device, precision, PyTorch's compiler."""

import os
import shutil
from collections.abc import Callable

import torch
from jaxtyping import Float
from torch import Tensor

from pipeline.config.learning import Precision
from pipeline.errors import ConfigError, MachineError
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.parallel import Ranks

Predict = Callable[[Float[Tensor, "b c h w"]], Float[Tensor, " b"]]  # canonical inputs to q-hat


def choose_device(wanted: str, ranks: Ranks) -> torch.device:
    """The device to train on: the GPU of this process's number, or the CPU.

    Parameters
    ----------
    wanted
        ``auto``, ``cpu`` or ``cuda``; ``auto`` takes a GPU where there is one.
    ranks
        This process's place among those that train together.

    Returns
    -------
    The device.

    Raises
    ------
    MachineError
        A GPU is asked for by name and there is none.
    """
    available = torch.cuda.is_available()
    if wanted == "cuda" and not available:
        raise MachineError(
            "train.device = 'cuda', and PyTorch finds no GPU", "Choose 'auto' or 'cpu'."
        )
    return (
        torch.device("cuda", ranks.local) if available and wanted != "cpu" else torch.device("cpu")
    )


def compile_network(model: GaCnn, device: torch.device, ranks: Ranks) -> Predict:
    """The same network, its steps joined by PyTorch's compiler; equal to it up to rounding.

    Parameters
    ----------
    model
        The network; the result has its very weights.
    device
        Where it lies.
    ranks
        Processes that train together.

    Returns
    -------
    The network as it is called in training. It is compiled when it is first called.

    Raises
    ------
    ConfigError
        More than one process trains: their shared norms are no part of one network.
    MachineError
        There is no C++ compiler.
    """
    if ranks.count > 1:
        raise ConfigError(
            f"train.compiled is for one process, and {ranks.count} train together",
            "Set train.compiled = false, or train without RANKS",
        )
    compiler = os.environ.get("CXX", "g++")  # what PyTorch looks for
    if device.type == "cpu" and shutil.which(compiler) is None:
        raise MachineError(
            f"train.compiled needs a C++ compiler, and there is no {compiler}",
            "Install g++ or name one in CXX, or set train.compiled = false",
        )
    # PyTorch compiles a function so many times and no more; those for networks before count.
    torch.compiler.reset()
    # Batches have two sizes at most: each gets a program of its own, which is quicker than one of
    # any size.
    compiled: Predict = torch.compile(model, dynamic=False)
    return compiled


def mixed_precision(device: torch.device, wanted: Precision) -> torch.autocast:
    """Use bfloat16 where it is wanted; its exponent is single precision's: no loss is scaled.

    Parameters
    ----------
    device
        Where the network lies.
    wanted
        ``mixed``, ``single``, or ``auto``: on a GPU alone.

    Returns
    -------
    The context to compute in.
    """
    enabled = wanted == "mixed" or (wanted == "auto" and device.type == "cuda")
    return torch.autocast(device.type, dtype=torch.bfloat16, enabled=enabled)
