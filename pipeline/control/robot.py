"""What the policy needs: cameras, and a robot that moves one control step at a time."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from jaxtyping import Float

from pipeline.control.cloud import DepthPicture
from pipeline.world.cameras import PinholeCamera


class State(StrEnum):
    """The phase that an attempt is in."""

    OBSERVE = "observe"
    PREGRASP = "pregrasp"
    APPROACH = "approach"
    SEAL = "seal"
    LIFT = "lift"
    SHAKE = "shake"
    TRANSPORT = "transport"
    DONE = "done"


@dataclass(frozen=True, eq=False)
class Reading:
    """What the robot felt during one control step.

    Attributes
    ----------
    world_from_gripper
        The pose reached at its end.
    wrench
        (6,) mean force [N] and moment [N m] that the world exerts on the gripper, at the
        gripper's base (the flange), in GCS; its own weight is taken off. An object that hangs
        on a level pad pulls along -z.
    peak_n
        Largest force during the step [N].
    arrived
        Whether the target was reached.
    followed
        False where the arm could not go on.
    pressure
        Vacuum at the pad over the pump's greatest, in [0, 1]; NaN where nothing measures it.
    """

    world_from_gripper: Float[np.ndarray, "4 4"]
    wrench: Float[np.ndarray, " 6"]
    peak_n: float
    arrived: bool
    followed: bool = True
    pressure: float = math.nan


class Eyes(Protocol):
    """The cameras; a camera that has stopped returns None.

    Pictures hold poses as they are calibrated, and nothing of the gripper itself:
    `pipeline.control.own_body.cut_gripper_out`.
    """

    def static(self) -> list[DepthPicture] | None:
        """One picture of every camera beside the table."""
        ...

    def wrist_camera(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> PinholeCamera:
        """The wrist's camera as it is calibrated, for the gripper at a pose."""
        ...

    def wrist(self, around_m: Float[np.ndarray, " 3"], radius_m: float) -> DepthPicture | None:
        """What the wrist's camera sees of a ball in WCS from where the gripper is now."""
        ...


class Robot(Protocol):
    """Moves the gripper and switches the vacuum."""

    def enter(self, state: State) -> None:
        """Receive the phase that begins now, for the recording."""
        ...

    def tare(self) -> None:
        """Set the wrench to zero that is felt now, in free air."""
        ...

    def think(self) -> None:
        """All candidates have been ranked: a simulated robot waits as long as that takes."""
        ...

    def pose(self) -> Float[np.ndarray, "4 4"]:
        """world_from_gripper now."""
        ...

    def reachable(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Whether the robot can take the pose within its joint limits."""
        ...

    def step(self, world_from_gripper: Float[np.ndarray, "4 4"], speed_m_s: float) -> Reading:
        """Move straight towards a pose for one control period; stop where the pad touches."""
        ...

    def vacuum(self, on: bool) -> None:
        """Switch the vacuum."""
        ...

    def shake(self) -> Reading:
        """Move side to side, then stop, as `LiftConfig` says; return the mean wrench at rest."""
        ...

    def carry(self, acceleration_m_s2: float) -> Reading:
        """Go aside and back, then stop, as `TransportConfig` says; the mean wrench at rest."""
        ...
