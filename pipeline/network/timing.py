"""Milliseconds a grasp, as a caller of a predictor sees it: cloud in, quality out."""

import time
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Bool, Float

Predict = Callable[
    [Float[np.ndarray, "n h w 3"], Bool[np.ndarray, "n h w"]], Float[np.ndarray, " n"]
]

BATCHES = (1, 64, 512)
_SECONDS = 0.2
_FEWEST_CALLS = 3


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
    predict : clouds and masks to quality, as one batch.
    cloud, mask : grasps to predict; repeated where a batch is larger.
    seconds : so long, and at least three times, each batch size is called.
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
