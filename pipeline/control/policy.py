"""One attempt, from the first look to the lifted object or the cause why not.

The policy looks, scores u candidates in one batch, goes above the best, looks again on the way
down and corrects the contact (Supplement VI), seals, lifts, shakes. What it needs of the world
is in the three protocols; each way to end has a name.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import EvaluateConfig
from pipeline.control.candidates import above_table, sample_candidates, sample_near

PREGRASP_M = 0.10  # above the contact, along the approach
_RETREAT_M = 0.05


class State(StrEnum):
    """Where an attempt is."""

    OBSERVE = "observe"
    PREGRASP = "pregrasp"
    APPROACH = "approach"
    SEAL = "seal"
    LIFT = "lift"
    SHAKE = "shake"
    DONE = "done"


class Cause(StrEnum):
    """Why an attempt ended; LIFTED is the good one."""

    LIFTED = "lifted"
    EMPTY_CLOUD = "empty cloud"
    NO_CANDIDATE = "no candidate"
    COLLISION = "collision"
    NO_SEAL = "no seal"
    LOST_IN_LIFT = "lost in lift"
    LOST_IN_SHAKE = "lost in shake"


@dataclass(frozen=True)
class Observation:
    """Measured points in WCS, the camera's place, and a way to score grasps on the picture."""

    points_m: Float[np.ndarray, "n 3"]
    eye_m: Float[np.ndarray, " 3"]
    depth_m: Float[np.ndarray, "h w"]


class Sensor(Protocol):
    """Looks at the scene as it is now."""

    def look(self) -> Observation: ...


class Scorer(Protocol):
    """q-hat of every candidate, in one batch."""

    def __call__(
        self, observation: Observation, world_from_contact: Float[np.ndarray, "k 4 4"], /
    ) -> Float[np.ndarray, " k"]: ...


class Robot(Protocol):
    """Moves the gripper and switches the vacuum."""

    def enter(self, state: State) -> None: ...

    def move(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Straight there; False where a collision stopped it."""
        ...

    def seal(self) -> bool:
        """Lower the pad until it touches and switch the vacuum on; whether it holds something."""
        ...

    def lift(self) -> bool:
        """Up; whether the object is still held at the top."""
        ...

    def shake(self) -> bool:
        """Shake and hold; whether the object is still held."""
        ...


@dataclass(frozen=True)
class Decision:
    """How an attempt went, as far as the policy knows."""

    cause: Cause
    candidates: int
    predicted_quality: float
    world_from_contact: Float[np.ndarray, "4 4"]


def attempt(
    sensor: Sensor,
    robot: Robot,
    score: Scorer,
    config: EvaluateConfig,
    normal_radius_m: float,
    rng: np.random.Generator,
) -> Decision:
    """Try once."""
    policy = config.policy
    robot.enter(State.OBSERVE)
    seen = sensor.look()
    points = above_table(seen.points_m)
    if len(points) == 0:
        return Decision(Cause.EMPTY_CLOUD, 0, 0.0, np.eye(4))
    candidates = sample_candidates(points, seen.eye_m, normal_radius_m, policy, rng)
    if len(candidates) == 0:
        return Decision(Cause.NO_CANDIDATE, 0, 0.0, np.eye(4))
    quality = score(seen, candidates)
    best = int(np.argmax(quality))
    pose, predicted = candidates[best], float(quality[best])

    robot.enter(State.PREGRASP)
    count = len(candidates)
    if not robot.move(backed_off(pose, PREGRASP_M)):
        return Decision(Cause.COLLISION, count, predicted, pose)

    robot.enter(State.APPROACH)
    for step in range(policy.corrections):
        pose, predicted = corrected(sensor, score, pose, predicted, config, normal_radius_m, rng)
        left = PREGRASP_M * (1.0 - (step + 1) / (policy.corrections + 1))
        if not robot.move(backed_off(pose, left)):
            return Decision(Cause.COLLISION, count, predicted, pose)

    robot.enter(State.SEAL)
    cause = Cause.LIFTED
    if not robot.seal():
        cause = Cause.NO_SEAL
        robot.move(backed_off(pose, _RETREAT_M))
    else:
        robot.enter(State.LIFT)
        if not robot.lift():
            cause = Cause.LOST_IN_LIFT
        else:
            robot.enter(State.SHAKE)
            cause = Cause.LIFTED if robot.shake() else Cause.LOST_IN_SHAKE
    robot.enter(State.DONE)
    return Decision(cause, count, predicted, pose)


def corrected(
    sensor: Sensor,
    score: Scorer,
    pose: Float[np.ndarray, "4 4"],
    predicted: float,
    config: EvaluateConfig,
    normal_radius_m: float,
    rng: np.random.Generator,
) -> tuple[Float[np.ndarray, "4 4"], float]:
    """Look again and take the best contact near the one aimed at; its pose and q-hat."""
    seen = sensor.look()
    points = above_table(seen.points_m)
    if len(points) == 0:
        return pose, predicted
    near = sample_near(points, pose[:3, 3], seen.eye_m, normal_radius_m, config.policy, rng)
    if len(near) == 0:
        return pose, predicted
    quality = score(seen, near)
    best = int(np.argmax(quality))
    return near[best], float(quality[best])


def backed_off(
    world_from_contact: Float[np.ndarray, "4 4"], distance_m: float
) -> Float[np.ndarray, "4 4"]:
    """The pose out along its approach."""
    pose = world_from_contact.copy()
    pose[:3, 3] += distance_m * pose[:3, 2]
    return pose
