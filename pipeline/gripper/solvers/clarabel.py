"""The quality QP by Clarabel, over a lift of its own: an independent second opinion.

x = (W, y) with y = s (G W - Lambda), in the conic form A x + slack = b. Called through
Clarabel's own interface, as qpsolvers does not pass on its number of iterations.
"""

import clarabel
import numpy as np
from scipy import sparse

from pipeline.gripper.problem import GraspStatus, QpSolution, QualityProblem


def solve(problem: QualityProblem) -> QpSolution:
    """Solve Eq. (14) over (W, y) as a cone program with tight tolerances."""
    n = problem.wrench_matrix.shape[1]
    force = problem.vacuum_force
    if force <= 0.0:
        return QpSolution(np.ones(n), GraspStatus.SOLVED, 0)
    rows = sparse.csc_matrix(problem.wrench_matrix / force)
    eye = sparse.identity(n, format="csc")
    constraints = sparse.bmat(
        [
            [problem.scale * force * rows, -sparse.identity(4)],
            [sparse.csc_matrix(np.ones((1, n))), None],
            [rows, None],
            [-rows, None],
            [eye, None],
            [-eye, None],
        ],
        format="csc",
    )
    spread = problem.weight_spread
    bounds = np.concatenate(
        [
            problem.scale * problem.target,
            [float(n)],
            problem.upper / force,
            -problem.lower / force,
            np.full(n, 1.0 + spread),
            np.full(n, spread - 1.0),
        ]
    )
    hessian = sparse.diags(np.concatenate([np.zeros(n), np.ones(4)]), format="csc")
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = problem.max_iterations
    settings.tol_gap_abs = 1e-13
    settings.tol_gap_rel = 1e-12
    settings.tol_feas = 1e-10
    cones = [clarabel.ZeroConeT(5), clarabel.NonnegativeConeT(8 + 2 * n)]
    answer = clarabel.DefaultSolver(
        hessian, np.zeros(n + 4), constraints, bounds, cones, settings
    ).solve()
    status = _STATUS.get(str(answer.status), GraspStatus.MAX_ITERATIONS)
    weights = np.ones(n) if status is GraspStatus.INFEASIBLE else np.asarray(answer.x)[:n]
    return QpSolution(weights, status, int(answer.iterations))


# «Almost» is Clarabel's word for its reduced tolerances, 5e-5: not good enough here.
_STATUS = {
    "Solved": GraspStatus.SOLVED,
    "PrimalInfeasible": GraspStatus.INFEASIBLE,
}
