"""What a soft contact can bear (S-1.11): Eq. (7)-(13), as bounds on GW and on W."""

import math

import numpy as np
from jaxtyping import Float

WRENCH_AXES = ("F_x", "F_y", "F_z", "T_z")
LIMIT_NAMES = tuple(f"{axis} {side}" for side in ("upper", "lower") for axis in WRENCH_AXES)
"""What each column of `limit_slacks` is the room to."""


def wrench_limit_ratios(
    friction: float,
) -> tuple[Float[np.ndarray, " 4"], Float[np.ndarray, " 4"]]:
    """Lower and upper bound of GW over F_v, an equation a row.

    Eq. (8): |F_x| within sqrt(3)/3 mu F_v. Eq. (9): |F_y| likewise. Eq. (10): F_z between
    nothing and F_v. Eq. (11): |T_z| within sqrt(3)/3 mu r_G F_v. The torque of
    G is divided by r_G, so r_G drops out of Eq. (11).
    """
    side = math.sqrt(3) / 3 * friction
    lower = np.array([-side, -side, 0.0, -side])
    upper = np.array([side, side, 1.0, side])
    return lower, upper


def wrench_limits(
    vacuum_force: float, friction: float
) -> tuple[Float[np.ndarray, " 4"], Float[np.ndarray, " 4"]]:
    """Lower and upper bound of GW in units of G: Eq. (8)-(11).

    Parameters
    ----------
    vacuum_force
        F_v of Eq. (7), in units of G.
    friction
        Mu [1].

    Returns
    -------
    Lower and upper bounds of F_x, F_y, F_z and T_z, each of shape (4,).
    """
    lower, upper = wrench_limit_ratios(friction)
    return vacuum_force * lower, vacuum_force * upper


def limit_slacks(
    wrench: Float[np.ndarray, "*batch 4"],
    lower: Float[np.ndarray, "*batch 4"],
    upper: Float[np.ndarray, "*batch 4"],
) -> Float[np.ndarray, "*batch 8"]:
    """Slack of each scalar inequality of Eq. (8)-(11); negative where it is broken.

    Columns: room to the upper bound of F_x, F_y, F_z, T_z, then to the lower bound of each.
    """
    return np.concatenate([upper - wrench, wrench - lower], axis=-1)
