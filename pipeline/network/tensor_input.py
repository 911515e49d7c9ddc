"""``canonical`` for arrays: what a predictor that runs without PyTorch takes from it at times."""

import numpy as np
import torch
from jaxtyping import Bool, Float

from pipeline.network.canonical import apply_symmetry, network_input
from pipeline.network.input_channels import Channels
from pipeline.network.reproducible import reproducible


def tensor_input(
    cloud: Float[np.ndarray, "n h w 3"], mask: Bool[np.ndarray, "n h w"], channels: Channels
) -> Float[np.ndarray, "n c h w"]:
    """`network_input` of arrays, of any known channels."""
    with reproducible(threads=1), torch.inference_mode():
        return network_input(torch.from_numpy(cloud), torch.from_numpy(mask), channels).numpy()


def turned_input(
    inputs: Float[np.ndarray, "n c h w"], element: int, channels: Channels
) -> Float[np.ndarray, "n c h w"]:
    """`apply_symmetry` of arrays, all by one element of the square's symmetries."""
    elements = torch.full((len(inputs),), element)
    return apply_symmetry(torch.from_numpy(inputs), elements, channels).numpy()
