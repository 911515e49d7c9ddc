"""Solvers of the quality QP, by the names that `GripperConfig.solver` may take."""

from collections.abc import Callable

from pipeline.config.grasps import SolverName
from pipeline.gripper.problem import QpSolution, QualityProblem
from pipeline.gripper.solvers import clarabel, piqp_dense, piqp_sparse, structured

Solver = Callable[[QualityProblem], QpSolution]

SOLVERS: dict[SolverName, Solver] = {
    "structured": structured.solve,
    "piqp-sparse": piqp_sparse.solve,
    "piqp-dense": piqp_dense.solve,
    "clarabel": clarabel.solve,
}
