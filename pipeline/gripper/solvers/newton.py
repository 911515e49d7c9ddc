"""Newton's method over five numbers, pi and nu: ways out 2 and 3 of `sifting`.

Both look at every triangle in each pass, and solve one 5 x 5 system made of the triangles whose v
lies within its bounds. The symbols are those of `sifting`.
"""

import numpy as np
from jaxtyping import Bool, Float

from pipeline.gripper.compiled import compiled_finite
from pipeline.gripper.solvers.five_rows import factor, substitute
from pipeline.gripper.solvers.interior_point import FEASIBILITY_TOLERANCE, INFEASIBLE

# What a problem is marked with that is not decided yet; no status of a grasp.
SIFTED = -1
UNDECIDED = -2
# Room for triangles left open; where there are more, fewer eps are taken.
ROOM = 224

# eps at the first pass, over the mean of |h|: about two of three triangles are within it.
_FIRST = 1.0
# eps of a pass over that of the one before: Newton's step still lands near the next optimum.
_SMALLER = 0.3
# So few triangles within eps end the passes.
_FEW = 40
# Triangles within so many eps of h = 0 are left open: eps moves h by about itself.
_OPEN = 3.0
# Narrowings by a third that are tried: with more left out, the few are not the ones that matter.
_NARROWER = 4
# Keeps the system of five invertible where no triangle is within eps.
_DAMPING = 1e-14
# The least-squares v meets its point to this much of F_v, a tenth of what is required.
_REACHED = 1e-11
# Newton's steps to the nearest point: where it is reached at all, two or three do.
_NEAREST_PASSES = 6
# The passes end where the sum of Newton's residual grows so many times over the least so far.
_ASTRAY = 10.0


@compiled_finite
def nearest_reached(
    matrix: Float[np.ndarray, "4 most"],
    means: Float[np.ndarray, " 4"],
    unit: float,
    t0: Float[np.ndarray, " 4"],
    bounded: Bool[np.ndarray, " 4"],
    lower: Float[np.ndarray, " 4"],
    upper: Float[np.ndarray, " 4"],
    target: Float[np.ndarray, " 4"],
    scale: float,
    k: float,
    v: Float[np.ndarray, " n"],
    h: Float[np.ndarray, " n"],
) -> bool:
    """Whether the point nearest to Lambda is reached, by the least-squares v within its bounds.

    v = -(M'x + nu 1) cut off at its bounds. Newton's method looks for the x of the point, and gives
    up where it comes no nearer.
    """
    wanted = np.empty(5)
    right = np.empty(5)
    x = np.zeros(5)
    change = np.empty(5)
    system = np.empty((5, 5))
    before = 0.0
    for r in range(4):
        nearest = scale * target[r] / k
        if bounded[r]:
            nearest = min(max(nearest, lower[r]), upper[r])
        wanted[r] = nearest - t0[r]
        right[r] = wanted[r]
        before = max(before, abs(wanted[r]))
    right[4] = 0.0
    for j in range(v.size):
        v[j] = 0.0
    for _ in range(_NEAREST_PASSES):
        _gram(matrix, means, unit, v, system)
        for r in range(5):
            system[r, r] += _DAMPING * system[r, r]
        factor(system)
        substitute(system, right, change)
        for r in range(5):
            x[r] -= change[r]
        _, total, within, p_0, p_1, p_2, p_3 = _look(matrix, means, unit, x, 1.0, v, h)
        moved = (p_0, p_1, p_2, p_3)
        off = 0.0
        for r in range(4):
            right[r] = wanted[r] - unit * (moved[r] - means[r] * total)
            off = max(off, abs(right[r]))
        right[4] = -total
        if off <= _REACHED and abs(total) <= _REACHED * v.size:
            return True
        if within < 0.5 * v.size or off > 0.5 * before:
            return False
        before = off
    return False


@compiled_finite
def rounded_off(
    matrix: Float[np.ndarray, "4 most"],
    means: Float[np.ndarray, " 4"],
    unit: float,
    t0: Float[np.ndarray, " 4"],
    bounded: Bool[np.ndarray, " 4"],
    lower: Float[np.ndarray, " 4"],
    upper: Float[np.ndarray, " 4"],
    target: Float[np.ndarray, " 4"],
    scale: float,
    k: float,
    passes: int,
    v: Float[np.ndarray, " n"],
    h: Float[np.ndarray, " n"],
) -> tuple[int, int, float]:
    """The status, how many passes were made, and the |h| within which triangles stay open."""
    n = v.size
    x = np.zeros(5)
    change = np.empty(5)
    right = np.empty(5)
    e_inv = np.empty(4)
    system = np.empty((5, 5))
    for r in range(4):
        x[r] = k * (k * t0[r] - scale * target[r])
    best = np.zeros(5)
    eps = best_eps = 0.0
    least_off = np.inf
    number = 0
    for number in range(passes):
        if number == 0:
            reach = _look(matrix, means, unit, x, 0.0, v, h)[0]
            eps = max(_FIRST * reach / n, 1e-300)
        reach, total, within, p_0, p_1, p_2, p_3 = _look(matrix, means, unit, x, 1.0 / eps, v, h)
        moved = (p_0, p_1, p_2, p_3)
        farkas = -reach
        size = 0.0
        off = 0.0
        for r in range(4):
            t = (x[r] + k * scale * target[r]) / (k * k)
            e_inv[r] = 1.0 / (k * k)
            if bounded[r] and (t > upper[r] or t < lower[r]):
                t = upper[r] if t > upper[r] else lower[r]
                e_inv[r] = 0.0
            right[r] = t0[r] + unit * (moved[r] - means[r] * total) - t
            off = max(off, abs(right[r]))
            farkas += x[r] * t0[r] - max(x[r] * lower[r], x[r] * upper[r])
            size += abs(x[r])
        right[4] = total
        if farkas > FEASIBILITY_TOLERANCE * size:
            return INFEASIBLE, number + 1, 0.0
        if off < least_off:
            least_off, best_eps = off, eps
            for r in range(5):
                best[r] = x[r]
        if within <= _FEW or off > _ASTRAY * least_off:
            break
        _gram(matrix, means, unit, v, system)
        for r in range(5):
            for c in range(r + 1):
                system[r, c] /= eps
        for r in range(4):
            system[r, r] += e_inv[r]
        for r in range(5):
            system[r, r] += _DAMPING * (1.0 + system[r, r])
        factor(system)
        substitute(system, right, change)
        for r in range(5):
            x[r] += change[r]
        eps *= _SMALLER
    if passes < 1:
        return UNDECIDED, 0, 0.0
    _look(matrix, means, unit, best, 0.0, v, h)
    reached = _OPEN * best_eps
    for _ in range(_NARROWER):
        close = 0
        for j in range(n):
            close += abs(h[j]) < reached
        if close <= ROOM:
            return SIFTED, number + 1, reached
        reached *= 0.7
    return UNDECIDED, number + 1, 0.0


@compiled_finite
def _look(
    matrix: Float[np.ndarray, "4 most"],
    means: Float[np.ndarray, " 4"],
    unit: float,
    x: Float[np.ndarray, " 5"],
    per_eps: float,
    v: Float[np.ndarray, " n"],
    h: Float[np.ndarray, " n"],
) -> tuple[float, float, float, float, float, float, float]:
    """h at pi and nu, and v = -h / eps cut off at its bounds.

    Returns the sum of |h|, 1'v, how many v are within their bounds, and G v.
    """
    n = v.size
    g_0, g_1, g_2, g_3 = matrix[0, :n], matrix[1, :n], matrix[2, :n], matrix[3, :n]
    e_0, e_1, e_2, e_3 = unit * x[0], unit * x[1], unit * x[2], unit * x[3]
    nu = x[4] - e_0 * means[0] - e_1 * means[1] - e_2 * means[2] - e_3 * means[3]
    reach = total = within = p_0 = p_1 = p_2 = p_3 = 0.0
    for j in range(n):
        hj = e_0 * g_0[j] + e_1 * g_1[j] + e_2 * g_2[j] + e_3 * g_3[j] + nu
        vj = -min(max(hj * per_eps, -1.0), 1.0)
        h[j] = hj
        v[j] = vj
        reach += abs(hj)
        total += vj
        within += 1.0 if abs(vj) < 1.0 else 0.0
        p_0 += g_0[j] * vj
        p_1 += g_1[j] * vj
        p_2 += g_2[j] * vj
        p_3 += g_3[j] * vj
    return reach, total, within, p_0, p_1, p_2, p_3


@compiled_finite
def _gram(
    matrix: Float[np.ndarray, "4 most"],
    means: Float[np.ndarray, " 4"],
    unit: float,
    v: Float[np.ndarray, " n"],
    system: Float[np.ndarray, "5 5"],
) -> None:
    """Lower triangle of [M; 1] [M; 1]' over the triangles whose v is within its bounds."""
    n = v.size
    g_0, g_1, g_2, g_3 = matrix[0, :n], matrix[1, :n], matrix[2, :n], matrix[3, :n]
    a_0, a_1, a_2, a_3 = means[0], means[1], means[2], means[3]
    s_00 = s_10 = s_11 = s_20 = s_21 = s_22 = 0.0
    s_30 = s_31 = s_32 = s_33 = s_40 = s_41 = s_42 = s_43 = s_44 = 0.0
    for j in range(n):
        w = 1.0 if abs(v[j]) < 1.0 else 0.0
        m_0, m_1, m_2, m_3 = g_0[j] - a_0, g_1[j] - a_1, g_2[j] - a_2, g_3[j] - a_3
        w_0, w_1, w_2, w_3 = w * m_0, w * m_1, w * m_2, w * m_3
        s_00 += w_0 * m_0
        s_10 += w_0 * m_1
        s_20 += w_0 * m_2
        s_30 += w_0 * m_3
        s_40 += w_0
        s_11 += w_1 * m_1
        s_21 += w_1 * m_2
        s_31 += w_1 * m_3
        s_41 += w_1
        s_22 += w_2 * m_2
        s_32 += w_2 * m_3
        s_42 += w_2
        s_33 += w_3 * m_3
        s_43 += w_3
        s_44 += w
    twice = unit * unit
    system[0, 0] = twice * s_00
    system[1, 0], system[1, 1] = twice * s_10, twice * s_11
    system[2, 0], system[2, 1], system[2, 2] = twice * s_20, twice * s_21, twice * s_22
    system[3, 0], system[3, 1] = twice * s_30, twice * s_31
    system[3, 2], system[3, 3] = twice * s_32, twice * s_33
    system[4, 0], system[4, 1] = unit * s_40, unit * s_41
    system[4, 2], system[4, 3], system[4, 4] = unit * s_42, unit * s_43, s_44
