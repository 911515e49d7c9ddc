"""Forces and moments on the simulated gripper: pushes of what it meets, and where they are felt."""

from collections.abc import Callable

import numpy as np
import sapien
from jaxtyping import Float


def push_on(
    world: sapien.Scene, owns: Callable[[sapien.Entity], bool], about_m: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, " 6"] | None:
    """What all that touches the gripper's rigid parts pushed them with in the last step.

    Parameters
    ----------
    world
        PhysX scene.
    owns
        Whether an entity is a part of the gripper.
    about_m
        The point about which the moment is taken, shape (3,), WCS [m].

    Returns
    -------
    Force [N] and moment [N m] in WCS, shape (6,); None where nothing touches.
    """
    total = None
    for contact in world.get_contacts():
        one, other = contact.bodies
        first = owns(one.entity)
        if first == owns(other.entity):
            continue
        total = np.zeros(6) if total is None else total
        sign = 1.0 if first else -1.0
        for point in contact.points:
            force = sign * np.asarray(point.impulse, dtype=np.float64) / world.timestep
            total[:3] += force
            total[3:] += np.cross(np.asarray(point.position) - about_m, force)
    return total


def at_flange(load: Float[np.ndarray, " 6"], hand_length_m: float) -> Float[np.ndarray, " 6"]:
    """A load at the pad's centre as the flange feels it, a hand's length away; axes of GCS."""
    pad_from_flange = np.array([0.0, 0.0, -hand_length_m])
    return np.concatenate([load[:3], load[3:] + np.cross(pad_from_flange, load[:3])])
