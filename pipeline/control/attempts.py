"""What is kept of an attempt, in simulation and on a robot: states, pictures, how it ended."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from pipeline.control.cloud import DepthPicture
from pipeline.control.decision import Cause, Decision, TriedContact
from pipeline.control.robot import Eyes
from pipeline.world.cameras import PinholeCamera


@dataclass(frozen=True, eq=False)
class Sample:
    """State at the end of a control step.

    Attributes
    ----------
    time_s
        Time since the attempt began, simulated or of the robot's clock [s].
    world_from_gripper
        Pose of the gripper, shape (4, 4).
    world_from_object
        Pose of each body by body id, shape (4, 4); empty where nothing knows them.
    wrench
        Force [N] and moment [N m] at the flange, in the axes of GCS, shape (6,).
    state
        Name of the policy's state.
    joints_rad
        Joint angles of the arm [rad]; empty where there is none.
    pressure
        Vacuum at the pad over the pump's greatest, in [0, 1]; NaN where nothing measures it.
    """

    time_s: float
    world_from_gripper: Float[np.ndarray, "4 4"]
    world_from_object: dict[int, Float[np.ndarray, "4 4"]]
    wrench: Float[np.ndarray, " 6"]
    state: str
    joints_rad: Float[np.ndarray, " joints"]
    pressure: float


@dataclass(frozen=True, eq=False)
class SeenPicture:
    """A picture that the policy took.

    Attributes
    ----------
    step
        Number of the last sample before it.
    picture
        What was measured, and the camera that describes this part.
    whole
        The camera of the whole picture, of which the policy looked at a part.
    """

    step: int
    picture: DepthPicture
    whole: PinholeCamera


@dataclass(frozen=True, eq=False)
class JudgedAttempt:
    """One attempt: what the policy decided, and what was then measured.

    Attributes
    ----------
    decision
        The policy's decision, with its candidates and pictures.
    cause
        Why the attempt ended, corrected by what physics or the robot's sensors show;
        `Cause.LIFTED` is a success.
    target
        Name of the object under the pad; empty where the vacuum met none, or nothing knows it.
    reached_quality
        q of Algorithm 1 on the true surfaces at the pose reached; NaN on a robot.
    seal_pressure
        Quality of the seal as the judge or the pressure sensor found it, in [0, 1]; NaN where
        nothing measured it.
    borne_n
        Largest weight at the object's centre of mass that the last seal bears through lift, shake
        and transport, as the judge finds it [N]; NaN on a robot.
    weight_n
        Weight of the object under the pad [N]; 0 where there is none. On a robot what hung on the
        pad while it stood still.
    lifted_height_m
        Height of the object above where it was sealed, at the end [m].
    duration_s
        Simulated or measured time [s].
    reached_pose
        world_from_gripper when the vacuum was switched on, shape (4, 4).
    samples
        State at the end of each control step.
    seen
        Every picture that the policy took, in order.
    body_id
        Of the object under the pad; 0 where there is none, or nothing knows it.
    ceilings_n
        By body id, before the attempt: the weight that the best pose bears, and the weight [N];
        empty where it was not looked for.
    """

    decision: Decision
    cause: Cause
    target: str
    reached_quality: float
    seal_pressure: float
    borne_n: float
    weight_n: float
    lifted_height_m: float
    duration_s: float
    reached_pose: Float[np.ndarray, "4 4"]
    samples: list[Sample]
    seen: list[SeenPicture] = field(default_factory=list)
    body_id: int = 0
    ceilings_n: dict[int, tuple[float, float]] = field(default_factory=dict)


def failed_seals(made: JudgedAttempt) -> list[TriedContact]:
    """The seals of an attempt that lifted nothing: all but the last one of a success."""
    tried = made.decision.tried
    return tried[:-1] if made.cause is Cause.LIFTED else list(tried)


class LoggedEyes:
    """`Eyes` that keep every picture with the control step at which it was taken."""

    def __init__(self, eyes: Eyes, last_step: Callable[[], int]) -> None:
        """Begin with no picture.

        Parameters
        ----------
        eyes
            The cameras.
        last_step
            Number of the last sample so far.
        """
        self._eyes = eyes
        self._last_step = last_step
        self.seen: list[SeenPicture] = []

    def static(self) -> list[DepthPicture] | None:
        """One picture of every camera beside the table."""
        pictures = self._eyes.static()
        for picture in pictures or []:
            self.seen.append(SeenPicture(self._last_step(), picture, picture.camera))
        return pictures

    def wrist_camera(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> PinholeCamera:
        """The wrist's camera as it is calibrated, for the gripper at a pose."""
        return self._eyes.wrist_camera(world_from_gripper)

    def wrist(self, around_m: Float[np.ndarray, " 3"], radius_m: float) -> DepthPicture | None:
        """What the wrist's camera sees of a ball in WCS."""
        picture = self._eyes.wrist(around_m, radius_m)
        if picture is not None:
            whole = self._eyes.wrist_camera(np.eye(4))
            self.seen.append(SeenPicture(self._last_step(), picture, whole))
        return picture
