"""The motion that carries a lifted object aside and back."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

_AT_THE_MIDDLE_M = 1e-4  # nearer than this, no direction leads to the table's middle


def there_and_back(leg: float) -> float:
    """Share of a way at a time in legs, each of full acceleration and then full braking.

    leg : 0 at the start, 1 at the far end, from 2 on back at the start.
    """
    left = min(abs(leg - 1.0), 1.0)
    return 1.0 - 2.0 * left**2 if left < 0.5 else 2.0 * (1.0 - left) ** 2


def way_inwards(place_m: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    """Level unit vector from a place in WCS [m] to the table's middle; x where it is there."""
    inwards = -place_m * [1.0, 1.0, 0.0]
    far_m = float(np.linalg.norm(inwards))
    return inwards / far_m if far_m > _AT_THE_MIDDLE_M else np.array([1.0, 0.0, 0.0])


def way_aside_m(
    start: Float[np.ndarray, "4 4"],
    longest_m: float,
    reachable: Callable[[Float[np.ndarray, "4 4"]], bool],
) -> Float[np.ndarray, " 3"]:
    """A level way that the gripper can go: inwards and long where possible.

    Parameters
    ----------
    start
        Where it begins, world_from_gripper, shape (4, 4).
    longest_m
        Length that is tried first, then half and a quarter of it [m].
    reachable
        Whether the gripper can be brought to a pose.

    Returns
    -------
    The way in WCS, shape (3,) [m]; 0 where no way can be gone.
    """
    ways = [way_inwards(start[:3, 3])]
    ways += [np.array([x, y, 0.0]) for x, y in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))]
    for length_m in (longest_m, longest_m / 2, longest_m / 4):
        for way in ways:
            end = start.copy()
            end[:3, 3] += length_m * way
            if reachable(end):
                return np.asarray(length_m * way)
    return np.zeros(3)
