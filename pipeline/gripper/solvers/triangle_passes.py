"""The passes over the triangles that one iteration of `interior_point` makes.

The symbols are those of that module. Each pass reads and writes rows of the same workspace, and
gives back or fills in what all triangles together amount to.
"""

import numpy as np
from jaxtyping import Float

from pipeline.gripper.compiled import compiled_finite

# What the workspace keeps of each triangle, by row: v, the multipliers of its bounds,
# h = M'pi + nu 1, 1/D, rho, dv, the centring terms, the inverses of the slacks 1+v and 1-v, and
# 1 over the step at which the first of v's bounds or of their multipliers is reached.
V, Z_L, Z_U, H, D_INV, RHO, DV, P_L, P_U, I_L, I_U, MOST = range(12)
WORK_ARRAYS = 12


@compiled_finite
def move(
    rows: Float[np.ndarray, "4 most"],
    work: Float[np.ndarray, "work most"],
    n: int,
    pi: Float[np.ndarray, " 4"],
    nu: float,
    alpha: float,
) -> tuple[float, float, float, float, float, float, float, float]:
    """Go a step of length alpha, and take h = M'pi + nu 1 and the inverses of the slacks there.

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
def form(
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
def predict(
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
def correct(
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
def step_along(
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
    """The greatest of the values, which are overwritten.

    Half of them is compared with the other half, again and again: the compiler puts that into SIMD
    lanes, and a running maximum it does not.
    """
    count = values.size
    while count > 1:
        half = count // 2
        left, right = values[:half], values[count - half : count]
        for j in range(half):
            left[j] = max(left[j], right[j])
        count -= half
    return values[0]  # type: ignore[no-any-return]
