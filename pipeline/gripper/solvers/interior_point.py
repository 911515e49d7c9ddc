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

SOLVED = int(GraspStatus.SOLVED)
INFEASIBLE = int(GraspStatus.INFEASIBLE)
MAX_ITERATIONS = int(GraspStatus.MAX_ITERATIONS)

# Limits count as met, or as certainly broken, to this much of F_v.
FEASIBILITY_TOLERANCE = 1e-9
# |s(GW - Lambda)| is wanted to this accuracy: q then has it too, as |dq| <= q |dr|.
RESIDUAL_TOLERANCE = 2e-8
# Below this |s(GW - Lambda)| the gap is held to an absolute bound: r within 2e-7.
CORNER = 1e-6
# What is kept of each triangle, a row of the workspace each: v, the multipliers of its bounds,
# h = M'pi + nu 1, 1/D, rho, dv, the centring terms, and the inverses of the slacks 1+v and 1-v.
V, Z_L, Z_U, H, D_INV, RHO, DV, P_L, P_U, I_L, I_U, MOST = range(12)
_WORK_ARRAYS = 12


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
    work = np.empty((_WORK_ARRAYS, rows.shape[2]))
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
    """Status and iterations; v is left in work[0], pi and nu in `multipliers`."""
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
        gap, dual, reach, s_v, p_0, p_1, p_2, p_3 = _move(rows, work, n, pi, nu, alpha)
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
        _form(rows, work, n, system, right)
        for r in range(4):
            e = k * k
            if bounded[r]:
                e += w_l[r] / (t[r] - lower[r]) + w_u[r] / (upper[r] - t[r])
            e_inv[r] = 1.0 / e
            system[r, r] += e_inv[r]
        _factor(system)
        sigma_mu = 0.0
        for r in range(4):
            c_l[r] = 0.0
            c_u[r] = 0.0
        worst = 0.0
        for corrector in range(2):
            if corrector == 1:
                _correct(rows, work, n, sigma_mu, right)
            for r in range(4):
                theta[r] = pi[r] - k * (k * t[r] - scale * target[r])
                if bounded[r]:
                    theta[r] += (sigma_mu - c_l[r]) / (t[r] - lower[r])
                    theta[r] -= (sigma_mu - c_u[r]) / (upper[r] - t[r])
                right[r] -= theta[r] * e_inv[r] + r_p[r]
            right[4] += s_v - total
            _substitute(system, right, step)
            ahead = 0.0
            if corrector == 0:
                worst, ahead = _predict(rows, work, n, step)
            else:
                worst = _step(rows, work, n, step)
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


@compiled_finite
def _move(
    rows: Float[np.ndarray, "4 most"],
    work: Float[np.ndarray, "work most"],
    n: int,
    pi: Float[np.ndarray, " 4"],
    nu: float,
    alpha: float,
) -> tuple[float, float, float, float, float, float, float, float]:
    """A step of length alpha; then h = M'pi + nu 1 and the inverses of the slacks there.

    Returns the sum of z times slack, the sum of |h - z_l + z_u|, that of |h|, 1'v and M v.
    """
    m_0, m_1, m_2, m_3 = rows[0, :n], rows[1, :n], rows[2, :n], rows[3, :n]
    dv, p_l, p_u = work[DV, :n], work[P_L, :n], work[P_U, :n]
    v, z_l, z_u = work[V, :n], work[Z_L, :n], work[Z_U, :n]
    i_l, i_u, h = work[I_L, :n], work[I_U, :n], work[H, :n]
    e_0, e_1, e_2, e_3 = pi[0], pi[1], pi[2], pi[3]
    gap = dual = reach = s_v = p_0 = p_1 = p_2 = p_3 = 0.0
    for j in range(n):
        z_lj = z_l[j] + alpha * (p_l[j] - z_l[j] - z_l[j] * dv[j] * i_l[j])
        z_uj = z_u[j] + alpha * (p_u[j] - z_u[j] + z_u[j] * dv[j] * i_u[j])
        vj = v[j] + alpha * dv[j]
        hj = e_0 * m_0[j] + e_1 * m_1[j] + e_2 * m_2[j] + e_3 * m_3[j] + nu
        a_l = 1.0 + vj
        a_u = 1.0 - vj
        inverse = 1.0 / (a_l * a_u)
        z_l[j] = z_lj
        z_u[j] = z_uj
        v[j] = vj
        h[j] = hj
        i_l[j] = a_u * inverse
        i_u[j] = a_l * inverse
        gap += z_lj * a_l + z_uj * a_u
        dual += abs(hj - z_lj + z_uj)
        reach += abs(hj)
        s_v += vj
        p_0 += m_0[j] * vj
        p_1 += m_1[j] * vj
        p_2 += m_2[j] * vj
        p_3 += m_3[j] * vj
    return gap, dual, reach, s_v, p_0, p_1, p_2, p_3


@compiled_finite
def _form(
    rows: Float[np.ndarray, "4 most"],
    work: Float[np.ndarray, "work most"],
    n: int,
    system: Float[np.ndarray, "5 5"],
    right: Float[np.ndarray, " 5"],
) -> None:
    """D^-1, the lower triangle of [M; 1'] D^-1 [M; 1']', and [M; 1'] D^-1 (-h)."""
    m_0, m_1, m_2, m_3 = rows[0, :n], rows[1, :n], rows[2, :n], rows[3, :n]
    z_l, z_u, i_l = work[Z_L, :n], work[Z_U, :n], work[I_L, :n]
    i_u, h, d_inv = work[I_U, :n], work[H, :n], work[D_INV, :n]
    s_00 = s_10 = s_11 = s_20 = s_21 = s_22 = 0.0
    s_30 = s_31 = s_32 = s_33 = s_40 = s_41 = s_42 = s_43 = s_44 = 0.0
    r_0 = r_1 = r_2 = r_3 = r_4 = 0.0
    for j in range(n):
        # The floor keeps D invertible where a weight is all but free; it damps the
        # step a little and leaves the point the iterations end at unchanged.
        d = 1.0 / (z_l[j] * i_l[j] + z_u[j] * i_u[j] + 1e-14)
        d_inv[j] = d
        x = d * h[j]
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
        r_0 -= x * m_0[j]
        r_1 -= x * m_1[j]
        r_2 -= x * m_2[j]
        r_3 -= x * m_3[j]
        r_4 -= x
    system[0, 0] = s_00
    system[1, 0], system[1, 1] = s_10, s_11
    system[2, 0], system[2, 1], system[2, 2] = s_20, s_21, s_22
    system[3, 0], system[3, 1], system[3, 2], system[3, 3] = s_30, s_31, s_32, s_33
    system[4, 0], system[4, 1], system[4, 2] = s_40, s_41, s_42
    system[4, 3], system[4, 4] = s_43, s_44
    right[0], right[1], right[2], right[3], right[4] = r_0, r_1, r_2, r_3, r_4


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
def _predict(
    rows: Float[np.ndarray, "4 most"],
    work: Float[np.ndarray, "work most"],
    n: int,
    step: Float[np.ndarray, " 5"],
) -> tuple[float, float]:
    """dv = (-h - M'dpi - 1 dnu) / D, without centring.

    Returns 1 over the step at which a bound or its multiplier reaches 0 (dz_l / z_l is
    -1 - dv / (1 + v), and likewise above), and the sum of the products of both changes.
    """
    m_0, m_1, m_2, m_3 = rows[0, :n], rows[1, :n], rows[2, :n], rows[3, :n]
    z_l, z_u, i_l = work[Z_L, :n], work[Z_U, :n], work[I_L, :n]
    i_u, h, d_inv = work[I_U, :n], work[H, :n], work[D_INV, :n]
    dv, most = work[DV, :n], work[MOST, :n]
    e_0, e_1, e_2, e_3, e_4 = step[0], step[1], step[2], step[3], step[4]
    ahead = 0.0
    for j in range(n):
        along = e_0 * m_0[j] + e_1 * m_1[j] + e_2 * m_2[j] + e_3 * m_3[j] + e_4
        change = -d_inv[j] * (h[j] + along)
        dv[j] = change
        below = change * i_l[j]
        above = change * i_u[j]
        most[j] = max(max(-below, above), max(1.0 + below, 1.0 - above))
        ahead += change * (z_u[j] * (1.0 - above) - z_l[j] * (1.0 + below))
    return max(_greatest(most), 0.0), ahead


@compiled_finite
def _correct(
    rows: Float[np.ndarray, "4 most"],
    work: Float[np.ndarray, "work most"],
    n: int,
    sigma_mu: float,
    right: Float[np.ndarray, " 5"],
) -> None:
    """p = (sigma mu - second-order term of the predictor) / slack, rho, and [M; 1'] D^-1 rho."""
    m_0, m_1, m_2, m_3 = rows[0, :n], rows[1, :n], rows[2, :n], rows[3, :n]
    z_l, z_u, i_l = work[Z_L, :n], work[Z_U, :n], work[I_L, :n]
    i_u, h, d_inv = work[I_U, :n], work[H, :n], work[D_INV, :n]
    dv, p_l, p_u = work[DV, :n], work[P_L, :n], work[P_U, :n]
    rho = work[RHO, :n]
    r_0 = r_1 = r_2 = r_3 = r_4 = 0.0
    for j in range(n):
        change = dv[j]
        below = (sigma_mu + change * z_l[j] * (1.0 + change * i_l[j])) * i_l[j]
        above = (sigma_mu - change * z_u[j] * (1.0 - change * i_u[j])) * i_u[j]
        p_l[j] = below
        p_u[j] = above
        rest = below - above - h[j]
        rho[j] = rest
        x = d_inv[j] * rest
        r_0 += m_0[j] * x
        r_1 += m_1[j] * x
        r_2 += m_2[j] * x
        r_3 += m_3[j] * x
        r_4 += x
    right[0], right[1], right[2], right[3], right[4] = r_0, r_1, r_2, r_3, r_4


@compiled_finite
def _step(
    rows: Float[np.ndarray, "4 most"],
    work: Float[np.ndarray, "work most"],
    n: int,
    step: Float[np.ndarray, " 5"],
) -> float:
    """dv = (rho - M'dpi - 1 dnu) / D, and 1 over the step at which anything reaches 0.

    dz_l = p_l - z_l - z_l dv / (1 + v), and likewise above.
    """
    m_0, m_1, m_2, m_3 = rows[0, :n], rows[1, :n], rows[2, :n], rows[3, :n]
    z_l, z_u, i_l = work[Z_L, :n], work[Z_U, :n], work[I_L, :n]
    i_u, p_l, p_u = work[I_U, :n], work[P_L, :n], work[P_U, :n]
    rho, d_inv, dv = work[RHO, :n], work[D_INV, :n], work[DV, :n]
    most = work[MOST, :n]
    e_0, e_1, e_2, e_3, e_4 = step[0], step[1], step[2], step[3], step[4]
    for j in range(n):
        along = e_0 * m_0[j] + e_1 * m_1[j] + e_2 * m_2[j] + e_3 * m_3[j] + e_4
        change = d_inv[j] * (rho[j] - along)
        dv[j] = change
        below = change * i_l[j]
        above = change * i_u[j]
        fall_l = 1.0 + below - p_l[j] / z_l[j]
        fall_u = 1.0 - above - p_u[j] / z_u[j]
        most[j] = max(max(-below, above), max(fall_l, fall_u))
    return max(_greatest(most), 0.0)


@compiled_finite
def _greatest(values: Float[np.ndarray, " n"]) -> float:
    """Greatest of the values, which are overwritten: halves against each other, in SIMD lanes.

    The compiler does not vectorise a running maximum.
    """
    count = values.size
    while count > 1:
        half = count // 2
        left, right = values[:half], values[count - half : count]
        for j in range(half):
            left[j] = max(left[j], right[j])
        count -= half
    return values[0]  # type: ignore[no-any-return]
