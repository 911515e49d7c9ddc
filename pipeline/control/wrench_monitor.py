"""Events that wrench and vacuum show: contact, collision, seal, slip, loss.

Supplement VI: the force-torque wrench is «mainly utilized to monitor the grasp status, like
collision and grasp success, optimize the robotic motion, and minimize the moments on the gripper
base during grasping». A wrench from joint torques does not tell an object of some grams from none;
where a sensor tells the vacuum at the pad, that decides.
"""

import math
from collections import deque
from dataclasses import replace
from enum import StrEnum

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from pipeline.config.policy import PolicyConfig
from pipeline.control.robot import Reading


class Event(StrEnum):
    """What a reading shows."""

    NOTHING = "nothing"
    CONTACT = "contact"
    COLLISION = "collision"
    BLOCKED = "blocked"
    SLIP = "slip"
    LOSS = "loss"


class WrenchMonitor:
    """Watches the readings of one attempt."""

    def __init__(
        self, config: PolicyConfig, error_n: float = 0.0, vacuum_error: float = 0.0
    ) -> None:
        """Nothing was read yet.

        Parameters
        ----------
        config
            Thresholds.
        error_n
            Standard deviation of a force that is read, by the robot's data sheet [N]; less than so
            many of it, as the configuration says, tells nothing.
        vacuum_error
            The same of the vacuum that is read, over the pump's greatest.
        """
        self._config = config
        self._contact_n = max(config.contact_n, config.contact_sigmas * error_n)
        self._tension_n = max(config.tension_min_n, config.tension_sigmas * error_n)
        self._sure_n = max(config.tension_min_n, config.contact_sigmas * error_n)
        self._vacuum_error = vacuum_error
        self._line: Float[np.ndarray, " 3"] | None = None
        self._missed = 0
        self._vacuum: deque[float] = deque(maxlen=config.loss_readings)

    def moving(self, reading: Reading) -> Event:
        """The event of a reading in free space or during the approach."""
        if reading.peak_n > self._config.force_limit_n:
            return Event.COLLISION
        if not reading.followed:
            return Event.BLOCKED
        if reading.wrench[2] > self._contact_n:
            return Event.CONTACT
        return Event.NOTHING

    def holds(self, reading: Reading, readings: int = 1) -> bool:
        """Whether an object is held (grasp success): the vacuum shows it, or its pull.

        Without a sensor of the vacuum, a pull that is likely an object's is enough. With one, an
        open pad tells that nothing is held, unless the pull is sure: what leaks much may be heavy.

        Parameters
        ----------
        reading
            What was felt.
        readings
            How many readings its vacuum is the mean of: the more, the less of it is noise.

        Returns
        -------
        False where nothing tells an object.
        """
        if math.isnan(reading.pressure):
            return self.pulls(reading)
        return reading.pressure >= self._least(readings) or hanging_n(reading) >= self._sure_n

    def _least(self, readings: int) -> float:
        """The vacuum that a mean of so many readings must show."""
        error = self._vacuum_error / math.sqrt(readings)
        return max(self._config.vacuum_min, self._config.vacuum_sigmas * error)

    def pulls(self, reading: Reading) -> bool:
        """Whether the wrench alone tells an object: where its load hangs can be told then."""
        return hanging_n(reading) >= self._tension_n

    def carrying(self, reading: Reading) -> Event:
        """The event of a reading while an object is held: lost, or slipped under the pad."""
        if not self._still_holds(reading):
            self._missed += 1
            return Event.LOSS if self._missed >= self._config.loss_readings else Event.NOTHING
        self._missed = 0
        if not self.pulls(reading):
            return Event.NOTHING  # too light to tell where it hangs
        before, self._line = self._line, line_of_load(reading.wrench)
        if before is not None and np.linalg.norm(self._line - before) > self._config.slip_m:
            return Event.SLIP
        return Event.NOTHING

    def _still_holds(self, reading: Reading) -> bool:
        """The same of what was held before: by the mean vacuum of the last readings."""
        self._vacuum.append(reading.pressure)
        mean = float(np.mean(self._vacuum))
        return self.holds(replace(reading, pressure=mean), len(self._vacuum))


def hanging_n(reading: Reading) -> float:
    """Downward pull on the gripper in WCS [N]."""
    return -float(reading.world_from_gripper[2, :3] @ reading.wrench[:3])


def line_of_load(wrench: Float[np.ndarray, " 6"]) -> Float[np.ndarray, " 3"]:
    """The point of a force's line of action nearest to the base: F x M / |F|^2, in GCS [m]."""
    force, moment = wrench[:3], wrench[3:]
    return np.asarray(np.cross(force, moment) / max(float(force @ force), 1e-12))


def trim_pose(
    world_from_gripper: Float[np.ndarray, "4 4"],
    wrench: Float[np.ndarray, " 6"],
    left_rad: float,
    config: PolicyConfig,
    error_nm: float = 0.0,
) -> tuple[Float[np.ndarray, "4 4"], float]:
    """Turn the pose about the pad so that the moment at the base becomes smaller.

    A load F at r from the base has the moment M = r x F. A turn by a small angle about M moves the
    load's line nearer to the base, by the angle times the load's depth below it. Torsion about the
    gripper's axis is not corrected, as no tilt reduces it.

    Parameters
    ----------
    world_from_gripper
        The pose now, shape (4, 4).
    wrench
        Force [N] and moment [N m] at the base in GCS, shape (6,).
    left_rad
        Largest angle that it may turn by [rad].
    config
        Moment below which nothing is done, lever, and largest step.
    error_nm
        Standard deviation of a moment that is read [N m]; a smaller one is not acted upon.

    Returns
    -------
    The new pose, shape (4, 4), and the angle turned [rad].
    """
    force = wrench[:3]
    moment = wrench[3:] * [1.0, 1.0, 0.0]
    size = float(np.linalg.norm(moment))
    if size < max(config.trim_moment_nm, error_nm):
        return world_from_gripper, 0.0
    aside_m = size / max(float(np.linalg.norm(force)), 1e-9)
    angle = min(aside_m / config.trim_lever_m, config.trim_step_rad, left_rad)
    turn = Rotation.from_rotvec(angle * moment / size).as_matrix()
    pose = world_from_gripper.copy()
    pose[:3, :3] = pose[:3, :3] @ turn
    return pose, angle
