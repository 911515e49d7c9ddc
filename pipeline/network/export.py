"""GA-CNN for control as ONNX bytes, and the check that they predict what the network does."""

import copy

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from pipeline.errors import ArtifactError
from pipeline.network.control_inference import ControlPredictor
from pipeline.network.exported import REMEDY, marks_of
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.inference import predict
from pipeline.network.traced import optimized_graph, strip_origins

# What another runtime may change of a prediction: other orders of summation, no more.
LARGEST_DIFFERENCE = 1e-4


def export_onnx_bytes(network: GaCnn, cells: int) -> bytes:
    """Export a network as ONNX for canonical inputs of any batch; equal networks give equal bytes.

    A network of this shape is traced once and its graph kept, see `pipeline.network.traced`; what
    the weights decide, such as the folding of norms into convolutions, is done each time.

    Parameters
    ----------
    network
        The network; it is not changed.
    cells
        Cells a side of the clouds that it will predict.

    Returns
    -------
    The bytes, those that the exporter makes of the network in one go.
    """
    network = _without_matrix_products(network).eval()
    network = network.to(memory_format=torch.contiguous_format)  # type: ignore[call-overload]
    model = optimized_graph(network, cells)
    strip_origins(model)
    for key, value in marks_of(network.channels).items():
        model.metadata_props.add(key=key, value=value)
    data: bytes = model.SerializeToString(deterministic=True)
    return data


def check_export(
    predictor: ControlPredictor,
    network: GaCnn,
    cloud: Float[np.ndarray, "n h w 3"],
    mask: Bool[np.ndarray, "n h w"],
    batch_size: int,
    threads: int,
) -> float:
    """Largest |q̂ of the export − q̂ of the network| over sample clouds.

    Parameters
    ----------
    predictor
        The exported network.
    network
        The network that it was exported from.
    cloud
        Points in GCS in units of r_G, shape (n, h, w, 3).
    mask
        Cells that hold a measured point, shape (n, h, w).
    batch_size
        Clouds that ``network`` predicts at a time.
    threads
        Threads that ``network`` runs on.

    Returns
    -------
    The difference.

    Raises
    ------
    ArtifactError
        It exceeds 1e-4.
    """
    exported = predictor.predict(cloud, mask)
    expected = predict(network, cloud, mask, batch_size, threads, average_symmetries=False)
    difference = float(np.abs(exported - expected).max())
    if not difference <= LARGEST_DIFFERENCE:
        raise ArtifactError(
            f"exported network differs from its original by {difference:.2g} in quality, "
            f"more than {LARGEST_DIFFERENCE:.0e}",
            REMEDY,
        )
    return difference


class _OneCell(nn.Module):
    """A fully connected layer as the 1×1 convolution of a map of one cell, which is the same.

    OpenVINO packs a convolution's weights when it loads them, those of a small matrix product at
    each call: for the 74 layers of a 52-layer network that is a tenth of a prediction's time.
    """

    def __init__(self, layer: nn.Linear) -> None:
        super().__init__()
        self.kernel = nn.Parameter(layer.weight[:, :, None, None])
        self.bias = layer.bias

    def forward(self, x: Float[Tensor, "b c"]) -> Float[Tensor, "b d"]:
        """The layer's output."""
        cell = nn.functional.conv2d(x.unsqueeze(2).unsqueeze(3), self.kernel, self.bias)
        return cell.squeeze(3).squeeze(2)


def _without_matrix_products(network: GaCnn) -> GaCnn:
    """A copy whose fully connected layers are `_OneCell`s."""
    network = copy.deepcopy(network)
    for module in list(network.modules()):
        for name, layer in module.named_children():
            if isinstance(layer, nn.Linear):
                setattr(module, name, _OneCell(layer))
    return network
