"""The quality QP by an interior-point method that factors five rows.

Everything in Eq. (8)-(14) but the bounds on W depends on W through five numbers: GW and
the sum. With v = (W - 1) / sigma_W, so that sum v = 0 and -1 <= v <= 1, and t = GW / F_v:

    minimise 1/2 |k t - s Lambda|^2,  k = s F_v
    over v, t  with  t = t0 + M v,  1'v = 0,  -1 <= v <= 1,  a <= t <= b,

where t0 = G 1 / F_v, M = sigma_W (G - row means) / F_v (taking the means off changes
nothing, as v sums to 0) and a, b are the bounds of Eq. (8)-(11) over F_v. With multipliers
pi (t = t0 + M v), nu (sum), z_l, z_u (bounds on v), w_l, w_u (bounds on t), optimality reads

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

Infeasibility is certified, not guessed. For every pi and nu (Farkas' lemma), if

    pi't0 - sum_j |(M'pi + nu 1)_j|  >  max over a <= t <= b of pi't,

no v within its bounds meets the limits; the left side is a lower bound of pi't over them.
When the limits cannot be met the multipliers grow along such a certificate, so it is
tried with the multipliers of every iteration, and with the four axes before the first.
The same sums show which limits can never bind: those are dropped, which also leaves an
interior to problems whose F_z cannot vary at all.
"""

import numpy as np
from jaxtyping import Float, Int

from pipeline.gripper.compiled import compiled_finite
from pipeline.gripper.problem import GraspStatus, QpSolution, QualityProblem

SOLVED = int(GraspStatus.SOLVED)
INFEASIBLE = int(GraspStatus.INFEASIBLE)
MAX_ITERATIONS = int(GraspStatus.MAX_ITERATIONS)

# Limits count as met, or as certainly broken, to this much of F_v.
FEASIBILITY_TOLERANCE = 1e-9
# |s(GW - Lambda)| is wanted to this accuracy: q then has it too, as |dq| <= q |dr|.
RESIDUAL_TOLERANCE = 2e-8
# Below this |s(GW - Lambda)| the gap is held to an absolute bound: r within 2e-7.
CORNER = 1e-6
_WORK_ARRAYS = 9


def solve(problem: QualityProblem) -> QpSolution:
    """Solve Eq. (14) by the method of this module."""
    n = problem.wrench_matrix.shape[1]
    force = problem.vacuum_force
    if force <= 0.0:
        return QpSolution(np.ones(n), GraspStatus.SOLVED, 0)
    weights = np.empty((1, n))
    status = np.empty(1, dtype=np.int64)
    iterations = np.empty(1, dtype=np.int64)
    solve_into(
        np.ascontiguousarray(problem.wrench_matrix, dtype=np.float64)[None],
        np.array([n]),
        np.array([force]),
        problem.lower / force,
        problem.upper / force,
        problem.target,
        problem.scale,
        problem.weight_spread,
        problem.max_iterations,
        weights,
        status,
        iterations,
    )
    return QpSolution(weights[0], GraspStatus(int(status[0])), int(iterations[0]))


@compiled_finite
def solve_into(
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
) -> None:
    """Solve many problems one after another in the same workspace.

    Problem i is made of the first counts[i] columns; its bounds on GW are forces[i]
    times `lower` and `upper`. A problem with forces[i] = 0 has G = 0 and W = 1.
    """
    most = wrench_matrices.shape[2]
    rows = np.empty((4, most))
    work = np.empty((_WORK_ARRAYS, most))
    for i in range(counts.size):
        n = counts[i]
        for j in range(n):
            weights[i, j] = 1.0
        status[i] = SOLVED
        iterations[i] = 0
        if n == 0 or forces[i] <= 0.0:
            continue
        status[i], iterations[i] = _interior_point(
            wrench_matrices[i],
            n,
            forces[i],
            lower,
            upper,
            target,
            scale,
            spread,
            max_iterations,
            rows,
            work,
        )
        if status[i] != INFEASIBLE:
            for j in range(n):
                weights[i, j] = 1.0 + spread * work[0, j]


@compiled_finite
def _interior_point(
    wrench_matrix: Float[np.ndarray, "4 most"],
    n: int,
    force: float,
    lower: Float[np.ndarray, " 4"],
    upper: Float[np.ndarray, " 4"],
    target: Float[np.ndarray, " 4"],
    scale: float,
    spread: float,
    max_iterations: int,
    rows: Float[np.ndarray, "4 most"],
    work: Float[np.ndarray, "work most"],
) -> tuple[int, int]:
    """Status and iterations; v is left in work[0]."""
    # Slices of exactly n elements let the loops below run without bounds on strides.
    v, z_l, z_u = work[0, :n], work[1, :n], work[2, :n]
    h, d_inv, rho, dv = work[3, :n], work[4, :n], work[5, :n], work[6, :n]
    p_l, p_u = work[7, :n], work[8, :n]
    m_0, m_1, m_2, m_3 = rows[0, :n], rows[1, :n], rows[2, :n], rows[3, :n]
    t0 = np.empty(4)
    bounded = np.empty(4, dtype=np.bool_)
    for r in range(4):
        verdict = _centre_row(wrench_matrix[r, :n], rows[r, :n], force, spread, lower[r], upper[r])
        t0[r] = verdict[0]
        bounded[r] = verdict[1] > 0.0
        if verdict[1] < 0.0:
            return INFEASIBLE, 0

    k = scale * force
    t = np.empty(4)
    pi = np.empty(4)
    w_l = np.zeros(4)
    w_u = np.zeros(4)
    nu = 0.0
    for r in range(4):
        t[r] = t0[r]
        if bounded[r]:
            margin = 0.05 * (upper[r] - lower[r])
            t[r] = min(max(t0[r], lower[r] + margin), upper[r] - margin)
        pi[r] = k * (k * t[r] - scale * target[r])
    total = 0.0
    for j in range(n):
        h[j] = pi[0] * m_0[j] + pi[1] * m_1[j] + pi[2] * m_2[j] + pi[3] * m_3[j]
        total += abs(h[j])
    shift = max(total / n, 1e-4 / n)
    for j in range(n):
        v[j] = 0.0
        z_l[j] = max(h[j], 0.0) + shift
        z_u[j] = max(-h[j], 0.0) + shift
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
    for iteration in range(max_iterations + 1):
        # Residuals and the duality gap at this point.
        gap = 0.0
        dual = 0.0
        reach = 0.0
        s_v = 0.0
        p_0 = 0.0
        p_1 = 0.0
        p_2 = 0.0
        p_3 = 0.0
        for j in range(n):
            hj = pi[0] * m_0[j] + pi[1] * m_1[j] + pi[2] * m_2[j] + pi[3] * m_3[j] + nu
            h[j] = hj
            gap += z_l[j] * (1.0 + v[j]) + z_u[j] * (1.0 - v[j])
            dual += abs(hj - z_l[j] + z_u[j])
            reach += abs(hj)
            s_v += v[j]
            p_0 += m_0[j] * v[j]
            p_1 += m_1[j] * v[j]
            p_2 += m_2[j] * v[j]
            p_3 += m_3[j] * v[j]
        r_p = (t[0] - t0[0] - p_0, t[1] - t0[1] - p_1, t[2] - t0[2] - p_2, t[3] - t0[3] - p_3)
        products = 2.0 * n
        residual = 0.0
        primal = 0.0
        farkas = -reach
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
            return SOLVED, iteration
        if iteration == max_iterations:
            return MAX_ITERATIONS, iteration
        mu = gap / products

        # The 5 x 5 system, and the predictor's right side.
        _form(m_0, m_1, m_2, m_3, v, z_l, z_u, d_inv, system)
        for r in range(4):
            e = k * k
            if bounded[r]:
                e += w_l[r] / (t[r] - lower[r]) + w_u[r] / (upper[r] - t[r])
            e_inv[r] = 1.0 / e
            system[r, r] += e_inv[r]
        _factor(system)
        for j in range(n):
            rho[j] = -h[j]
        sigma_mu = 0.0
        for r in range(4):
            c_l[r] = 0.0
            c_u[r] = 0.0
        worst = 0.0
        alpha = 1.0
        for corrector in range(2):
            _project(m_0, m_1, m_2, m_3, d_inv, rho, right)
            for r in range(4):
                theta[r] = pi[r] - k * (k * t[r] - scale * target[r])
                if bounded[r]:
                    theta[r] += (sigma_mu - c_l[r]) / (t[r] - lower[r])
                    theta[r] -= (sigma_mu - c_u[r]) / (upper[r] - t[r])
                right[r] -= theta[r] * e_inv[r] + r_p[r]
            right[4] += s_v
            _substitute(system, right, step)
            _step_v(m_0, m_1, m_2, m_3, d_inv, rho, step, dv)
            if corrector == 0:
                worst = _blocking_predictor(v, dv)
            else:
                worst = _blocking_corrector(v, z_l, z_u, p_l, p_u, dv)
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
            if corrector == 0:
                alpha = 1.0 / max(worst, 1.0)
                ahead = _gap_ahead(v, z_l, z_u, dv, alpha)
                for r in range(4):
                    if bounded[r]:
                        s_l = t[r] - lower[r]
                        s_u = upper[r] - t[r]
                        dw_l = -w_l[r] * dt[r] / s_l - w_l[r]
                        dw_u = w_u[r] * dt[r] / s_u - w_u[r]
                        ahead += (w_l[r] + alpha * dw_l) * (s_l + alpha * dt[r])
                        ahead += (w_u[r] + alpha * dw_u) * (s_u - alpha * dt[r])
                ratio = max(ahead, 0.0) / gap
                sigma_mu = mu * ratio * ratio * ratio
                _correct(v, z_l, z_u, h, dv, sigma_mu, p_l, p_u, rho)
            else:
                alpha = min(1.0, 0.995 / max(worst, 1e-300))

        # Move.
        _advance(v, z_l, z_u, p_l, p_u, dv, alpha)
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


@compiled_finite
def _centre_row(
    row: Float[np.ndarray, " n"],
    centred: Float[np.ndarray, " n"],
    force: float,
    spread: float,
    lower: float,
    upper: float,
) -> tuple[float, float]:
    """Row of M, its t0, and a verdict on its limits: 1 may bind, 0 never, -1 never met.

    |row of M v| is at most the sum of |M_j|: Farkas' condition with pi along one axis.
    """
    total = 0.0
    for j in range(row.size):
        total += row[j]
    mean = total / row.size
    reach = 0.0
    for j in range(row.size):
        centred[j] = (row[j] - mean) * (spread / force)
        reach += abs(centred[j])
    middle = total / force
    if middle - reach > upper + FEASIBILITY_TOLERANCE:
        return middle, -1.0
    if middle + reach < lower - FEASIBILITY_TOLERANCE:
        return middle, -1.0
    slack = 0.1 * FEASIBILITY_TOLERANCE
    if middle + reach <= upper + slack and middle - reach >= lower - slack:
        return middle, 0.0
    return middle, 1.0


@compiled_finite
def _form(
    m_0: Float[np.ndarray, " n"],
    m_1: Float[np.ndarray, " n"],
    m_2: Float[np.ndarray, " n"],
    m_3: Float[np.ndarray, " n"],
    v: Float[np.ndarray, " n"],
    z_l: Float[np.ndarray, " n"],
    z_u: Float[np.ndarray, " n"],
    d_inv: Float[np.ndarray, " n"],
    system: Float[np.ndarray, "5 5"],
) -> None:
    """D^-1 and the lower triangle of [M; 1'] D^-1 [M; 1']'."""
    for j in range(v.size):
        a_l = 1.0 + v[j]
        a_u = 1.0 - v[j]
        # The floor keeps D invertible where a weight is all but free; it damps the
        # step a little and leaves the point the iterations end at unchanged.
        d_inv[j] = a_l * a_u / (z_l[j] * a_u + z_u[j] * a_l + 1e-14 * a_l * a_u)
    s_00 = s_10 = s_11 = s_20 = s_21 = s_22 = 0.0
    s_30 = s_31 = s_32 = s_33 = s_40 = s_41 = s_42 = s_43 = s_44 = 0.0
    for j in range(v.size):
        d = d_inv[j]
        d_0 = d * m_0[j]
        d_1 = d * m_1[j]
        d_2 = d * m_2[j]
        d_3 = d * m_3[j]
        s_00 += d_0 * m_0[j]
        s_10 += d_0 * m_1[j]
        s_20 += d_0 * m_2[j]
        s_30 += d_0 * m_3[j]
        s_40 += d_0
        s_11 += d_1 * m_1[j]
        s_21 += d_1 * m_2[j]
        s_31 += d_1 * m_3[j]
        s_41 += d_1
        s_22 += d_2 * m_2[j]
        s_32 += d_2 * m_3[j]
        s_42 += d_2
        s_33 += d_3 * m_3[j]
        s_43 += d_3
        s_44 += d
    system[0, 0] = s_00
    system[1, 0], system[1, 1] = s_10, s_11
    system[2, 0], system[2, 1], system[2, 2] = s_20, s_21, s_22
    system[3, 0], system[3, 1], system[3, 2], system[3, 3] = s_30, s_31, s_32, s_33
    system[4, 0], system[4, 1], system[4, 2] = s_40, s_41, s_42
    system[4, 3], system[4, 4] = s_43, s_44


@compiled_finite
def _factor(system: Float[np.ndarray, "5 5"]) -> None:
    """Cholesky factor in place; a pivot lost to rounding stops its row from moving."""
    for i in range(5):
        diagonal = system[i, i]
        for c in range(i + 1):
            value = system[i, c]
            for e in range(c):
                value -= system[i, e] * system[c, e]
            if c < i:
                system[i, c] = value / system[c, c]
            else:
                system[i, i] = np.sqrt(value) if value > 1e-15 * diagonal else 1e100


@compiled_finite
def _substitute(
    factor: Float[np.ndarray, "5 5"],
    right: Float[np.ndarray, " 5"],
    solution: Float[np.ndarray, " 5"],
) -> None:
    for i in range(5):
        value = right[i]
        for c in range(i):
            value -= factor[i, c] * solution[c]
        solution[i] = value / factor[i, i]
    for i in range(4, -1, -1):
        value = solution[i]
        for c in range(i + 1, 5):
            value -= factor[c, i] * solution[c]
        solution[i] = value / factor[i, i]


@compiled_finite
def _project(
    m_0: Float[np.ndarray, " n"],
    m_1: Float[np.ndarray, " n"],
    m_2: Float[np.ndarray, " n"],
    m_3: Float[np.ndarray, " n"],
    d_inv: Float[np.ndarray, " n"],
    rho: Float[np.ndarray, " n"],
    right: Float[np.ndarray, " 5"],
) -> None:
    """[M; 1'] D^-1 rho."""
    r_0 = r_1 = r_2 = r_3 = r_4 = 0.0
    for j in range(rho.size):
        x = d_inv[j] * rho[j]
        r_0 += m_0[j] * x
        r_1 += m_1[j] * x
        r_2 += m_2[j] * x
        r_3 += m_3[j] * x
        r_4 += x
    right[0], right[1], right[2], right[3], right[4] = r_0, r_1, r_2, r_3, r_4


@compiled_finite
def _step_v(
    m_0: Float[np.ndarray, " n"],
    m_1: Float[np.ndarray, " n"],
    m_2: Float[np.ndarray, " n"],
    m_3: Float[np.ndarray, " n"],
    d_inv: Float[np.ndarray, " n"],
    rho: Float[np.ndarray, " n"],
    step: Float[np.ndarray, " 5"],
    dv: Float[np.ndarray, " n"],
) -> None:
    """dv = (rho - M'dpi - 1 dnu) / D."""
    e_0, e_1, e_2, e_3, e_4 = step[0], step[1], step[2], step[3], step[4]
    for j in range(rho.size):
        along = e_0 * m_0[j] + e_1 * m_1[j] + e_2 * m_2[j] + e_3 * m_3[j] + e_4
        dv[j] = d_inv[j] * (rho[j] - along)


@compiled_finite
def _blocking_predictor(v: Float[np.ndarray, " n"], dv: Float[np.ndarray, " n"]) -> float:
    """1 over the step at which a bound or its multiplier reaches 0, without centring.

    Then dz_l / z_l = -1 - dv / (1 + v), and likewise above.
    """
    worst = 0.0
    for j in range(v.size):
        below = dv[j] / (1.0 + v[j])
        above = dv[j] / (1.0 - v[j])
        worst = max(worst, max(max(-below, above), max(1.0 + below, 1.0 - above)))
    return worst


@compiled_finite
def _blocking_corrector(
    v: Float[np.ndarray, " n"],
    z_l: Float[np.ndarray, " n"],
    z_u: Float[np.ndarray, " n"],
    p_l: Float[np.ndarray, " n"],
    p_u: Float[np.ndarray, " n"],
    dv: Float[np.ndarray, " n"],
) -> float:
    """As `_blocking_predictor`, with dz_l = p_l - z_l - z_l dv / (1 + v)."""
    worst = 0.0
    for j in range(v.size):
        below = dv[j] / (1.0 + v[j])
        above = dv[j] / (1.0 - v[j])
        fall_l = 1.0 + below - p_l[j] / z_l[j]
        fall_u = 1.0 - above - p_u[j] / z_u[j]
        worst = max(worst, max(max(-below, above), max(fall_l, fall_u)))
    return worst


@compiled_finite
def _gap_ahead(
    v: Float[np.ndarray, " n"],
    z_l: Float[np.ndarray, " n"],
    z_u: Float[np.ndarray, " n"],
    dv: Float[np.ndarray, " n"],
    alpha: float,
) -> float:
    """Sum of z times slack after a predictor step of length alpha."""
    total = 0.0
    for j in range(v.size):
        a_l = 1.0 + v[j]
        a_u = 1.0 - v[j]
        ahead_l = z_l[j] - alpha * z_l[j] * (1.0 + dv[j] / a_l)
        ahead_u = z_u[j] - alpha * z_u[j] * (1.0 - dv[j] / a_u)
        total += ahead_l * (a_l + alpha * dv[j]) + ahead_u * (a_u - alpha * dv[j])
    return total


@compiled_finite
def _correct(
    v: Float[np.ndarray, " n"],
    z_l: Float[np.ndarray, " n"],
    z_u: Float[np.ndarray, " n"],
    h: Float[np.ndarray, " n"],
    dv: Float[np.ndarray, " n"],
    sigma_mu: float,
    p_l: Float[np.ndarray, " n"],
    p_u: Float[np.ndarray, " n"],
    rho: Float[np.ndarray, " n"],
) -> None:
    """p = (sigma mu - second-order term of the predictor) / slack, and rho with it."""
    for j in range(v.size):
        a_l = 1.0 + v[j]
        a_u = 1.0 - v[j]
        second_l = -dv[j] * z_l[j] * (1.0 + dv[j] / a_l)
        second_u = dv[j] * z_u[j] * (1.0 - dv[j] / a_u)
        p_l[j] = (sigma_mu - second_l) / a_l
        p_u[j] = (sigma_mu - second_u) / a_u
        rho[j] = p_l[j] - p_u[j] - h[j]


@compiled_finite
def _advance(
    v: Float[np.ndarray, " n"],
    z_l: Float[np.ndarray, " n"],
    z_u: Float[np.ndarray, " n"],
    p_l: Float[np.ndarray, " n"],
    p_u: Float[np.ndarray, " n"],
    dv: Float[np.ndarray, " n"],
    alpha: float,
) -> None:
    for j in range(v.size):
        z_l[j] += alpha * (p_l[j] - z_l[j] - z_l[j] * dv[j] / (1.0 + v[j]))
        z_u[j] += alpha * (p_u[j] - z_u[j] + z_u[j] * dv[j] / (1.0 - v[j]))
        v[j] += alpha * dv[j]
