"""Decides most quality QPs by a few passes over the triangles, or leaves few triangles open.

In the numbers of `structured`, the dual of the problem is to minimise over pi and nu

    sum_j |h_j| - pi't0 + max over a <= t <= b of (pi't - 1/2 |k t - s Lambda|^2),

with h = M'pi + nu 1. Four ways out, the cheapest first:

1. One row cannot meet its limits whatever v is: infeasible, by Farkas' lemma along an axis.
2. The point of the limits nearest to Lambda is reached within the bounds of v, by the v of least
   squares: optimal, as no v comes nearer.
3. Newton's method on the dual with |h| rounded off to h^2 / (2 eps) + eps / 2 within eps, which
   is smaller at each pass. v is then -h / eps, cut off at its bounds. Where no v meets the
   limits, the dual falls without end, and pi ends as a certificate of Farkas' lemma.
4. When eps is so small that few triangles are within a few eps of h = 0, all others are put at
   their bounds, v = -sign h. `interior_point` solves for the few, and the duality gap over all
   triangles, at its multipliers, certifies the whole.

A problem that none of them decides goes to `interior_point` with all its triangles. Ways 2 and 3
stand in `newton`, the certificate of way 4 in `certificate`.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.gripper.compiled import compiled_finite
from pipeline.gripper.solvers.interior_point import FEASIBILITY_TOLERANCE, INFEASIBLE, SOLVED
from pipeline.gripper.solvers.newton import SIFTED, UNDECIDED, nearest_reached, rounded_off

# Passes with a smaller eps each; real problems take three to six until few triangles are left.
_PASSES = 9
# Few triangles whose v must sum to more than this share of their number are hardly the right few.
_MOST_OF_FEW = 0.95


@compiled_finite
def sift_into(
    wrench_matrices: Float[np.ndarray, "batch 4 most"],
    counts: Int[np.ndarray, " batch"],
    forces: Float[np.ndarray, " batch"],
    lower: Float[np.ndarray, " 4"],
    upper: Float[np.ndarray, " 4"],
    target: Float[np.ndarray, " 4"],
    scale: float,
    spread: float,
    max_iterations: int,
    weights: Float[np.ndarray, "batch most"],
    status: Int[np.ndarray, " batch"],
    iterations: Int[np.ndarray, " batch"],
    rows: Float[np.ndarray, "batch 4 room"],
    columns: Int[np.ndarray, "batch room"],
    left: Int[np.ndarray, " batch"],
    centres: Float[np.ndarray, "batch 4"],
    sums: Float[np.ndarray, " batch"],
    bounded: Bool[np.ndarray, "batch 4"],
) -> None:
    """Decide each problem, or leave `left` of its triangles open (SIFTED), or give up (UNDECIDED).

    Of a sifted problem `rows` holds the columns of M that are open, `columns` their numbers,
    `centres` t0 with the others at their bounds, `sums` the sum that the open v must have, and
    `weights` W of the others.
    """
    most = wrench_matrices.shape[2]
    work = np.empty((2, most))
    means = np.empty(4)
    t0 = np.empty(4)
    for i in range(counts.size):
        n = counts[i]
        left[i] = 0
        if n == 0 or forces[i] <= 0.0:
            status[i] = SOLVED
            iterations[i] = 0
            for j in range(n):
                weights[i, j] = 1.0
            continue
        matrix = wrench_matrices[i]
        v, h = work[0, :n], work[1, :n]
        unit = spread / forces[i]
        k = scale * forces[i]
        met = _limits(matrix, n, forces[i], unit, lower, upper, means, t0, bounded[i])
        for j in range(n):
            weights[i, j] = 1.0
        if not met:
            status[i] = INFEASIBLE
            iterations[i] = 0
            continue
        if max_iterations > 0 and nearest_reached(
            matrix, means, unit, t0, bounded[i], lower, upper, target, scale, k, v, h
        ):
            status[i] = SOLVED
            iterations[i] = 1
            for j in range(n):
                weights[i, j] = 1.0 + spread * v[j]
            continue
        status[i], iterations[i], within = rounded_off(
            matrix,
            means,
            unit,
            t0,
            bounded[i],
            lower,
            upper,
            target,
            scale,
            k,
            min(_PASSES, max_iterations - 1),
            v,
            h,
        )
        if status[i] != SIFTED:
            continue
        left[i], sums[i] = _set_aside(
            matrix,
            means,
            unit,
            t0,
            h,
            within,
            spread,
            v,
            weights[i],
            rows[i],
            columns[i],
            centres[i],
        )
        if abs(sums[i]) > _MOST_OF_FEW * left[i]:
            status[i] = UNDECIDED


@compiled_finite
def _set_aside(
    matrix: Float[np.ndarray, "4 most"],
    means: Float[np.ndarray, " 4"],
    unit: float,
    t0: Float[np.ndarray, " 4"],
    h: Float[np.ndarray, " n"],
    within: float,
    spread: float,
    v: Float[np.ndarray, " n"],
    weights: Float[np.ndarray, " most"],
    rows: Float[np.ndarray, "4 room"],
    columns: Int[np.ndarray, " room"],
    centre: Float[np.ndarray, " 4"],
) -> tuple[int, float]:
    """Put v of triangles with |h| beyond `within` at its bounds; gather the others.

    Returns how many are left, and what their v must sum to.
    """
    left = 0
    for j in range(h.size):
        if abs(h[j]) < within:
            columns[left] = j
            for r in range(4):
                rows[r, left] = (matrix[r, j] - means[r]) * unit
            left += 1
            v[j] = 0.0
        else:
            v[j] = -1.0 if h[j] > 0.0 else 1.0
        weights[j] = 1.0 + spread * v[j]
    total = 0.0
    for j in range(h.size):
        total += v[j]
    for r in range(4):
        pull = 0.0
        for j in range(h.size):
            pull += matrix[r, j] * v[j]
        centre[r] = t0[r] + unit * (pull - means[r] * total)
    return left, -total


@compiled_finite
def _limits(
    matrix: Float[np.ndarray, "4 most"],
    n: int,
    force: float,
    unit: float,
    lower: Float[np.ndarray, " 4"],
    upper: Float[np.ndarray, " 4"],
    means: Float[np.ndarray, " 4"],
    t0: Float[np.ndarray, " 4"],
    bounded: Bool[np.ndarray, " 4"],
) -> bool:
    """Row means, t0, which limits may bind; False where one row alone cannot meet its limits.

    |row of M v| is at most the sum of |M_j|: Farkas' condition with pi along one axis.
    """
    g_0, g_1, g_2, g_3 = matrix[0, :n], matrix[1, :n], matrix[2, :n], matrix[3, :n]
    s_0 = s_1 = s_2 = s_3 = 0.0
    for j in range(n):
        s_0 += g_0[j]
        s_1 += g_1[j]
        s_2 += g_2[j]
        s_3 += g_3[j]
    means[0], means[1], means[2], means[3] = s_0 / n, s_1 / n, s_2 / n, s_3 / n
    a_0, a_1, a_2, a_3 = means[0], means[1], means[2], means[3]
    r_0 = r_1 = r_2 = r_3 = 0.0
    for j in range(n):
        r_0 += abs(g_0[j] - a_0)
        r_1 += abs(g_1[j] - a_1)
        r_2 += abs(g_2[j] - a_2)
        r_3 += abs(g_3[j] - a_3)
    reaches = (r_0 * unit, r_1 * unit, r_2 * unit, r_3 * unit)
    met = True
    slack = 0.1 * FEASIBILITY_TOLERANCE
    for r in range(4):
        t0[r] = means[r] * n / force
        highest, least = t0[r] + reaches[r], t0[r] - reaches[r]
        if least > upper[r] + FEASIBILITY_TOLERANCE or highest < lower[r] - FEASIBILITY_TOLERANCE:
            met = False
        bounded[r] = highest > upper[r] + slack or least < lower[r] - slack
    return met
