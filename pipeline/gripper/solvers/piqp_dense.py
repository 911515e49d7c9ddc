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
#
# Of 2 172 problems from real meshes PIQP leaves 5 % at 100 iterations at the first settings:
# its scaling and its regularisation do not suit a Hessian of rank 4. What one leaves without
# a verdict is given to the next; two problems stay without.
_STRICT = {
    "eps_abs": 1e-10,
    "eps_rel": 1e-10,
    "eps_duality_gap_abs": 1e-13,
    "eps_duality_gap_rel": 1e-12,
}
_PLAIN = {
    **_STRICT,
    "eps_abs": 1e-8,
    "eps_rel": 1e-8,
    "eps_duality_gap_rel": 1e-10,
    "preconditioner_iter": 0,
    "reg_lower_limit": 1e-14,
    "reg_finetune_lower_limit": 1e-16,
}
SETTINGS: tuple[dict[str, float], ...] = (
    _STRICT,
    {**_PLAIN, "tau": 0.9},
    {**_PLAIN, "tau": 0.7},
    {**_PLAIN, "tau": 0.9, "eps_abs": 1e-7, "eps_rel": 1e-7},
    {**_PLAIN, "tau": 0.5, "eps_abs": 1e-7, "eps_rel": 1e-7, "eps_duality_gap_abs": 5e-13},
)
# A flat contact leaves F_z no room at all below F_v; an interior point needs some.
LIMIT_ROOM = 1e-9


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
        - np.concatenate([rows, -rows]) @ middle
        + LIMIT_ROOM,
        A=np.ones((1, n)),
        b=np.zeros(1),
        lb=np.full(n, -problem.weight_spread),
        ub=np.full(n, problem.weight_spread),
    )
    for settings in SETTINGS:
        answer = piqp_solve_problem(
            textbook, backend="dense", max_iter=problem.max_iterations, **settings
        )
        info = answer.extras["info"]
        status = status_of(info.status)
        if status is not GraspStatus.MAX_ITERATIONS:
            break
    weights = middle if status is GraspStatus.INFEASIBLE else middle + np.asarray(answer.x)
    return QpSolution(weights, status, int(info.iter))
