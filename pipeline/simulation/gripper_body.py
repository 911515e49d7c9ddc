"""A floating suction gripper: moves in straight lines, seals, carries, and loses what is too heavy.

The stem is a kinematic capsule that pushes what it meets; the soft pad below it is out of
collision, for it drapes. A sealed object hangs on a compliant joint, a damped spring between
pad and object whose force is known exactly, and which breaks over the limits of the seal.
"""

from collections.abc import Callable

import numpy as np
import sapien
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from pipeline.config import RunConfig
from pipeline.control.policy import State
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.raycasting import RayScene
from pipeline.geometry.table import table_mesh
from pipeline.geometry.transforms import invert
from pipeline.gripper import label_batch
from pipeline.gripper.heights import pad_heights
from pipeline.gripper.pad import Pad
from pipeline.simulation.engine import Body, roll_freely, sapien_pose
from pipeline.simulation.suction import Holding, breaks, holding

_STEM_RADIUS_M = 0.012
_STEM_HALF_M = 0.05
_STEM_ABOVE_M = 0.035  # the stem ends this far above the pad: H and a little
_JOINT_RATE_1_S = 40.0  # natural frequency of the suction joint; critically damped
_PARKED = np.array([0.0, 0.0, 0.6])
_GRAVITY = np.array([0.0, 0.0, -9.81])
_SEARCH_M = 0.06  # the pad goes down at most this far to its first touch
_SAMPLE_EVERY = 12  # physics steps between two samples of the trajectory


class FloatingGripper:
    """`pipeline.control.policy.Robot` in SAPIEN, without an arm."""

    def __init__(
        self,
        world: sapien.Scene,
        bodies: dict[int, Body],
        objects: dict[int, CatalogueObject],
        pad: Pad,
        config: RunConfig,
    ) -> None:
        self._world = world
        self._bodies = bodies
        self._objects = objects
        self._pad = pad
        self._config = config
        self._entity, self._rigid = _stem(world)
        self._limits: Holding | None = None
        self._grip: tuple[Body, Float[np.ndarray, "4 4"]] | None = None
        self._state = State.OBSERVE
        self._load = np.zeros(6)
        self.begin()

    def begin(self) -> None:
        """Park above the table and forget the last attempt."""
        parked = np.eye(4)
        parked[:3, 3] = _PARKED
        self._pose = parked
        self._entity.pose = sapien_pose(self._stem_pose())
        self._let_go()
        self.target: int = 0
        self.reached_quality = self.seal_pressure = self.lifted_height_m = 0.0
        self.reached_pose = np.eye(4)
        self.time_s = 0.0
        self.samples: list[tuple[float, np.ndarray, dict[int, np.ndarray], np.ndarray, str]] = []
        self._steps = 0
        self._state = State.OBSERVE
        self._load = np.zeros(6)
        self._sample()

    def enter(self, state: State) -> None:
        """Name what is being done, for the record."""
        self._state = state

    def move(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Straight there, turning on the way; False where the stem met too much force."""
        distance = float(np.linalg.norm(world_from_gripper[:3, 3] - self._pose[:3, 3]))
        return self._follow(_line(self._pose, world_from_gripper), distance, self._uncollided)

    def seal(self) -> bool:
        """Down to first touch on the true surfaces, then vacuum on: sealed if p is enough."""
        rays, ids = self._surfaces()
        heights, below = pad_heights(self._pose[None], rays, self._pad, self._reach())
        heights, below = heights[0], below[0]
        touch = float(heights.max())
        if touch < -_SEARCH_M:
            return False
        sent = self._pose.copy()
        sent[:3, 3] += touch * sent[:3, 2]
        if not self.move(sent):
            return False
        self.reached_pose = self._pose.copy()
        rays, ids = self._surfaces()
        at_height, at_below = pad_heights(self._pose[None], rays, self._pad, self._reach())
        on = ids[at_below[0]]
        best = Holding(0.0, 0.0, 0.0, 0.0, 0.0)
        for body_id in (int(i) for i in np.unique(on[(at_below[0] >= 0) & (on > 0)])):
            on_target = (on == body_id) & (at_below[0] >= 0)
            found = holding(
                self._pad,
                at_height[0],
                on_target,
                self._config.gripper,
                self._config.evaluate.suction,
            )
            if found.pressure > best.pressure:
                best, self.target = found, body_id
                label = label_batch(self._pad, self._config.gripper, at_height, on_target[None])
                self.reached_quality = float(label.q[0])
        self.seal_pressure = best.pressure
        if best.pressure < self._config.evaluate.suction.seal_min or self.target == 0:
            return False
        body = self._bodies[self.target]
        self._limits = best
        self._grip = (body, invert(self._pose) @ body.world_from_object)
        self._lifted_from = float(body.world_from_object[2, 3])
        roll_freely(body, free=True)
        body.rigid.wake_up()
        return True

    def lift(self) -> bool:
        """Up by the height that counts and a little more; whether the object came along."""
        lift = self._config.evaluate.lift
        up = self._pose.copy()
        up[2, 3] += 1.3 * lift.height_m
        self._follow(_line(self._pose, up), 1.3 * lift.height_m, self._holding_on)
        return self._is_up()

    def shake(self) -> bool:
        """Side to side while holding; whether the object is still up afterwards."""
        lift = self._config.evaluate.lift
        centre = self._pose.copy()
        steps = int(np.ceil(lift.hold_s / self._world.timestep))
        for number in range(1, steps + 1):
            pose = centre.copy()
            phase = 2 * np.pi * lift.shake_hz * number * self._world.timestep
            pose[0, 3] += lift.shake_m * np.sin(phase)
            self._step(pose)
        return self._is_up()

    def _is_up(self) -> bool:
        if self._grip is None:
            return False
        height = float(self._grip[0].world_from_object[2, 3]) - self._lifted_from
        self.lifted_height_m = height
        return height >= self._config.evaluate.lift.height_m

    def _follow(
        self,
        path: Callable[[float], Float[np.ndarray, "4 4"]],
        distance_m: float,
        goes_on: Callable[[], bool],
    ) -> bool:
        speed = self._config.evaluate.policy.speed_m_s
        steps = max(1, int(np.ceil(distance_m / speed / self._world.timestep)))
        for number in range(1, steps + 1):
            self._step(path(number / steps))
            if not goes_on():
                return False
        return True

    def _step(self, pose: Float[np.ndarray, "4 4"]) -> None:
        self._pose = pose
        self._rigid.kinematic_target = sapien_pose(self._stem_pose())
        self._carry()
        self._world.step()
        self.time_s += self._world.timestep
        if self._steps % _SAMPLE_EVERY == 0:
            self._sample()
        self._steps += 1

    def _sample(self) -> None:
        """Add things as they stand to the trajectory."""
        poses = {i: body.world_from_object for i, body in self._bodies.items()}
        self.samples.append(
            (self.time_s, self._pose.copy(), poses, self._load.copy(), str(self._state))
        )

    def _carry(self) -> None:
        """The joint's force on the object, and on the pad; it breaks over the limits."""
        self._load = np.zeros(6)
        if self._grip is None or self._limits is None:
            return
        body, gripper_from_object = self._grip
        item = self._objects[body.body_id]
        now, wanted = body.world_from_object, self._pose @ gripper_from_object
        error = wanted[:3, 3] - now[:3, 3]
        turn = Rotation.from_matrix(wanted[:3, :3] @ now[:3, :3].T).as_rotvec()
        stiff, damp = _JOINT_RATE_1_S**2, 2 * _JOINT_RATE_1_S
        linear = np.asarray(body.rigid.linear_velocity, dtype=np.float64)
        angular = np.asarray(body.rigid.angular_velocity, dtype=np.float64)
        force = item.mass_kg * (stiff * error - damp * linear - _GRAVITY)
        inertia = now[:3, :3] @ item.inertia_kg_m2 @ now[:3, :3].T
        torque = inertia @ (stiff * turn - damp * angular)
        arm = now[:3, 3] - self._pose[:3, 3]
        into_gripper = self._pose[:3, :3].T
        # What the object does to the pad is the opposite of what the joint does to the object.
        self._load = -np.concatenate(
            [into_gripper @ force, into_gripper @ (torque + np.cross(arm, force))]
        )
        if breaks(self._limits, self._load):
            self._let_go()
            return
        body.rigid.add_force_torque(force, torque)

    def _let_go(self) -> None:
        if self._grip is not None:
            roll_freely(self._grip[0], free=False)
        self._grip = self._limits = None

    def _uncollided(self) -> bool:
        """Whether the stem meets less force than the limit; what it holds does not count."""
        limit_n = self._config.evaluate.policy.force_limit_n
        impulse = 0.0
        for contact in self._world.get_contacts():
            if any(body.entity == self._entity for body in contact.bodies):
                impulse += sum(float(np.linalg.norm(point.impulse)) for point in contact.points)
        return bool(impulse / self._world.timestep <= limit_n)

    def _holding_on(self) -> bool:
        return self._grip is not None

    def _stem_pose(self) -> Float[np.ndarray, "4 4"]:
        """The capsule's centre, above the pad along its axis; a capsule lies along its x."""
        pose = self._pose.copy()
        pose[:3, 3] += (_STEM_ABOVE_M + _STEM_RADIUS_M + _STEM_HALF_M) * pose[:3, 2]
        pose[:3, :3] = pose[:3, :3] @ _Z_FROM_X
        return pose

    def _surfaces(self) -> tuple[RayScene, np.ndarray]:
        """The true surfaces where they are now, the table last, and their body ids."""
        ids = sorted(self._bodies)
        meshes = [self._objects[i].mesh.transformed(self._bodies[i].world_from_object) for i in ids]
        table = table_mesh(self._config.scenes.table_side_m)
        return RayScene([*meshes, table]), np.array([*ids, 0])

    def _reach(self) -> float:
        return self._config.grasps.clearance_m


_Z_FROM_X = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])


def _stem(
    world: sapien.Scene,
) -> tuple[sapien.Entity, sapien.physx.PhysxRigidDynamicComponent]:
    rigid = sapien.physx.PhysxRigidDynamicComponent()
    material = sapien.physx.PhysxMaterial(0.3, 0.3, 0.0)
    rigid.attach(sapien.physx.PhysxCollisionShapeCapsule(_STEM_RADIUS_M, _STEM_HALF_M, material))
    rigid.kinematic = True
    entity = sapien.Entity()
    entity.name = "gripper"
    entity.add_component(rigid)
    world.add_entity(entity)
    return entity, rigid


def _line(
    start: Float[np.ndarray, "4 4"], end: Float[np.ndarray, "4 4"]
) -> Callable[[float], Float[np.ndarray, "4 4"]]:
    """The pose a share of the way along, turning evenly."""
    turn = Rotation.from_matrix(end[:3, :3] @ start[:3, :3].T).as_rotvec()

    def at(share: float) -> Float[np.ndarray, "4 4"]:
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_rotvec(share * turn).as_matrix() @ start[:3, :3]
        pose[:3, 3] = start[:3, 3] + share * (end[:3, 3] - start[:3, 3])
        return pose

    return at
