"""The quality QP of Eq. (14), and an answer to it: what every solver takes and gives."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float


class GraspStatus(IntEnum):
    """How a label came about; 0 is left free for «not set»."""

    SOLVED = 1
    INFEASIBLE = 2
    MAX_ITERATIONS = 3
    NO_CONTACT = 4


@dataclass(frozen=True)
class QualityProblem:
    """Minimise 1/2 |s (G W - Lambda)|^2 under Eq. (8)-(14).

    Supplement I prints the objective as 0.5 W'GW - Lambda'GW, which cannot be formed
    as G is not square; this is the least-squares problem its sentence starts from.

    Attributes
    ----------
    wrench_matrix
        G of S-1.10, dimensionless.
    vacuum_force
        F_v of Eq. (7) in units of G, >= 0.
    lower, upper
        Bounds of GW, Eq. (8)-(11).
    target
        Lambda, the wrench of a full flat seal.
    scale
        s.
    weight_spread
        sigma_W of Eq. (13); Eq. (12) makes the weights sum to n.
    max_iterations
        Bound on a solver's iterations; Supplement III.
    """

    wrench_matrix: Float[np.ndarray, "4 n"]
    vacuum_force: float
    lower: Float[np.ndarray, " 4"]
    upper: Float[np.ndarray, " 4"]
    target: Float[np.ndarray, " 4"]
    scale: float
    weight_spread: float
    max_iterations: int


@dataclass(frozen=True)
class QpSolution:
    """A solver's answer.

    Attributes
    ----------
    weights
        W of Eq. (12); all ones unless `status` is SOLVED or MAX_ITERATIONS.
    status
        SOLVED, INFEASIBLE or MAX_ITERATIONS.
    iterations
        Iterations used, 0 where none was needed.
    """

    weights: Float[np.ndarray, " n"]
    status: GraspStatus
    iterations: int
