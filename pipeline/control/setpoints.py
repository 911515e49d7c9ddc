"""The straight way from one pose of the gripper to another, and how fast a setpoint goes along it.

The simulated gripper and a real arm are both led by setpoints: poses a few millimetres apart that
keep within a speed and an acceleration, and brake so that the gripper rests at its target.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from jaxtyping import Float

from pipeline.geometry.compiled_poses import turn_between, turned

ARRIVED_M, ARRIVED_RAD = 1e-4, 1e-3  # a motion has ended: under what a camera tells apart
LAG_M = 0.002  # an arm that is this near to its setpoint has arrived
_LEVER_M = 0.2  # a turn counts as the way of a point this far from the axis


@dataclass(frozen=True, eq=False)
class Way:
    """A straight way between two poses.

    Attributes
    ----------
    first
        Where it begins, world_from_gripper or any other pose, shape (4, 4).
    shift_m
        From the first origin to the second, shape (3,), WCS [m].
    turn_rad
        Rotation vector from the first orientation to the second, shape (3,), WCS [rad].
    """

    first: Float[np.ndarray, "4 4"]
    shift_m: Float[np.ndarray, " 3"]
    turn_rad: Float[np.ndarray, " 3"]

    @classmethod
    def between(cls, first: Float[np.ndarray, "4 4"], second: Float[np.ndarray, "4 4"]) -> Self:
        """The way from one pose to another."""
        return cls(first, second[:3, 3] - first[:3, 3], turn_between(first, second))

    @property
    def length_m(self) -> float:
        """The longer of the shift and of what a point 0.2 m from the axis is turned by [m]."""
        turned_m = _LEVER_M * float(np.linalg.norm(self.turn_rad))
        return max(float(np.linalg.norm(self.shift_m)), turned_m)

    @property
    def is_done(self) -> bool:
        """Whether so little of it is left that the motion has ended."""
        shift_m, turn_rad = np.linalg.norm(self.shift_m), np.linalg.norm(self.turn_rad)
        return float(shift_m) <= ARRIVED_M and float(turn_rad) <= ARRIVED_RAD

    def at(self, share: float) -> Float[np.ndarray, "4 4"]:
        """The pose at a share of the way: at 0 the first, at 1 the second."""
        pose = turned(self.first, share * self.turn_rad)
        pose[:3, 3] += share * self.shift_m
        return np.asarray(pose)


def next_speed_m_s(
    speed_m_s: float, most_m_s: float, left_m: float, acceleration_m_s2: float, time_s: float
) -> float:
    """Speed of a setpoint one period later.

    Parameters
    ----------
    speed_m_s
        Its speed now [m/s].
    most_m_s
        The greatest that it may have [m/s].
    left_m
        What is left of its way [m]: it brakes in time to rest at the end.
    acceleration_m_s2
        By which it gains speed and brakes [m/s2].
    time_s
        The period [s].

    Returns
    -------
    The speed [m/s].
    """
    braking_m_s = float(np.sqrt(2 * acceleration_m_s2 * left_m))
    return min(speed_m_s + acceleration_m_s2 * time_s, most_m_s, braking_m_s)
