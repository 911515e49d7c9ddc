"""Solves the 5 x 5 system that every step of `interior_point` and of `newton` ends in."""

import numpy as np
from jaxtyping import Float

from pipeline.gripper.compiled import compiled_finite


@compiled_finite
def factor(system: Float[np.ndarray, "5 5"]) -> None:
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
def substitute(
    factor: Float[np.ndarray, "5 5"],
    right: Float[np.ndarray, " 5"],
    solution: Float[np.ndarray, " 5"],
) -> None:
    """The solution of the system, by the factor that `factor` leaves."""
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
