"""Milliseconds a grasp of a network, as control asks and as training does."""

import os

from pipeline.config.learning import NetworkConfig
from pipeline.network.control_inference import ControlPredictor
from pipeline.network.export import check_export, export_onnx_bytes
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.samples import Samples
from pipeline.network.timing import runtimes_ms_a_grasp

BATCHES = (1, 64, 512)  # one grasp, a control step, and a bulk
THREADS = 2  # cores of the smallest machine that is supported
SECONDS = 3.0  # a batch size: the machine's own hiccups are shorter
CLOUDS = 512  # the largest batch that is timed
_CHECKED_BATCH = 64  # enough clouds to tell a wrong export


def sized_network(config: NetworkConfig, grid_cells: int) -> tuple[GaCnn, ControlPredictor]:
    """A network of this make and its export for clouds of ``grid_cells`` a side.

    Its weights are untrained and change no time.
    """
    network = build_network(config, seed=0).eval()
    threads = min(THREADS, os.cpu_count() or 1)
    return network, ControlPredictor(export_onnx_bytes(network, grid_cells), threads)


def figures(config: NetworkConfig, samples: Samples) -> dict[str, object]:
    """Milliseconds a grasp at the network's full size by runtime, and how far both differ."""
    network, exported = sized_network(config, samples.cloud.shape[1])
    cloud, mask = samples.cloud[:CLOUDS], samples.cloud_mask[:CLOUDS]
    times = runtimes_ms_a_grasp(network, exported, cloud, mask, THREADS, BATCHES, SECONDS)
    return {
        "inference_ms_a_grasp": {
            name: {size: round(value, 3) for size, value in found.items()}
            for name, found in times.items()
        },
        "inference_layers": config.layers,
        "inference_difference": check_export(
            exported, network, cloud, mask, _CHECKED_BATCH, THREADS
        ),
    }
