"""Predicted quality of many clouds, in batches on the CPU."""

import numpy as np
import torch
from jaxtyping import Bool, Float

from pipeline.network.canonical import network_input, turn_batch
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.input_channels import SYMMETRIES
from pipeline.network.reproducible import reproducible


def predict(
    model: GaCnn,
    cloud: Float[np.ndarray, "n h w 3"],
    mask: Bool[np.ndarray, "n h w"],
    batch_size: int,
    threads: int,
    average_symmetries: bool,
) -> Float[np.ndarray, " n"]:
    """Predicted quality q̂ in [0, 1] of sample clouds.

    Parameters
    ----------
    model
        The network.
    cloud
        Points in GCS in units of r_G, shape (n, h, w, 3), grid as in ``canonical``.
    mask
        Cells that hold a measured point, shape (n, h, w).
    batch_size
        Clouds at a time.
    threads
        Threads of PyTorch.
    average_symmetries
        Mean over the eight turns and mirrors under which q does not change: a lower error at
        eight times the cost.

    Returns
    -------
    q̂ in single precision, shape (n,).
    """
    model.eval()
    predicted = np.empty(len(cloud), dtype=np.float32)
    elements = range(SYMMETRIES) if average_symmetries else range(1)
    with reproducible(threads), torch.inference_mode():
        for start in range(0, len(cloud), batch_size):
            part = slice(start, start + batch_size)
            inputs = network_input(
                torch.from_numpy(cloud[part]), torch.from_numpy(mask[part]), model.channels
            )
            outputs = [model(turn_batch(inputs, g, model.channels)) for g in elements]
            predicted[part] = torch.stack(outputs).mean(dim=0).numpy()
    return predicted
