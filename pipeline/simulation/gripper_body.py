"""The suction gripper in SAPIEN: it moves, measures forces, seals, carries and loses objects.

The rigid stem collides with bodies and pushes them. The soft pad below it has no collision shape,
because a real pad would deform: the gripper stops where the pad, at the pose really reached, first
touches the true surfaces.
"""

import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence

import numpy as np
import sapien
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.control.attempts import Sample
from pipeline.control.robot import Reading, State
from pipeline.control.setpoints import ARRIVED_M, LAG_M, Way, next_speed_m_s
from pipeline.control.transport import there_and_back, way_aside_m
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.gripper.pad import Pad
from pipeline.labelling.heights import pad_heights
from pipeline.labelling.poses import label_poses
from pipeline.physics.engine import Body
from pipeline.simulation.floating import Mover
from pipeline.simulation.imperfection import WrenchSensor
from pipeline.simulation.judges import build_judge
from pipeline.simulation.payload import GRAVITY_M_S2, loads_of_a_kilogram, weight_borne_n
from pipeline.simulation.suction_joint import SuctionJoint
from pipeline.simulation.wrenches import at_flange, push_on
from pipeline.world.posed_bodies import PosedBodies, PosedScene


class SuctionGripper:
    """The simulated gripper as `pipeline.control.robot.Robot`, carried by a `Mover`."""

    def __init__(
        self,
        world: sapien.Scene,
        bodies: dict[int, Body],
        objects: Mapping[int, CatalogueObject],
        pad: Pad,
        config: RunConfig,
        mover: Mover,
        sensor: WrenchSensor | None = None,
    ) -> None:
        """Place the gripper at home, holding nothing.

        Parameters
        ----------
        world
            PhysX scene in which it moves.
        bodies
            Bodies of the world by body id. Code that removes a body from the world must also remove
            it from this mapping.
        objects
            Catalogue entry of each body.
        pad
            The pad in GCS.
        config
            Sections gripper, scenes and evaluate.
        mover
            The stem or the arm that carries the gripper.
        sensor
            Reads the wrench; None reads it without an error.
        """
        self._world = world
        self._sensor = sensor
        self._bodies = bodies
        self._objects = objects
        self._pad = pad
        self._config = config
        self._mover = mover
        self._judge = build_judge(config, pad)
        self._surfaces = PosedBodies(
            {i: item.mesh for i, item in objects.items()}, config.scenes.table_side_m
        )
        self._joint: SuctionJoint | None = None
        self.conveyor_m_s = 0.0
        """Speed along world x of all that is not held: objects that move (Supplement VIII)."""
        self._steps = max(1, round(1 / config.evaluate.policy.rate_hz / world.timestep))
        self.begin()

    def begin(self) -> None:
        """Release the object, go home at once, and clear the record of the last attempt."""
        self.vacuum(on=False)
        self._mover.reset()
        self._goal = self._mover.pose()
        self._speed_m_s = 0.0
        self._follows = True
        self._state = State.OBSERVE
        self.target, self.sealed = 0, False
        self.reached_quality = self.seal_pressure = self.borne_n = 0.0
        self.reached_pose = np.eye(4)
        self.time_s = 0.0
        self.samples: list[Sample] = []
        self._sample(np.zeros(6))

    def enter(self, state: State) -> None:
        """Note the policy's state: samples taken from now on carry it."""
        self._state = state

    def pose(self) -> Float[np.ndarray, "4 4"]:
        """Measured pose world_from_gripper, shape (4, 4)."""
        return self._mover.pose()

    def tare(self) -> None:
        """Set the wrench that is felt now, without a load, to zero."""
        if self._sensor is not None:
            self._sensor.tare()

    def think(self) -> None:
        """Wait as long as the policy takes to rank all candidates."""
        imperfection = self._config.evaluate.imperfection
        self.wait(imperfection.scale * imperfection.choice_s)

    def wait(self, time_s: float) -> None:
        """Stand still while simulated time passes [s], to the nearest step of physics."""
        steps = round(time_s / self._world.timestep)
        for number in range(1, steps + 1):
            load, _ = self._physics_step()
            if number % self._steps == 0 or number == steps:
                self._sample(self._felt(load, self._error()))

    def state_before(
        self, age_s: float
    ) -> tuple[Float[np.ndarray, "4 4"], dict[int, Float[np.ndarray, "4 4"]]]:
        """Where the gripper and the bodies were a while ago, on a straight way between samples.

        Parameters
        ----------
        age_s
            How long ago [s]; the beginning of the attempt where that is later.

        Returns
        -------
        world_from_gripper, shape (4, 4), and the pose of each body by body id.
        """
        if age_s <= 0.0:
            return self.pose(), {i: body.world_from_object for i, body in self._bodies.items()}
        times = [sample.time_s for sample in self.samples]
        after = min(bisect_left(times, self.time_s - age_s), len(times) - 1)
        a, b = self.samples[max(after - 1, 0)], self.samples[after]
        span_s = b.time_s - a.time_s
        share = min(max((self.time_s - age_s - a.time_s) / span_s, 0.0), 1.0) if span_s else 1.0
        return Way.between(a.world_from_gripper, b.world_from_gripper).at(share), {
            i: Way.between(a.world_from_object[i], b.world_from_object[i]).at(share)
            for i in self._bodies
        }

    def reachable(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Whether the mover can bring the gripper to this pose."""
        return self._mover.reachable(world_from_gripper)

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
        Pose, wrench and the events of this period.
        """
        target, touches = self._stopped_by_touch(world_from_gripper, speed_m_s)
        loads, peaks = [], [np.zeros(3)]
        for _ in range(self._steps):
            self._advance(target, speed_m_s)
            load, push = self._physics_step()
            loads.append(load)
            peaks.append(push)
        peak = max(peaks, key=lambda push: float(np.linalg.norm(push)))
        touched = touches and self._at(target)
        if touched:
            self._speed_m_s = 0.0
        return self._reading(np.mean(loads, axis=0), peak, self._at(world_from_gripper), touched)

    def vacuum(self, on: bool) -> None:
        """Switch the vacuum.

        Off releases the object. On asks the judge (`evaluate.judge`) which body under the pad is
        sealed, on the true surfaces, and attaches that body if its seal can hold anything.

        Parameters
        ----------
        on
            Whether the vacuum is on.
        """
        if not on:
            if self._joint is not None:
                self._joint.open()
            self._joint = None
            return
        self.reached_pose = pose = self.pose()
        self.target, self.sealed = 0, False
        self.reached_quality = self.seal_pressure = self.borne_n = 0.0
        found = self._judge.find_seal(pose, self.surfaces())
        if found is None or found[1].pressure <= 0.0:
            return
        self.target, bearing = found
        self.seal_pressure = bearing.pressure
        self.reached_quality = self._quality_at(pose, self.target)
        if bearing.closes:
            body, item = self._bodies[self.target], self._objects[self.target]
            centre_m = body.world_from_object[:3, 3]
            self.borne_n = weight_borne_n(bearing, pose, centre_m, self._config.evaluate)
            still = loads_of_a_kilogram(pose, centre_m, np.zeros((1, 3)))[0]
            self.sealed = bearing.seals(item.mass_kg * still)
            self._joint = SuctionJoint.close(body, item, bearing, pose)

    def shake(self) -> Reading:
        """Shake the object from side to side, then hold still.

        The wrench returned is the mean over the last control period.
        """
        lift, dt = self._config.evaluate.lift, self._world.timestep
        centre, shaken = self._goal.copy(), []
        for number in range(1, round(lift.shake_s / dt) + 1):
            phase = 2 * np.pi * lift.shake_hz * number * dt
            shaken.append(centre.copy())
            shaken[-1][0, 3] += lift.shake_m * np.sin(phase)
        self._play(shaken)
        return self._at_rest(self._play([centre] * round(lift.hold_s / dt)))

    def carry(self, acceleration_m_s2: float) -> Reading:
        """Move aside and back at an acceleration, braking as hard, then hold still.

        The way is towards the table's middle, or wherever else the mover can go. The wrench
        returned is the mean over the last control period.
        """
        transport, dt = self._config.evaluate.transport, self._world.timestep
        start = self._goal.copy()
        aside_m = way_aside_m(start, transport.way_m, self.reachable)
        leg_s = 2 * math.sqrt(max(float(np.linalg.norm(aside_m)), ARRIVED_M) / acceleration_m_s2)
        moving, resting = math.ceil(2 * leg_s / dt), math.ceil(transport.rest_s / dt)
        carried = [start.copy() for _ in range(moving + resting)]
        for number, pose in enumerate(carried, start=1):
            pose[:3, 3] += there_and_back(number * dt / leg_s) * aside_m
        return self._at_rest(self._play(carried))

    def _play(self, poses: Sequence[Float[np.ndarray, "4 4"]]) -> list[Float[np.ndarray, " 6"]]:
        """Command a pose at each step of physics; the load on the pad at each."""
        loads = []
        for number, pose in enumerate(poses, start=1):
            self._goal = pose
            loads.append(self._physics_step()[0])
            if number % self._steps == 0:
                self._sample(self._felt(loads[-1], self._error()))
        return loads

    def _at_rest(self, loads: list[Float[np.ndarray, " 6"]]) -> Reading:
        """What the robot reports after a motion that ended at rest."""
        last = np.mean(loads[-self._steps :], axis=0)
        return self._reading(last, np.zeros(3), arrived=True, touched=False)

    def lifted_m(self) -> float:
        """Height of the held object above where it was sealed [m]; 0 where none is held."""
        return self._joint.risen_m() if self._joint is not None else 0.0

    def settle(self, longest_s: float) -> None:
        """Run physics, with the gripper at home, until dropped or pushed bodies are at rest.

        Parameters
        ----------
        longest_s
            Simulated time after which it ends in any case [s].
        """
        scenes = self._config.scenes
        for number in range(round(longest_s / self._world.timestep)):
            self._world.step()
            if number % self._steps == 0 and all(
                body.linear_speed_m_s < scenes.settle_linear_m_s
                and body.angular_speed_rad_s < scenes.settle_angular_rad_s
                for body in self._bodies.values()
            ):
                return

    def surfaces(self) -> PosedScene:
        """The true surfaces of the bodies at their present poses."""
        return self._surfaces.at({i: b.world_from_object for i, b in self._bodies.items()})

    def _quality_at(self, pose: Float[np.ndarray, "4 4"], target: int) -> float:
        """q of Algorithm 1 on the true surfaces, for a body at a pose of the gripper."""
        label = label_poses(
            pose[None], np.array([target]), self.surfaces(), self._config.gripper, self._reach_m()
        )
        return float(label.q[0])

    def _stopped_by_touch(
        self, target: Float[np.ndarray, "4 4"], speed_m_s: float
    ) -> tuple[Float[np.ndarray, "4 4"], bool]:
        """The target and False; or where the pad first touches within this period, and True."""
        goal = self._goal
        way = target[:3, 3] - goal[:3, 3]
        down_m = -float(way @ goal[:3, 2])
        if self._joint is not None or down_m <= 0.0:
            return target, False
        heights, _ = pad_heights(goal[None], self.surfaces(), self._pad, self._reach_m())
        gap_m = max(-float(heights.max()), 0.0)
        if gap_m > min(down_m, speed_m_s * self._steps * self._world.timestep):
            return target, False
        share = gap_m / down_m
        stop = goal.copy()
        stop[:3, 3] += share * way
        return stop, True

    def _advance(self, target: Float[np.ndarray, "4 4"], speed_m_s: float) -> None:
        """Move the commanded pose by one physics step, within speed and acceleration."""
        way = Way.between(self._goal, target)
        left_m = way.length_m
        if left_m < 1e-9:
            self._speed_m_s = 0.0
            return
        acceleration, dt = self._config.evaluate.policy.acceleration_m_s2, self._world.timestep
        self._speed_m_s = next_speed_m_s(self._speed_m_s, speed_m_s, left_m, acceleration, dt)
        self._goal = way.at(min(self._speed_m_s * dt / left_m, 1.0))

    def _physics_step(self) -> tuple[Float[np.ndarray, " 6"], Float[np.ndarray, " 3"]]:
        """Step the world once; load on the pad, and force on the rigid parts [N], both in GCS."""
        self._follows &= self._mover.drive(self._goal)
        load = np.zeros(6)
        if self._joint is not None:
            load, holds = self._joint.carry(self.pose())
            if not holds:
                self._joint.open()
                self._joint = None
        self._convey()
        self._world.step()
        self.time_s += self._world.timestep
        push = push_on(self._world, self._mover.owns, self.pose()[:3, 3])
        if push is None:
            return load, np.zeros(3)
        into_gripper = self.pose()[:3, :3].T
        force = into_gripper @ push[:3]
        load[:3] += force
        load[3:] += into_gripper @ push[3:]
        return load, np.asarray(force)

    def _convey(self) -> None:
        """Give every body that is not held the conveyor's speed.

        The table stands still, and its friction brakes the bodies in the step of physics that
        follows. They are given what that takes in addition.
        """
        if self.conveyor_m_s == 0.0:
            return
        friction_m_s = self._config.scenes.friction * GRAVITY_M_S2 * self._world.timestep
        speed_m_s = self.conveyor_m_s + math.copysign(friction_m_s, self.conveyor_m_s)
        held = self._joint.body if self._joint is not None else None
        for body in self._bodies.values():
            if body is not held:
                falling = float(body.rigid.linear_velocity[2])
                body.rigid.set_linear_velocity([speed_m_s, 0.0, falling])

    def _reading(
        self,
        load: Float[np.ndarray, " 6"],
        peak: Float[np.ndarray, " 3"],
        arrived: bool,
        touched: bool,
    ) -> Reading:
        """Record a sample and return what the robot reports for this period."""
        if touched:
            load = load + np.array([0.0, 0.0, self._config.evaluate.hand.touch_n, 0.0, 0.0, 0.0])
        error = self._error()
        wrench = self._felt(load, error)
        self._sample(wrench)
        followed, self._follows = self._follows, True
        peak_n = float(np.linalg.norm(peak if error is None else peak + error[:3]))
        pressure = self.samples[-1].pressure
        return Reading(self.pose(), wrench, peak_n, arrived, followed, pressure)

    def _error(self) -> Float[np.ndarray, " 6"] | None:
        """What the wrench that is read next differs by from the truth; None: not at all."""
        return None if self._sensor is None else self._sensor.error()

    def _felt(
        self, load: Float[np.ndarray, " 6"], error: Float[np.ndarray, " 6"] | None
    ) -> Float[np.ndarray, " 6"]:
        """The wrench at the flange that is read under a load at the pad's centre, shape (6,)."""
        felt = at_flange(load, self._config.evaluate.hand.length_m)
        return felt if error is None else felt + error

    def _at(self, target: Float[np.ndarray, "4 4"]) -> bool:
        """Whether the target was commanded and the gripper has arrived there."""
        lag = float(np.linalg.norm(self._goal[:3, 3] - self.pose()[:3, 3]))
        return lag <= LAG_M and Way.between(self._goal, target).is_done

    def _sample(self, wrench: Float[np.ndarray, " 6"]) -> None:
        """Append the present state to the recorded samples."""
        poses = {i: body.world_from_object for i, body in self._bodies.items()}
        joints = self._mover.joints_rad()
        state = str(self._state)
        self.samples.append(
            Sample(self.time_s, self.pose(), poses, wrench, state, joints, self._pressure())
        )

    def _pressure(self) -> float:
        """What the vacuum's sensor reads, over the pump's greatest; NaN without one.

        The pull of the seal stands for it; 0 where nothing is held.
        """
        if not self._config.evaluate.hand.measures_vacuum:
            return math.nan
        true = self.seal_pressure if self._joint is not None else 0.0
        return true if self._sensor is None else true + self._sensor.vacuum_error()

    def _reach_m(self) -> float:
        """Height above the contact at which rays start [m]."""
        return self._config.grasps.clearance_m
