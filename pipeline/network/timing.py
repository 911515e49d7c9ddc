"""Milliseconds a grasp, as a caller of a predictor sees it: cloud in, quality out."""

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

BATCHES = (1, 64, 512)  # one grasp, a control step, and a bulk
_SECONDS = 0.2  # a batch size is timed for so long at least
_FEWEST_CALLS = 3  # so that a median has a meaning


def milliseconds_a_grasp(
    predict: Predict,
    cloud: Float[np.ndarray, "n h w 3"],
    mask: Bool[np.ndarray, "n h w"],
    batches: Sequence[int] = BATCHES,
    seconds: float = _SECONDS,
) -> dict[str, float]:
    """Batch size → median time of a call over its grasps; the first call is left out.

    Parameters
    ----------
    predict
        Clouds and masks to quality, as one batch.
    cloud, mask
        Grasps to predict; repeated where a batch is larger.
    seconds
        So long, and at least three times, each batch size is called.
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
    batches: Sequence[int] = BATCHES,
    seconds: float = _SECONDS,
) -> dict[str, dict[str, float]]:
    """Runtime to batch size to milliseconds a grasp on the CPU, one prediction a grasp.

    Parameters
    ----------
    network
        As it was trained; runs on ``threads`` threads of PyTorch.
    exported
        The same network for OpenVINO, on the threads that it was opened with.
    cloud, mask
        Grasps to predict; repeated where a batch is larger.
    threads
        Threads of PyTorch.
    batches, seconds
        See `milliseconds_a_grasp`.
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
