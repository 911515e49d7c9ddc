"""Milliseconds a grasp of a predictor, from cloud to quality."""

import time
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Bool, Float

from pipeline.network.control_inference import ControlPredictor
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.inference import predict

Predict = Callable[
    [Float[np.ndarray, "n h w 3"], Bool[np.ndarray, "n h w"]], Float[np.ndarray, " n"]
]

_SECONDS = 0.2  # a batch size is timed for so long at least
_FEWEST_CALLS = 3  # so that a median has a meaning


def milliseconds_a_grasp(
    predict: Predict,
    cloud: Float[np.ndarray, "n h w 3"],
    mask: Bool[np.ndarray, "n h w"],
    batches: Sequence[int],
    seconds: float = _SECONDS,
) -> dict[str, float]:
    """Median time of a call over its grasps, for several batch sizes; the first call is left out.

    Parameters
    ----------
    predict
        Clouds and masks to quality, as one batch.
    cloud
        Grasps to predict, shape (n, h, w, 3); repeated where a batch is larger.
    mask
        Their measured cells, shape (n, h, w).
    batches
        Batch sizes.
    seconds
        Each batch size is called for this long [s], and at least three times.

    Returns
    -------
    Batch size, as text → milliseconds a grasp.
    """
    figures = {}
    for size in batches:
        rows = np.arange(size) % len(cloud)
        clouds, masks = np.ascontiguousarray(cloud[rows]), np.ascontiguousarray(mask[rows])
        predict(clouds, masks)
        times: list[float] = []
        while len(times) < _FEWEST_CALLS or sum(times) < seconds:
            started = time.perf_counter()
            predict(clouds, masks)
            times.append(time.perf_counter() - started)
        figures[str(size)] = 1e3 * float(np.median(times)) / size
    return figures


def runtimes_ms_a_grasp(
    network: GaCnn,
    exported: ControlPredictor,
    cloud: Float[np.ndarray, "n h w 3"],
    mask: Bool[np.ndarray, "n h w"],
    threads: int,
    batches: Sequence[int],
    seconds: float = _SECONDS,
) -> dict[str, dict[str, float]]:
    """Milliseconds a grasp on the CPU of PyTorch and of OpenVINO, one prediction a grasp.

    Parameters
    ----------
    network
        The trained network; runs on ``threads`` threads of PyTorch.
    exported
        The same network for OpenVINO, on the threads that it was opened with.
    cloud
        Grasps to predict, shape (n, h, w, 3); repeated where a batch is larger.
    mask
        Their measured cells, shape (n, h, w).
    threads
        Threads of PyTorch.
    batches
        Batch sizes.
    seconds
        Each batch size is called for this long [s], and at least three times.

    Returns
    -------
    Runtime → batch size, as text → milliseconds a grasp.
    """

    def trained(
        clouds: Float[np.ndarray, "b h w 3"], masks: Bool[np.ndarray, "b h w"]
    ) -> Float[np.ndarray, " b"]:
        return predict(network, clouds, masks, len(clouds), threads, average_symmetries=False)

    runtimes: dict[str, Predict] = {"openvino": exported.predict, "pytorch": trained}
    return {
        name: milliseconds_a_grasp(run, cloud, mask, batches, seconds)
        for name, run in runtimes.items()
    }
