"""Whether few triangles' answer, with all others at their bounds, is optimal for the whole problem.

A point within its bounds is optimal to the duality gap at any multipliers pi and nu: here those
that `interior_point` found for the few triangles that `sifting` left open.
"""

import numpy as np
from jaxtyping import Float, Int

from pipeline.gripper.compiled import compiled_finite
from pipeline.gripper.solvers.interior_point import CORNER, RESIDUAL_TOLERANCE, SOLVED
from pipeline.gripper.solvers.newton import SIFTED, UNDECIDED


@compiled_finite
def certify_into(
    wrench_matrices: Float[np.ndarray, "batch 4 most"],
    counts: Int[np.ndarray, " batch"],
    forces: Float[np.ndarray, " batch"],
    target: Float[np.ndarray, " 4"],
    scale: float,
    spread: float,
    max_iterations: int,
    columns: Int[np.ndarray, "batch room"],
    left: Int[np.ndarray, " batch"],
    found: Float[np.ndarray, "batch room"],
    multipliers: Float[np.ndarray, "batch 5"],
    found_status: Int[np.ndarray, " batch"],
    found_iterations: Int[np.ndarray, " batch"],
    weights: Float[np.ndarray, "batch most"],
    status: Int[np.ndarray, " batch"],
    iterations: Int[np.ndarray, " batch"],
) -> None:
    """SOLVED where the few triangles' v, with the others at their bounds, is optimal for all.

    What the gap of the few leaves out is the sum of |h| + h v over the others: 0 where each lies
    at the bound that the sign of its h asks for.
    """
    for i in range(counts.size):
        if status[i] != SIFTED:
            continue
        status[i] = UNDECIDED
        if found_status[i] != SOLVED or iterations[i] + found_iterations[i] > max_iterations:
            continue
        n = counts[i]
        unit = spread / forces[i]
        e_0, e_1 = unit * multipliers[i, 0], unit * multipliers[i, 1]
        e_2, e_3 = unit * multipliers[i, 2], unit * multipliers[i, 3]
        s_0 = s_1 = s_2 = s_3 = 0.0
        g_0, g_1 = wrench_matrices[i, 0, :n], wrench_matrices[i, 1, :n]
        g_2, g_3 = wrench_matrices[i, 2, :n], wrench_matrices[i, 3, :n]
        w = weights[i, :n]
        for j in range(n):
            s_0 += g_0[j]
            s_1 += g_1[j]
            s_2 += g_2[j]
            s_3 += g_3[j]
        nu = multipliers[i, 4] - (e_0 * s_0 + e_1 * s_1 + e_2 * s_2 + e_3 * s_3) / n
        gap = 0.0
        for j in range(n):
            h = e_0 * g_0[j] + e_1 * g_1[j] + e_2 * g_2[j] + e_3 * g_3[j] + nu
            # W is 1 where v is still open: those are in the gap of the few already.
            v = (w[j] - 1.0) / spread
            gap += abs(h) * abs(v) + h * v
        for c in range(left[i]):
            w[columns[i, c]] = 1.0 + spread * found[i, c]
        distance = 0.0
        p_0 = p_1 = p_2 = p_3 = 0.0
        for j in range(n):
            p_0 += g_0[j] * w[j]
            p_1 += g_1[j] * w[j]
            p_2 += g_2[j] * w[j]
            p_3 += g_3[j] * w[j]
        distance += (p_0 - target[0]) ** 2 + (p_1 - target[1]) ** 2
        distance += (p_2 - target[2]) ** 2 + (p_3 - target[3]) ** 2
        if gap <= RESIDUAL_TOLERANCE * max(scale * np.sqrt(distance), CORNER):
            status[i] = SOLVED
            iterations[i] += found_iterations[i]
