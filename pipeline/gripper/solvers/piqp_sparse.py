"""The quality QP with its residual carried as four extra variables, by PIQP.

With y = s (G W - Lambda) the objective is 1/2 |y|^2: P = diag(0, I_4), four equality
rows, and a KKT system that is sparse and linear in n. The limits of Eq. (8)-(11) bound
GW, and GW is y again, so they become bounds on four more variables t = GW / F_v.
"""

from typing import Any

import numpy as np
import piqp
import qpsolvers
from jaxtyping import Float
from qpsolvers.solvers.piqp_ import piqp_solve_problem
from scipy import sparse

from pipeline.gripper.problem import GraspStatus, QpSolution, QualityProblem

# q has a norm's corner at a perfect seal, where an objective within eps gives q
# only within sqrt(2 eps): hence tolerances far below PIQP's own 1e-8.
SETTINGS: dict[str, float] = {
    "eps_abs": 1e-11,
    "eps_rel": 1e-11,
    "eps_duality_gap_abs": 1e-15,
    "eps_duality_gap_rel": 3e-13,
}


def solve(problem: QualityProblem) -> QpSolution:
    """Solve Eq. (14) over (W, t, y) with sparse matrices."""
    n = problem.wrench_matrix.shape[1]
    if problem.vacuum_force <= 0.0:
        return QpSolution(np.ones(n), GraspStatus.SOLVED, 0)
    hessian, equality, right, lower, upper = lift(problem)
    lifted = qpsolvers.Problem(
        P=hessian, q=np.zeros(n + 8), A=equality, b=right, lb=lower, ub=upper
    )
    answer = piqp_solve_problem(
        lifted, backend="sparse", max_iter=problem.max_iterations, **SETTINGS
    )
    info = answer.extras["info"]
    status = status_of(info.status)
    weights = np.ones(n) if status is GraspStatus.INFEASIBLE else np.asarray(answer.x)[:n]
    return QpSolution(weights, status, int(info.iter))


def lift(
    problem: QualityProblem,
) -> tuple[Any, Any, Float[np.ndarray, " 9"], Float[np.ndarray, " n8"], Float[np.ndarray, " n8"]]:
    """Hessian, equality matrix, its right side, and bounds of x = (W, t, y).

    Rows: G W / F_v - t = 0;  s F_v t - y = s Lambda;  sum W = n.
    """
    n = problem.wrench_matrix.shape[1]
    force = problem.vacuum_force
    eye = sparse.identity(4, format="csc")
    equality = sparse.bmat(
        [
            [sparse.csc_matrix(problem.wrench_matrix / force), -eye, None],
            [None, problem.scale * force * eye, -eye],
            [sparse.csc_matrix(np.ones((1, n))), None, None],
        ],
        format="csc",
    )
    right = np.concatenate([np.zeros(4), problem.scale * problem.target, [float(n)]])
    hessian = sparse.diags(np.concatenate([np.zeros(n + 4), np.ones(4)]), format="csc")
    spread = problem.weight_spread
    free = np.full(4, np.inf)
    lower = np.concatenate([np.full(n, 1.0 - spread), problem.lower / force, -free])
    upper = np.concatenate([np.full(n, 1.0 + spread), problem.upper / force, free])
    return hessian, equality, right, lower, upper


def status_of(status: Any) -> GraspStatus:
    """PIQP's verdict; a problem bounded in every variable is never dual infeasible."""
    if status == piqp.PIQP_SOLVED:
        return GraspStatus.SOLVED
    if status == piqp.PIQP_PRIMAL_INFEASIBLE:
        return GraspStatus.INFEASIBLE
    return GraspStatus.MAX_ITERATIONS
