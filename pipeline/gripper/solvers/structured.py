"""The quality QP in five numbers: the solver that labels are made with.

Everything in Eq. (8)-(14) but the bounds on W depends on W through five numbers: GW and
the sum. With v = (W - 1) / sigma_W, so that sum v = 0 and -1 <= v <= 1, and t = GW / F_v:

    minimise 1/2 |k t - s Lambda|^2,  k = s F_v
    over v, t  with  t = t0 + M v,  1'v = 0,  -1 <= v <= 1,  a <= t <= b,

where t0 = G 1 / F_v, M = sigma_W (G - row means) / F_v (taking the means off changes
nothing, as v sums to 0) and a, b are the bounds of Eq. (8)-(11) over F_v.

Infeasibility is certified, not guessed. For every pi and nu (Farkas' lemma), if

    pi't0 - sum_j |(M'pi + nu 1)_j|  >  max over a <= t <= b of pi't,

no v within its bounds meets the limits; the left side is a lower bound of pi't over them.
The same sums, with pi along an axis, show which limits can never bind: those are dropped,
which also leaves an interior to problems whose F_z cannot vary at all.

`sifting` decides a problem or leaves few of its triangles open; `interior_point` solves for the
few, and `certificate` says whether that is optimal for all. What is not decided so,
`interior_point` solves with all triangles, which `whole_problems` writes side by side.
"""

import numpy as np
from jaxtyping import Float, Int

from pipeline.gripper.problem import GraspStatus, QpSolution, QualityProblem
from pipeline.gripper.solvers import interior_point
from pipeline.gripper.solvers.certificate import certify_into
from pipeline.gripper.solvers.newton import ROOM, SIFTED, UNDECIDED
from pipeline.gripper.solvers.sifting import sift_into
from pipeline.gripper.solvers.whole_problems import form_into, write_into


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
    """Solve many problems.

    Parameters
    ----------
    wrench_matrices
        G, shape (batch, 4, most); problem i is made of the first counts[i] columns.
    counts
        Triangles of each, shape (batch,).
    forces
        F_v in units of G, shape (batch,). A problem with forces[i] = 0 has G = 0 and W = 1.
    lower
        Least GW over F_v by Eq. (8)-(11), shape (4,).
    upper
        Greatest GW over F_v, shape (4,).
    target
        Lambda, shape (4,).
    scale
        s [1].
    spread
        sigma_W [1].
    max_iterations
        Most iterations of a problem: passes of sifting and of the interior-point method.
    weights
        W of each is written here, 1 where it is INFEASIBLE; shape (batch, most).
    status
        Values of `GraspStatus` are written here, shape (batch,).
    iterations
        How many were made is written here, shape (batch,).
    """
    batch = len(counts)
    rows = np.empty((batch, 4, ROOM))
    columns = np.empty((batch, ROOM), dtype=np.int64)
    left = np.zeros(batch, dtype=np.int64)
    centres, sums = np.empty((batch, 4)), np.empty(batch)
    bounded = np.empty((batch, 4), dtype=np.bool_)
    found, multipliers = np.empty((batch, ROOM)), np.empty((batch, 5))
    verdict, steps = np.zeros(batch, dtype=np.int64), np.zeros(batch, dtype=np.int64)
    setting = (lower, upper, target, scale)
    sift_into(
        wrench_matrices,
        counts,
        forces,
        *setting,
        spread,
        max_iterations,
        weights,
        status,
        iterations,
        rows,
        columns,
        left,
        centres,
        sums,
        bounded,
    )
    interior_point.solve_into(
        rows,
        left,
        centres,
        sums,
        bounded,
        forces,
        *setting,
        max_iterations,
        status == SIFTED,
        found,
        multipliers,
        verdict,
        steps,
    )
    certify_into(
        wrench_matrices,
        counts,
        forces,
        target,
        scale,
        spread,
        max_iterations,
        columns,
        left,
        found,
        multipliers,
        verdict,
        steps,
        weights,
        status,
        iterations,
    )
    whole = np.flatnonzero(status == UNDECIDED)
    if len(whole) == 0:
        return
    most = int(counts[whole].max())
    rows, centres = np.empty((len(whole), 4, most)), np.empty((len(whole), 4))
    form_into(wrench_matrices, counts, forces, spread, whole, rows, centres)
    found, multipliers = np.empty((len(whole), most)), np.empty((len(whole), 5))
    verdict, steps = np.zeros(len(whole), dtype=np.int64), np.zeros(len(whole), dtype=np.int64)
    interior_point.solve_into(
        rows,
        counts[whole],
        centres,
        np.zeros(len(whole)),
        bounded[whole],
        forces[whole],
        *setting,
        max_iterations,
        np.ones(len(whole), dtype=np.bool_),
        found,
        multipliers,
        verdict,
        steps,
    )
    status[whole], iterations[whole] = verdict, steps
    write_into(whole, counts, spread, found, status, weights)
