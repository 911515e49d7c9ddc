"""One attempt, from the first picture to the lifted object or the cause of the failure.

Global phase: the policy merges the clouds of several viewpoints, samples u candidates, and ranks
them in one batch. It leaves out candidates that the robot cannot reach or at which the gripper
would collide. Local phase: the wrist's camera takes a picture at every control step, and the policy
corrects the contact, until the camera is too near; then the gripper goes straight on until contact.

After the contact the wrench is used (Supplement VI). If the first tug shows that the object is not
held, it is grasped once more: nearer to its centre of mass where the wrench gave that, otherwise at
the next best place. An object that only the colour pictures show is tried when no measured contact
is left; the gripper then goes straight down until contact.

`pipeline.control.robot` defines the cameras and the robot that the policy uses,
`pipeline.control.decision` the causes with which an attempt ends.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import EvaluateConfig
from pipeline.control.cloud import DepthPicture
from pipeline.control.decision import Cause, Decision, Strategy, TriedContact
from pipeline.control.global_phase import Choice, GlobalPhase
from pipeline.control.local_phase import LocalPhase, way_left_m
from pipeline.control.regrasp import load_place_m
from pipeline.control.robot import Eyes, Reading, Robot, State
from pipeline.control.viewpoints import back_off, is_on_axis
from pipeline.control.wrench_monitor import Event, WrenchMonitor, hanging_n, trim_pose

Phase = tuple[State, Callable[[], Cause | None]]


class Attempt:
    """One attempt: `run` goes through the phases; each returns None or the cause of failure."""

    def __init__(
        self,
        eyes: Eyes,
        robot: Robot,
        strategy: Strategy,
        config: EvaluateConfig,
        normal_radius_m: float,
        rng: np.random.Generator,
        avoid_m: Sequence[Float[np.ndarray, " 3"]] = (),
        felt: Sequence[TriedContact] = (),
    ) -> None:
        """Prepare an attempt; nothing moves yet.

        Parameters
        ----------
        eyes
            The cameras.
        robot
            Moves the gripper and switches the vacuum.
        strategy
            Ranking, and which of pictures and wrench are used.
        config
            Settings of policy, lift and gripper.
        normal_radius_m
            Radius over which a contact's normal is measured [m].
        rng
            Generator of the candidates.
        avoid_m
            Contacts in WCS that failed in earlier attempts [m], each of shape (3,); places near
            them are tried only where nothing else is left.
        felt
            Seals that failed in earlier attempts; where the strategy feels, the vacuum measured
            there tells of places near them.
        """
        self._eyes = eyes
        self._robot = robot
        self._strategy = strategy
        self._config = config
        self._policy = config.policy
        robots = config.imperfection
        self._monitor = WrenchMonitor(config.policy, robots.force_error_n, robots.vacuum_error)
        told = [seal for seal in felt if self._tells(seal)]
        self._global = GlobalPhase(
            eyes, robot, strategy, config, normal_radius_m, rng, avoid_m, told
        )
        self._local = LocalPhase(strategy.ranking, config, normal_radius_m, rng)
        self._new_choices_left = config.policy.new_choices
        self._retargets_left = config.policy.retargets if strategy.corrects else 0
        self._regrasps_left = config.policy.regrasps if strategy.seals_again else 0
        self._moment_error_nm = robots.moment_error_nm
        self._aim_unmeasured = False
        self._gain = config.policy.correction_gain
        self.decision = Decision()

    def run(self) -> Decision:
        """Make the attempt, and return what was decided and why it ended."""
        self._robot.tare()
        cause = self._run_phases(
            (State.OBSERVE, self._choose),
            *self._phases_to_seal(),
            (State.LIFT, self._lift),
            (State.SHAKE, self._shake),
            (State.TRANSPORT, self._transport),
        )
        self._robot.enter(State.DONE)
        self.decision.cause = cause or Cause.LIFTED
        return self.decision

    def _phases_to_seal(self) -> tuple[Phase, ...]:
        return (
            (State.PREGRASP, self._go_above),
            (State.APPROACH, self._approach),
            (State.SEAL, self._seal),
        )

    def _run_phases(self, *phases: Phase) -> Cause | None:
        """Run the phases one after the other; stop at the first that returns a cause."""
        for state, phase in phases:
            self._robot.enter(state)
            cause = phase()
            if cause is not None:
                return cause
        return None

    def _choose(self) -> Cause | None:
        """The global phase: take pictures, then aim at the best contact that can be reached."""
        return self._choose_from(several_views=self._strategy.several_views)

    def _choose_from(self, several_views: bool) -> Cause | None:
        cause = self._global.look(self.decision, self._travel if several_views else None)
        if cause is not None:
            return cause
        return None if self._aim_at(self._global.best(least=0.0)) else Cause.UNREACHABLE

    def _retarget(self) -> bool:
        """Aim at another contact if its q-hat is clearly higher now; whether there was one."""
        if self._retargets_left == 0:
            return False
        wanted = self.decision.predicted_quality + self._policy.retarget_gain
        if not self._aim_at(self._global.better_than(self.decision.world_from_contact, wanted)):
            return False
        self._retargets_left -= 1
        return True

    def _go_above(self) -> Cause | None:
        return self._travel(back_off(self.decision.world_from_contact, self._policy.standoff_m))

    def _approach(self) -> Cause | None:
        """The local phase: take a picture, correct, step; until the pad touches.

        A moving object is followed only within the robot's reach and for at most
        ``approach_max_s``.
        """
        self._robot.tare()
        for _ in range(round(self._policy.approach_max_s * self._policy.rate_hz)):
            aim = self.decision.world_from_contact
            here = self._robot.pose()
            if self._strategy.corrects and not self._aim_unmeasured and self._sees(aim, here):
                cause = self._correct()
                if cause is None and self._retarget():
                    cause = self._go_above()
                if cause is not None:
                    return cause
                aim = self.decision.world_from_contact
            if self._local.moves and not self._robot.reachable(aim):
                return Cause.UNREACHABLE
            ahead, onto_axis = self._next_pose(self._local.predict_meeting(aim, here), here)
            reading = self._robot.step(ahead, self._policy.speed_m_s)
            self.decision.world_from_contact = self._local.advance_aim(aim)
            event = self._monitor.moving(reading)
            if event is Event.COLLISION:
                self._travel(back_off(self._robot.pose(), self._policy.retreat_m))
                return Cause.COLLISION
            if event is Event.BLOCKED:
                return Cause.UNREACHABLE
            if event is Event.CONTACT:
                return None
            if reading.arrived and not onto_axis:
                break
        self._travel(back_off(self._robot.pose(), self._policy.retreat_m + self._search_m()))
        return Cause.NO_CONTACT

    def _next_pose(
        self, meeting: Float[np.ndarray, "4 4"], here: Float[np.ndarray, "4 4"]
    ) -> tuple[Float[np.ndarray, "4 4"], bool]:
        """The pose to go to, and whether that leads onto the approach's axis.

        After a correction the pad is beside the new axis. It is on it by half of the way that is
        left: on a straight line to below the contact it would touch beside its aim.
        """
        left_m = way_left_m(meeting, here)
        if left_m <= self._policy.align_m or is_on_axis(
            here, meeting, self._policy.align_m, self._policy.align_rad
        ):
            return back_off(meeting, -self._search_m()), False
        return back_off(meeting, left_m / 2), True

    def _search_m(self) -> float:
        """Distance past the expected contact at which the pad stops [m].

        Where the contact was not measured, that is below the table.
        """
        if not self._aim_unmeasured:
            return self._policy.search_m
        return self._policy.search_m + float(self.decision.world_from_contact[2, 3])

    def _sees(self, aim: Float[np.ndarray, "4 4"], here: Float[np.ndarray, "4 4"]) -> bool:
        """Whether the aim is far enough away for the wrist's camera to see it, and to change it."""
        if way_left_m(aim, here) < self._policy.commit_m:
            return False
        camera = self._eyes.wrist_camera(here)
        distance = np.linalg.norm(aim[:3, 3] - camera.world_from_camera[:3, 3])
        return bool(distance >= camera.near_m + self._policy.correction_radius_m)

    def _correct(self) -> Cause | None:
        """Take a picture and aim at the best contact near the present one, if it is better."""
        aim = self.decision.world_from_contact
        picture = self._eyes.wrist(aim[:3, 3], self._policy.look_m)
        if picture is None:
            return Cause.CAMERA_STOPPED
        found = self._local.look(picture, aim, self._gain)
        if found is not None:
            self._aim(*found, [picture])
            self.decision.corrections += 1
        elif self._new_choices_left > 0:
            return self._choose_anew()
        return None

    def _choose_anew(self) -> Cause | None:
        """Choose a contact again from pictures of the static cameras, as none is left near the aim.

        Where there is none in them either, the aim stays.
        """
        self._new_choices_left -= 1
        cause = self._choose_from(several_views=False)
        if cause is None:
            return self._go_above()
        return cause if cause is Cause.CAMERA_STOPPED else None

    def _seal(self) -> Cause | None:
        """Switch the vacuum on and lift a little: an object that is held pulls on the gripper.

        An object that pulled and then broke away was held too far from its centre of mass, so the
        next try is nearer to that. If nothing pulled, or no contact is nearer, the next try is at
        the next best place.
        """
        self._robot.vacuum(on=True)
        self.decision.seals += 1
        start = self._robot.pose()
        still = self._robot.step(start, self._policy.speed_m_s)
        readings = [still, *self._raise(start, self._policy.tug_m)]
        held = self._holds(readings[-1])
        self._remember_try(held, max(reading.pressure for reading in readings))
        if held:
            return None
        self._robot.vacuum(on=False)
        self._travel(back_off(start, self._policy.retreat_m))
        self.decision.failed_contacts_m.append(self.decision.world_from_contact[:3, 3])
        if self._regrasps_left == 0:
            return Cause.NO_SEAL
        if not (self._aim_nearer(max(readings, key=hanging_n)) or self._aim_elsewhere()):
            return Cause.NO_SEAL
        self._regrasps_left -= 1
        self.decision.regrasps += 1
        return self._run_phases(*self._phases_to_seal())

    def _holds(self, reading: Reading) -> bool:
        """Whether an object is held; where a reading does not tell, by the mean of more."""
        if self._monitor.holds(reading) or math.isnan(reading.pressure):
            return self._monitor.holds(reading)
        here, more = self._robot.pose(), self._policy.loss_readings
        still = [self._robot.step(here, self._policy.speed_m_s) for _ in range(more)]
        vacuum = float(np.mean([reading.pressure for reading in still]))
        return self._monitor.holds(replace(still[-1], pressure=vacuum), more)

    def _remember_try(self, held: bool, vacuum: float) -> None:
        decision = self.decision
        pose, quality = decision.world_from_contact, decision.predicted_quality
        decision.tried.append(TriedContact(pose, quality, decision.aimed_by, held, vacuum))

    def _tells(self, seal: TriedContact) -> bool:
        """Whether the vacuum of a seal that failed was felt, and is used."""
        return self._strategy.feels and not math.isnan(seal.vacuum)

    def _aim_nearer(self, felt: Reading) -> bool:
        """Aim at a contact nearer to the object's centre of mass; whether there was one."""
        if not (self._strategy.feels and self._monitor.pulls(felt)):
            return False
        place = load_place_m(felt, self._config.hand.length_m)
        lever_m = float(np.linalg.norm(place - felt.world_from_gripper[:2, 3]))
        error_m = self._moment_error_nm / hanging_n(felt)
        if lever_m < max(self._policy.regrasp_lever_m, error_m):
            return False  # it was held at its centre of mass, as far as is known: a weak seal
        if not self._aim_at(self._global.nearer_to(place, lever_m, self.decision.pictures)):
            return False
        # A choice by the wrench is not changed by pictures; they still tell its height and normal.
        self._retargets_left, self._gain = 0, math.inf
        return True

    def _aim_elsewhere(self) -> bool:
        """Aim at the best contact left, if its q-hat is high enough; whether there was one."""
        failed = self.decision.tried[-1]
        if self._tells(failed):
            self._global.feel(failed)
        else:
            self._global.reject(self.decision.failed_contacts_m)
        return self._aim_at(self._global.best(self._policy.regrasp_quality))

    def _lift(self) -> Cause | None:
        """Lift the object; tilt the gripper to reduce moments at its base; slower after a slip."""
        start = self._robot.pose()
        height_m = self._policy.lift_share * self._config.lift.height_m
        speed_m_s = self._policy.speed_m_s
        left = self._policy.trim_max_rad if self._strategy.feels else 0.0
        sure_nm = self._policy.trim_sigmas * self._moment_error_nm
        reading = None
        while True:
            target = self._robot.pose()
            risen = target[2, 3] - start[2, 3]
            if reading is not None and left > 0 and risen >= self._policy.trim_from_m:
                target, turned = trim_pose(target, reading.wrench, left, self._policy, sure_nm)
                left -= turned
            target[:2, 3], target[2, 3] = start[:2, 3], start[2, 3] + height_m
            reading = self._robot.step(target, speed_m_s)
            event = self._monitor.carrying(reading)
            if event is Event.LOSS:
                self._robot.vacuum(on=False)
                return Cause.LOST_IN_LIFT
            if event is Event.SLIP:
                speed_m_s = self._policy.slip_speed_share * self._policy.speed_m_s
            if reading.arrived or not reading.followed:
                return None

    def _shake(self) -> Cause | None:
        reading = self._robot.shake()
        return None if self._holds(reading) else Cause.LOST_IN_SHAKE

    def _transport(self) -> Cause | None:
        """Carry the object aside and back at each acceleration, one after the other."""
        for acceleration_m_s2 in self._config.transport.accelerations_m_s2:
            if not self._holds(self._robot.carry(acceleration_m_s2)):
                return Cause.LOST_IN_TRANSPORT
            self.decision.carried_m_s2 = acceleration_m_s2
        return None

    def _travel(self, pose: Float[np.ndarray, "4 4"]) -> Cause | None:
        """Move through free space to a pose."""
        while True:
            reading = self._robot.step(pose, self._policy.travel_m_s)
            event = self._monitor.moving(reading)
            if event is not Event.NOTHING:
                return Cause.UNREACHABLE if event is Event.BLOCKED else Cause.COLLISION
            if reading.arrived:
                return None

    def _raise(self, start: Float[np.ndarray, "4 4"], height_m: float) -> list[Reading]:
        target = start.copy()
        target[2, 3] += height_m
        readings = [self._robot.step(target, self._policy.speed_m_s)]
        while not readings[-1].arrived and readings[-1].followed:
            readings.append(self._robot.step(target, self._policy.speed_m_s))
        return readings

    def _aim_at(self, choice: Choice | None) -> bool:
        if choice is None:
            return False
        self._aim(choice.world_from_contact, choice.quality, self.decision.pictures)
        self._aim_unmeasured, self._gain = choice.unmeasured, self._policy.correction_gain
        self._local.start_over(choice.normal_radius_m)
        return True

    def _aim(self, pose: Float[np.ndarray, "4 4"], quality: float, by: list[DepthPicture]) -> None:
        self.decision.world_from_contact = self._global.turned(pose)
        self.decision.predicted_quality = float(quality)
        self.decision.aimed_by = by
