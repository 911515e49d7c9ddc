"""An interior-point method for the quality QP that factors five rows.

The problem and its certificate of infeasibility are those of `structured`; here v may sum to
any `total`, and t0 may hold what other triangles at their bounds add. With multipliers pi
(t = t0 + M v), nu (sum), z_l, z_u (bounds on v), w_l, w_u (bounds on t), optimality reads

    M'pi + nu 1 - z_l + z_u = 0,      k (k t - s Lambda) - pi - w_l + w_u = 0,

and complementarity of each multiplier with its slack. Newton's step on it eliminates the
multipliers of the bounds: with the diagonals D = z_l/(1+v) + z_u/(1-v) and
E = k^2 + w_l/(t-a) + w_u/(b-t),

    M'dpi + 1 dnu + D dv = rho,       E dt - dpi = theta,
    M dv - dt = r_p,                  1'dv = r_s,

so dv = (rho - M'dpi - 1 dnu)/D and dt = (theta + dpi)/E leave a symmetric positive
definite 5 x 5 system for (dpi, dnu):

    [ M D^-1 M' + E^-1    M D^-1 1 ]         [ M D^-1 rho - theta/E - r_p ]
    [ 1'D^-1 M'           1'D^-1 1 ] (...) = [ 1'D^-1 rho - r_s           ].

Forming it is one pass over the triangles. The step is Mehrotra's predictor and corrector.
When the limits cannot be met the multipliers grow along a certificate of Farkas' lemma, so it
is tried with the multipliers of every iteration.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.gripper.compiled import compiled_finite
from pipeline.gripper.problem import GraspStatus
from pipeline.gripper.solvers.five_rows import factor, substitute
from pipeline.gripper.solvers.triangle_passes import (
    DV,
    I_L,
    I_U,
    P_L,
    P_U,
    WORK_ARRAYS,
    Z_L,
    Z_U,
    H,
    V,
    correct,
    form,
    move,
    predict,
    step_along,
)

SOLVED = int(GraspStatus.SOLVED)
INFEASIBLE = int(GraspStatus.INFEASIBLE)
MAX_ITERATIONS = int(GraspStatus.MAX_ITERATIONS)

# Limits count as met, or as certainly broken, to this much of F_v.
FEASIBILITY_TOLERANCE = 1e-9
# |s(GW - Lambda)| is wanted to this accuracy: q then has it too, as |dq| <= q |dr|.
RESIDUAL_TOLERANCE = 2e-8
# Below this |s(GW - Lambda)| the gap is held to an absolute bound: r within 2e-7.
CORNER = 1e-6


@compiled_finite
def solve_into(
    rows: Float[np.ndarray, "batch 4 most"],
    counts: Int[np.ndarray, " batch"],
    centres: Float[np.ndarray, "batch 4"],
    totals: Float[np.ndarray, " batch"],
    bounded: Bool[np.ndarray, "batch 4"],
    forces: Float[np.ndarray, " batch"],
    lower: Float[np.ndarray, " 4"],
    upper: Float[np.ndarray, " 4"],
    target: Float[np.ndarray, " 4"],
    scale: float,
    max_iterations: int,
    wanted: Bool[np.ndarray, " batch"],
    found: Float[np.ndarray, "batch most"],
    multipliers: Float[np.ndarray, "batch 5"],
    status: Int[np.ndarray, " batch"],
    iterations: Int[np.ndarray, " batch"],
) -> None:
    """v, with pi and nu, of the wanted problems, one after another in the same workspace.

    Problem i is made of the first counts[i] columns of M, and of t0 = centres[i]; its v sum to
    totals[i]. `lower` and `upper` are the bounds of t, where `bounded` says that they may bind.
    """
    work = np.empty((WORK_ARRAYS, rows.shape[2]))
    for i in range(counts.size):
        if not wanted[i]:
            continue
        n = counts[i]
        status[i], iterations[i] = _interior_point(
            centres[i],
            bounded[i],
            totals[i],
            scale * forces[i],
            lower,
            upper,
            target,
            scale,
            max_iterations,
            rows[i],
            work,
            n,
            multipliers[i],
        )
        for j in range(n):
            found[i, j] = work[V, j]


@compiled_finite
def _interior_point(
    t0: Float[np.ndarray, " 4"],
    bounded: Bool[np.ndarray, " 4"],
    total: float,
    k: float,
    lower: Float[np.ndarray, " 4"],
    upper: Float[np.ndarray, " 4"],
    target: Float[np.ndarray, " 4"],
    scale: float,
    max_iterations: int,
    rows: Float[np.ndarray, "4 most"],
    work: Float[np.ndarray, "work most"],
    n: int,
    multipliers: Float[np.ndarray, " 5"],
) -> tuple[int, int]:
    """Status and iterations; v is left in work[V], pi and nu in `multipliers`."""
    # Slices of exactly n elements let loops run without bounds on strides.
    m_0, m_1, m_2, m_3 = rows[0, :n], rows[1, :n], rows[2, :n], rows[3, :n]
    v, z_l, z_u, h = work[V, :n], work[Z_L, :n], work[Z_U, :n], work[H, :n]
    dv, p_l, p_u = work[DV, :n], work[P_L, :n], work[P_U, :n]
    i_l, i_u = work[I_L, :n], work[I_U, :n]
    t = np.empty(4)
    pi = multipliers
    w_l = np.zeros(4)
    w_u = np.zeros(4)
    nu = 0.0
    for r in range(4):
        t[r] = t0[r]
        if bounded[r]:
            margin = 0.05 * (upper[r] - lower[r])
            t[r] = min(max(t0[r], lower[r] + margin), upper[r] - margin)
        pi[r] = k * (k * t[r] - scale * target[r])
    reach = 0.0
    for j in range(n):
        h[j] = pi[0] * m_0[j] + pi[1] * m_1[j] + pi[2] * m_2[j] + pi[3] * m_3[j]
        reach += abs(h[j])
    shift = max(reach / n, 1e-4 / n)
    for j in range(n):
        v[j] = total / n
        z_l[j] = max(h[j], 0.0) + shift
        z_u[j] = max(-h[j], 0.0) + shift
        # The first move is of length 0.
        dv[j] = p_l[j] = p_u[j] = i_l[j] = i_u[j] = 0.0
    for r in range(4):
        if bounded[r]:
            w_l[r] = 0.05
            w_u[r] = 0.05

    system = np.empty((5, 5))
    right = np.empty(5)
    step = np.empty(5)
    dt = np.empty(4)
    e_inv = np.empty(4)
    theta = np.empty(4)
    c_l = np.zeros(4)
    c_u = np.zeros(4)
    alpha = 0.0
    for iteration in range(max_iterations + 1):
        # Move; residuals and the duality gap at this point.
        gap, dual, reach, s_v, p_0, p_1, p_2, p_3 = move(rows, work, n, pi, nu, alpha)
        r_p = (t[0] - t0[0] - p_0, t[1] - t0[1] - p_1, t[2] - t0[2] - p_2, t[3] - t0[3] - p_3)
        products = 2.0 * n
        residual = 0.0
        primal = 0.0
        farkas = -reach - nu * total
        size = 0.0
        for r in range(4):
            if bounded[r]:
                gap += w_l[r] * (t[r] - lower[r]) + w_u[r] * (upper[r] - t[r])
                products += 2.0
            y = k * t[r] - scale * target[r]
            dual += abs(k * y - pi[r] - w_l[r] + w_u[r])
            residual += y * y
            primal = max(primal, abs(r_p[r]))
            farkas += pi[r] * t0[r] - max(pi[r] * lower[r], pi[r] * upper[r])
            size += abs(pi[r])
        if farkas > FEASIBILITY_TOLERANCE * size:
            return INFEASIBLE, iteration
        residual = np.sqrt(residual)
        feasible = primal <= 0.1 * FEASIBILITY_TOLERANCE and k * primal <= 0.1 * RESIDUAL_TOLERANCE
        # 1/2 r^2 lies within the gap of its optimum, hence r within gap / r. At a perfect
        # seal r itself is the bound on its distance from 0.
        closed = gap + 2.0 * dual <= RESIDUAL_TOLERANCE * max(residual, CORNER)
        if feasible and (closed or residual <= RESIDUAL_TOLERANCE):
            multipliers[4] = nu
            return SOLVED, iteration
        if iteration == max_iterations:
            return MAX_ITERATIONS, iteration
        mu = gap / products

        # The 5 x 5 system, and the predictor's right side.
        form(rows, work, n, system, right)
        for r in range(4):
            e = k * k
            if bounded[r]:
                e += w_l[r] / (t[r] - lower[r]) + w_u[r] / (upper[r] - t[r])
            e_inv[r] = 1.0 / e
            system[r, r] += e_inv[r]
        factor(system)
        sigma_mu = 0.0
        for r in range(4):
            c_l[r] = 0.0
            c_u[r] = 0.0
        worst = 0.0
        for corrector in range(2):
            if corrector == 1:
                correct(rows, work, n, sigma_mu, right)
            for r in range(4):
                theta[r] = pi[r] - k * (k * t[r] - scale * target[r])
                if bounded[r]:
                    theta[r] += (sigma_mu - c_l[r]) / (t[r] - lower[r])
                    theta[r] -= (sigma_mu - c_u[r]) / (upper[r] - t[r])
                right[r] -= theta[r] * e_inv[r] + r_p[r]
            right[4] += s_v - total
            substitute(system, right, step)
            ahead = 0.0
            if corrector == 0:
                worst, ahead = predict(rows, work, n, step)
            else:
                worst = step_along(rows, work, n, step)
            for r in range(4):
                dt[r] = (theta[r] + step[r]) * e_inv[r]
                if bounded[r]:
                    s_l = t[r] - lower[r]
                    s_u = upper[r] - t[r]
                    dw_l = (sigma_mu - c_l[r] - w_l[r] * dt[r]) / s_l - w_l[r]
                    dw_u = (sigma_mu - c_u[r] + w_u[r] * dt[r]) / s_u - w_u[r]
                    worst = max(worst, -dt[r] / s_l, dt[r] / s_u)
                    worst = max(worst, -dw_l / w_l[r], -dw_u / w_u[r])
                    if corrector == 0:
                        c_l[r] = dt[r] * dw_l
                        c_u[r] = -dt[r] * dw_u
                        ahead += c_l[r] + c_u[r]
            if corrector == 0:
                # Each product of slack and multiplier goes from s z to (1 - a) s z + a^2 ds dz.
                alpha = 1.0 / max(worst, 1.0)
                ratio = max((1.0 - alpha) * gap + alpha * alpha * ahead, 0.0) / gap
                sigma_mu = mu * ratio * ratio * ratio
            else:
                alpha = min(1.0, 0.995 / max(worst, 1e-300))

        # Move what is not of a triangle.
        nu += alpha * step[4]
        for r in range(4):
            if bounded[r]:
                s_l = t[r] - lower[r]
                s_u = upper[r] - t[r]
                w_l[r] += alpha * ((sigma_mu - c_l[r] - w_l[r] * dt[r]) / s_l - w_l[r])
                w_u[r] += alpha * ((sigma_mu - c_u[r] + w_u[r] * dt[r]) / s_u - w_u[r])
            t[r] += alpha * dt[r]
            pi[r] += alpha * step[r]
    return MAX_ITERATIONS, max_iterations
