"""One attempt on a robot, judged by what the robot feels, as a record like those of simulation."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.control.attempts import JudgedAttempt, LoggedEyes
from pipeline.control.decision import Cause, Decision, Strategy, TriedContact
from pipeline.control.policy import Attempt
from pipeline.control.robot import Eyes
from pipeline.robot.arm import DrivenRobot

JUDGE = "robot"  # what messages call this judge
# Under this share of the seal's vacuum the pad draws air: what it held is gone.
LOST_SHARE = 0.5


def try_once(
    eyes: Eyes,
    robot: DrivenRobot,
    strategy: Strategy,
    config: RunConfig,
    rng: np.random.Generator,
    avoid_m: Sequence[Float[np.ndarray, " 3"]] = (),
    felt: Sequence[TriedContact] = (),
) -> JudgedAttempt:
    """Make one attempt, put down what was lifted, and go home.

    Parameters
    ----------
    eyes
        The cell's cameras.
    robot
        Its arm and vacuum.
    strategy
        The policy, such as that of the simulation's closed loop.
    config
        Sections evaluate, grasps and gripper.
    rng
        Draws the candidates.
    avoid_m
        Contacts that failed before, in WCS [m], each of shape (3,).
    felt
        Seals that failed before.

    Returns
    -------
    What was decided and felt. An object counts as lifted where its weight hung on the flange
    through lift, shake and transport and, where there is a pressure sensor, the vacuum stayed.
    """
    robot.begin()
    logged = LoggedEyes(eyes, lambda: len(robot.samples) - 1)
    decision = Attempt(
        logged, robot, strategy, config.evaluate, config.grasps.normal_radius_m, rng, avoid_m, felt
    ).run()
    made = _judged(decision, robot, logged)
    robot.put_down()
    return made


def _judged(decision: Decision, robot: DrivenRobot, eyes: LoggedEyes) -> JudgedAttempt:
    samples = list(robot.samples)
    last = samples[-1]
    cause = decision.cause
    leaks = last.pressure < LOST_SHARE * robot.seal_pressure  # False without a sensor: NaN
    if cause is Cause.LIFTED and leaks:
        cause = Cause.LOST_IN_TRANSPORT
    lifted = cause is Cause.LIFTED
    pull = last.world_from_gripper[2, :3] @ last.wrench[:3]
    return JudgedAttempt(
        decision=decision,
        cause=cause,
        target="",
        reached_quality=math.nan,
        seal_pressure=robot.seal_pressure,
        borne_n=math.nan,
        weight_n=max(-float(pull), 0.0) if lifted else 0.0,
        lifted_height_m=float(last.world_from_gripper[2, 3] - robot.reached_pose[2, 3])
        if lifted
        else 0.0,
        duration_s=last.time_s,
        reached_pose=robot.reached_pose,
        samples=samples,
        seen=eyes.seen,
    )
