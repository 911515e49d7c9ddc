"""The quality QP in its textbook form, P = (sG)'(sG) as an n x n matrix, by PIQP.

The form a reader of the supplement would write down first. The Hessian has rank 4,
so nearly all of its n^2 entries are work for nothing; it is kept as a reference.
"""

import numpy as np
import qpsolvers
from qpsolvers.solvers.piqp_ import piqp_solve_problem

from pipeline.gripper.problem import GraspStatus, QpSolution, QualityProblem
from pipeline.gripper.solvers.piqp_sparse import status_of

# About W = 1 the objective lacks only 1/2 |s (G 1 - Lambda)|^2. About W = 0 it would lack
# 1/2 |s Lambda|^2, about 10, and lose four digits of a small |s (G W - Lambda)|.
SETTINGS: dict[str, float] = {
    "eps_abs": 1e-10,
    "eps_rel": 1e-10,
    "eps_duality_gap_abs": 1e-13,
    "eps_duality_gap_rel": 1e-12,
}


def solve(problem: QualityProblem) -> QpSolution:
    """Solve Eq. (14) as P V, c, L V <= l, J V = 0 with dense matrices, V = W - 1."""
    n = problem.wrench_matrix.shape[1]
    if problem.vacuum_force <= 0.0:
        return QpSolution(np.ones(n), GraspStatus.SOLVED, 0)
    scaled = problem.scale * problem.wrench_matrix
    # Limits in units of F_v: a weak grasp is as well conditioned as a strong one.
    rows = problem.wrench_matrix / problem.vacuum_force
    middle = np.ones(n)
    textbook = qpsolvers.Problem(
        P=scaled.T @ scaled,
        q=scaled.T @ (scaled @ middle - problem.scale * problem.target),
        G=np.concatenate([rows, -rows]),
        h=np.concatenate([problem.upper, -problem.lower]) / problem.vacuum_force
        - np.concatenate([rows, -rows]) @ middle,
        A=np.ones((1, n)),
        b=np.zeros(1),
        lb=np.full(n, -problem.weight_spread),
        ub=np.full(n, problem.weight_spread),
    )
    answer = piqp_solve_problem(
        textbook, backend="dense", max_iter=problem.max_iterations, **SETTINGS
    )
    info = answer.extras["info"]
    status = status_of(info.status)
    weights = middle if status is GraspStatus.INFEASIBLE else middle + np.asarray(answer.x)
    return QpSolution(weights, status, int(info.iter))
