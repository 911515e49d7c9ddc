"""A driver's arm and vacuum, with their calibration, as the policy's `Robot`.

Between two control steps of the policy the arm follows setpoints at the driver's own period, and
stops within one of them where the pad touches: at 0.25 m/s and 8 ms that is 2 mm.
"""

import math

import numpy as np
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.control.attempts import Sample
from pipeline.control.robot import Reading, State
from pipeline.control.setpoints import ARRIVED_M, LAG_M, Way, next_speed_m_s
from pipeline.control.transport import there_and_back, way_aside_m
from pipeline.errors import CalibrationError
from pipeline.geometry.transforms import invert
from pipeline.robot.calibration import Calibration
from pipeline.robot.driver import Driver

GRAVITY_M_S2 = 9.81  # standard gravity to three digits
TARE_READINGS = 50  # of which the mean is the wrench's bias, and the spread its noise
SIGMAS = 3.0  # a threshold this many standard deviations over noise is rarely passed by chance
_LOST_M = 0.03  # an arm that lags by more does not follow
_SETTLE_S = 1.0  # an arm that has not come to rest at its last setpoint by then does not follow


class DrivenRobot:
    """The cell's arm and vacuum as `pipeline.control.robot.Robot`, with a record of the attempt."""

    def __init__(self, driver: Driver, calibration: Calibration, config: RunConfig) -> None:
        """Nothing moves yet; `begin` does.

        Parameters
        ----------
        driver
            Moves the arm.
        calibration
            Frames, the hand's weight, the pressure sensor.
        config
            Speeds, thresholds, lift and transport.
        """
        self._driver = driver
        self._calibration = calibration
        self._config = config
        self._policy = config.evaluate.policy
        self._bias = np.zeros(6)
        self._sucks = False
        self._speed_m_s = 0.0
        self._waited = 0
        self._steps = max(1, round(1 / self._policy.rate_hz / driver.period_s))
        self.samples: list[Sample] = []

    def begin(self) -> None:
        """Go home, weigh the empty hand, and begin the record of an attempt.

        Raises
        ------
        CalibrationError
            The wrench's noise is as large as what is to tell a held object or a touch.
        """
        self._state = State.OBSERVE
        self._sucks = False
        self._driver.vacuum(on=False)
        self._goal = self.pose()
        self._go(self._calibration.home)
        self.tare()
        self.reached_pose = np.eye(4)
        self.seal_pressure = math.nan
        self._began_s = self._driver.time_s()
        self.samples = []
        self._sample(np.zeros(6))

    def put_down(self) -> None:
        """Carry what is held to where it is let go, then go home."""
        self._go(self._calibration.drop)
        self.vacuum(on=False)
        self._go(self._calibration.home)

    def enter(self, state: State) -> None:
        """Store the policy's phase for the record."""
        self._state = state

    def think(self) -> None:
        """Do nothing: on a real arm the time that ranking takes has passed already."""

    def pose(self) -> Float[np.ndarray, "4 4"]:
        """Measured world_from_gripper."""
        return self._calibration.world_from_gripper(self._driver.base_from_flange())

    def reachable(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Whether the arm can take the pose."""
        return self._driver.reachable(self._flange_at(world_from_gripper))

    def step(self, world_from_gripper: Float[np.ndarray, "4 4"], speed_m_s: float) -> Reading:
        """Move straight towards a pose for one control period; stop where the pad touches.

        Parameters
        ----------
        world_from_gripper
            The pose to reach, shape (4, 4).
        speed_m_s
            Greatest speed [m/s].

        Returns
        -------
        Pose, wrench and what happened in this period.
        """
        felt, peak_n, followed, touched = [], 0.0, True, False
        for _ in range(self._steps):
            if not touched:
                self._advance(world_from_gripper, speed_m_s)
            followed &= self._driver.move(self._flange_at(self._goal))
            felt.append(self._wrench())
            push_n = felt[-1][2]
            peak_n = max(peak_n, float(np.linalg.norm(felt[-1][:3])))
            if not self._sucks and not touched and push_n > self._policy.contact_n:
                touched, self._goal, self._speed_m_s = True, self.pose(), 0.0
        wrench = felt[-1] if touched else np.mean(felt, axis=0)
        followed &= self._follows()
        return self._reading(wrench, peak_n, self._at(world_from_gripper), followed)

    def vacuum(self, on: bool) -> None:
        """Switch the vacuum, and note where."""
        if on:
            self.reached_pose = self.pose()
        self._sucks = on
        self._driver.vacuum(on)

    def shake(self) -> Reading:
        """Move side to side, then stop; the wrench is the mean at rest."""
        lift, dt = self._config.evaluate.lift, self._driver.period_s
        centre = self._goal.copy()
        for number in range(1, round(lift.shake_s / dt) + 1):
            goal = centre.copy()
            goal[0, 3] += lift.shake_m * math.sin(2 * math.pi * lift.shake_hz * number * dt)
            self._play(goal, number)
        return self._rest(centre, lift.hold_s)

    def carry(self, acceleration_m_s2: float) -> Reading:
        """Aside and back at an acceleration, then stop; the wrench is the mean at rest."""
        transport, dt = self._config.evaluate.transport, self._driver.period_s
        start = self._goal.copy()
        aside_m = way_aside_m(start, transport.way_m, self.reachable)
        leg_s = 2 * math.sqrt(max(float(np.linalg.norm(aside_m)), ARRIVED_M) / acceleration_m_s2)
        for number in range(1, math.ceil(2 * leg_s / dt) + 1):
            goal = start.copy()
            goal[:3, 3] += there_and_back(number * dt / leg_s) * aside_m
            self._play(goal, number)
        return self._rest(start, transport.rest_s)

    def _play(self, goal: Float[np.ndarray, "4 4"], number: int) -> None:
        """Give one setpoint of a planned motion; take a sample once in a control period."""
        self._goal = goal
        self._driver.move(self._flange_at(goal))
        if number % self._steps == 0:
            self._sample(self._wrench())

    def _rest(self, goal: Float[np.ndarray, "4 4"], time_s: float) -> Reading:
        """Stay at a setpoint for a time [s]; the wrench is the mean of the last period."""
        felt = []
        for number in range(1, max(round(time_s / self._driver.period_s), self._steps) + 1):
            self._play(goal, number)
            felt.append(self._wrench())
        return self._reading(np.mean(felt[-self._steps :], axis=0), 0.0, True, followed=True)

    def _go(self, pose: Float[np.ndarray, "4 4"]) -> None:
        """Travel to a pose. Raises CalibrationError where the arm stops on the way."""
        while not self._at(pose):
            self._advance(pose, self._policy.travel_m_s)
            moved = self._driver.move(self._flange_at(self._goal))
            if not (moved and self._follows()):
                raise CalibrationError(
                    f"the arm stopped on its way to {np.round(pose[:3, 3], 3).tolist()} m",
                    "Free it, and check home_m and drop_m",
                )

    def _advance(self, target: Float[np.ndarray, "4 4"], speed_m_s: float) -> None:
        """Move the setpoint by one period, within speed and acceleration."""
        way = Way.between(self._goal, target)
        left_m = way.length_m
        if left_m < ARRIVED_M / 100:
            self._goal, self._speed_m_s = target.copy(), 0.0
            self._waited += 1
            return
        self._waited = 0
        acceleration, dt = self._policy.acceleration_m_s2, self._driver.period_s
        self._speed_m_s = next_speed_m_s(self._speed_m_s, speed_m_s, left_m, acceleration, dt)
        self._goal = way.at(min(self._speed_m_s * dt / left_m, 1.0))

    def tare(self) -> None:
        """Take the mean of what the empty, resting hand reads as the bias.

        Raises
        ------
        CalibrationError
            The wrench's noise is as large as what is to tell a held object or a touch.
        """
        readings = []
        for _ in range(TARE_READINGS):
            self._driver.move(self._flange_at(self._goal))
            readings.append(self._driver.wrench() - self._hand_weight())
        self._bias = np.mean(readings, axis=0)
        # The policy looks at means over a control period.
        noise_n = float(np.std(readings, axis=0)[:3].max()) / math.sqrt(self._steps)
        for name in ("tension_min_n", "contact_n"):
            least_n = getattr(self._policy, name)
            if SIGMAS * noise_n > least_n:
                raise CalibrationError(
                    f"the wrench's noise at rest is {noise_n:.3g} N, and evaluate.policy.{name} = "
                    f"{least_n:g} N would be passed by chance",
                    f"Raise it in run.toml to {SIGMAS * noise_n:.2g} N or more",
                )

    def _wrench(self) -> Float[np.ndarray, " 6"]:
        """What the world exerts on the flange, without the hand's own weight; axes of GCS."""
        felt = self._driver.wrench() - self._bias - self._hand_weight()
        into_gripper = self._calibration.flange_from_gripper[:3, :3].T
        return np.concatenate([into_gripper @ felt[:3], into_gripper @ felt[3:]])

    def _hand_weight(self) -> Float[np.ndarray, " 6"]:
        """The hand's own weight at the flange, in its axes."""
        held = self._calibration
        world_from_flange = held.world_from_base @ self._driver.base_from_flange()
        down = np.array([0.0, 0.0, -held.hand_mass_kg * GRAVITY_M_S2])
        force = world_from_flange[:3, :3].T @ down
        return np.concatenate([force, np.cross(held.hand_centre_m, force)])

    def _reading(
        self, wrench: Float[np.ndarray, " 6"], peak_n: float, arrived: bool, followed: bool
    ) -> Reading:
        self._sample(wrench)
        last = self.samples[-1]
        return Reading(last.world_from_gripper, wrench, peak_n, arrived, followed, last.pressure)

    def _sample(self, wrench: Float[np.ndarray, " 6"]) -> None:
        pressure = self._calibration.pressure(self._driver.vacuum_pa())
        if self._sucks:
            self.seal_pressure = float(np.fmax(self.seal_pressure, pressure))
        time_s = self._driver.time_s() - self._began_s
        self.samples.append(
            Sample(time_s, self.pose(), {}, wrench, str(self._state), np.empty(0), pressure)
        )

    def _flange_at(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4 4"]:
        held = self._calibration
        world_from_flange = world_from_gripper @ invert(held.flange_from_gripper)
        return np.asarray(invert(held.world_from_base) @ world_from_flange)

    def _lag_m(self) -> float:
        return float(np.linalg.norm(self._goal[:3, 3] - self.pose()[:3, 3]))

    def _follows(self) -> bool:
        """Whether the arm is near its setpoint, and comes to rest at the last one of a motion."""
        late = self._waited * self._driver.period_s > _SETTLE_S and self._lag_m() > LAG_M
        return self._lag_m() < _LOST_M and not late

    def _at(self, target: Float[np.ndarray, "4 4"]) -> bool:
        """Whether the target was commanded and the arm is there."""
        return self._lag_m() <= LAG_M and Way.between(self._goal, target).is_done
