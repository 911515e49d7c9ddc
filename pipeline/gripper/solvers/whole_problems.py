"""Problems that are solved with all their triangles: what sifting could not decide.

Sums are those of NumPy to the last bit: `pairwise_sum` adds in its order.
"""

import numpy as np
from jaxtyping import Float, Int

from pipeline.gripper.compiled import compiled
from pipeline.gripper.problem import GraspStatus

INFEASIBLE = int(GraspStatus.INFEASIBLE)

_LANES = 8  # sums that NumPy keeps side by side
_BLOCK = 128  # summands up to which it keeps them, and halves more


@compiled
def pairwise_sum(values: Float[np.ndarray, " n"]) -> float:
    """Sum of contiguous values, in the order in which `numpy.sum` adds them."""
    n = values.size
    if n < _LANES:
        total = 0.0
        for i in range(n):
            total += values[i]
        return float(total)
    if n <= _BLOCK:
        lanes = np.empty(_LANES)
        for k in range(_LANES):
            lanes[k] = values[k]
        whole = n - n % _LANES
        for i in range(_LANES, whole, _LANES):
            for k in range(_LANES):
                lanes[k] += values[i + k]
        left = (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
        total = left + ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]))
        for i in range(whole, n):
            total += values[i]
        return float(total)
    half = n // 2
    half -= half % _LANES
    return pairwise_sum(values[:half]) + pairwise_sum(values[half:])


@compiled
def form_into(
    wrench_matrices: Float[np.ndarray, "batch 4 most"],
    counts: Int[np.ndarray, " batch"],
    forces: Float[np.ndarray, " batch"],
    spread: float,
    chosen: Int[np.ndarray, " k"],
    rows: Float[np.ndarray, "k 4 most"],
    centres: Float[np.ndarray, "k 4"],
) -> None:
    """M and t0 of the chosen problems, as `structured` defines them, are written."""
    for at in range(chosen.size):
        i = chosen[at]
        n = counts[i]
        for axis in range(4):
            row = rows[at, axis, :n]
            for j in range(n):
                row[j] = wrench_matrices[i, axis, j] / forces[i]
            total = pairwise_sum(row)
            centres[at, axis] = total
            mean = total / n
            for j in range(n):
                row[j] = spread * (row[j] - mean)


@compiled
def write_into(
    chosen: Int[np.ndarray, " k"],
    counts: Int[np.ndarray, " batch"],
    spread: float,
    found: Float[np.ndarray, "k most"],
    status: Int[np.ndarray, " batch"],
    weights: Float[np.ndarray, "batch most"],
) -> None:
    """W of the chosen problems is written, from v: 1 where it is INFEASIBLE."""
    for at in range(chosen.size):
        i = chosen[at]
        infeasible = status[i] == INFEASIBLE
        for j in range(counts[i]):
            weights[i, j] = 1.0 if infeasible else 1.0 + spread * found[at, j]
