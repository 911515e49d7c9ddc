"""The loads that an attempt puts on a seal: weight, lift, shake and transport of a lifted object.

They follow from the object's true mass and centre of mass and from how the robot moves, so that
what a seal bears can be compared with what it will have to bear.
"""

import math

import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import EvaluateConfig
from pipeline.control.transport import way_inwards
from pipeline.simulation.judges import Bearing

GRAVITY_M_S2 = 9.81  # standard gravity to three digits


def loads_of_a_kilogram(
    world_from_gripper: Float[np.ndarray, "4 4"],
    centre_of_mass_m: Float[np.ndarray, " 3"],
    accelerations_m_s2: Float[np.ndarray, "n 3"],
) -> Float[np.ndarray, "n 6"]:
    """Loads of one kilogram at a centre of mass, under gravity, that is accelerated.

    Parameters
    ----------
    world_from_gripper
        The pad's pose, shape (4, 4).
    centre_of_mass_m
        Of the object in WCS, shape (3,) [m].
    accelerations_m_s2
        Of the object in WCS, shape (n, 3) [m/s2].

    Returns
    -------
    Force and moment about the pad's origin that the object exerts on the pad, in GCS, a load a row,
    shape (n, 6) [N/kg, N m/kg].
    """
    into_gripper = world_from_gripper[:3, :3].T
    upwards = np.array([0.0, 0.0, GRAVITY_M_S2])
    force = -(accelerations_m_s2 + upwards) @ into_gripper.T
    arm_m = into_gripper @ (centre_of_mass_m - world_from_gripper[:3, 3])
    return np.column_stack([force, np.cross(arm_m, force)])


def accelerations_m_s2(
    place_m: Float[np.ndarray, " 3"], config: EvaluateConfig
) -> Float[np.ndarray, "n 3"]:
    """What a lifted object is accelerated by in an attempt: rest, lift, shake, transport.

    Parameters
    ----------
    place_m
        Of the pad in WCS, shape (3,) [m]; the transport goes from there to the table's middle and
        back.
    config
        How the robot lifts, shakes and carries.

    Returns
    -------
    The largest of each kind and side, shape (n, 3), WCS [m/s2].
    """
    lift, fastest = config.lift, max(config.transport.accelerations_m_s2, default=0.0)
    shake = (2 * math.pi * lift.shake_hz) ** 2 * lift.shake_m if lift.shake_s > 0 else 0.0
    aside = fastest * way_inwards(place_m)
    along_x = np.array([shake, 0.0, 0.0])
    up = np.array([0.0, 0.0, config.policy.acceleration_m_s2])
    return np.stack([np.zeros(3), up, aside, -aside, along_x, -along_x])


def weight_borne_n(
    bearing: Bearing,
    world_from_gripper: Float[np.ndarray, "4 4"],
    centre_of_mass_m: Float[np.ndarray, " 3"],
    config: EvaluateConfig,
) -> float:
    """The largest weight at a centre of mass that a seal bears through a whole attempt.

    Parameters
    ----------
    bearing
        What the judge found.
    world_from_gripper
        The pad's pose at the seal, shape (4, 4).
    centre_of_mass_m
        Of the object in WCS, shape (3,) [m].
    config
        How the robot lifts, shakes and carries.

    Returns
    -------
    Weight at rest [N]; 0 where nothing can be held.
    """
    moved = accelerations_m_s2(world_from_gripper[:3, 3], config)
    loads = loads_of_a_kilogram(world_from_gripper, centre_of_mass_m, moved)
    return GRAVITY_M_S2 * bearing.largest_scale(loads)
