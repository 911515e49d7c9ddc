"""A small network that is kept with its answers, so that nothing is trained before they compare.

What it predicts for kept samples holds the network's input, its layers and its file format; its
error on a run's own samples holds pictures, noise and sub clouds together with the labels.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact
from pipeline.messages.samples import read_samples as read_batches
from pipeline.messages.samples import write_samples as write_batches
from pipeline.network.checkpoint import load_checkpoint_bytes
from pipeline.network.control_inference import ControlPredictor
from pipeline.network.export import export_onnx_bytes
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.inference import predict
from pipeline.network.samples import Samples, join_samples

BATCH = 64  # samples predicted at a time


def read_network(path: Path) -> GaCnn:
    """The kept network, ready to predict."""
    return load_checkpoint_bytes(path.read_bytes())


def write_samples(path: Path, provenance: Provenance, samples: Samples) -> None:
    """Keep some samples; the names of their objects do not matter here."""
    with ArtifactWriter(path, provenance) as artifact:
        names = tuple(f"object {number}" for number in range(int(samples.object_index.max()) + 1))
        write_batches(artifact, samples, names, size=len(samples))


def read_samples(path: Path) -> Samples:
    """The kept samples."""
    with open_artifact(path) as artifact:
        return join_samples(list(read_batches(artifact)))  # a copy, not a view


def spread_over_quality(samples: Samples, count: int) -> Samples:
    """So many samples from the worst to the best, equally far apart in the order of q."""
    order = np.argsort(samples.quality, kind="stable")
    return samples.take(np.sort(order[np.linspace(0, len(order) - 1, count).round().astype(int)]))


def predictions(network: GaCnn, samples: Samples) -> Float[np.ndarray, " n"]:
    """q̂ of each sample by PyTorch, without averaging over the symmetries."""
    return predict(
        network, samples.cloud, samples.cloud_mask, BATCH, threads=1, average_symmetries=False
    )


def control_predictions(network: GaCnn, samples: Samples) -> Float[np.ndarray, " n"]:
    """q̂ of each sample by the export that control runs."""
    predictor = ControlPredictor(export_onnx_bytes(network, samples.cloud.shape[1]), threads=1)
    return predictor.predict(samples.cloud, samples.cloud_mask)


def error_on(network: GaCnn, samples: Samples) -> float:
    """Mean |q̂ − q| of the network on samples of a run."""
    return float(np.abs(predictions(network, samples) - samples.quality).astype(np.float64).mean())
