"""The gripper without an arm: a kinematic stem that follows every commanded pose exactly."""

from typing import Protocol

import numpy as np
import sapien
from jaxtyping import Float

from pipeline.config.evaluation import HandConfig
from pipeline.geometry.compiled_poses import quaternion_of

# SAPIEN's capsules lie along x.
_Z_FROM_X = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])


class Mover(Protocol):
    """The body that carries the gripper in a SAPIEN world: a stem on its own, or an arm."""

    def reset(self) -> None:
        """Put the gripper at its home pose at once, without moving through the space between."""
        ...

    def drive(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Command the pose that the gripper shall have at the end of the next physics step.

        Parameters
        ----------
        world_from_gripper
            The commanded pose in WCS, shape (4, 4).

        Returns
        -------
        False where the mover cannot follow; it then stops.
        """
        ...

    def pose(self) -> Float[np.ndarray, "4 4"]:
        """Measured pose world_from_gripper, shape (4, 4)."""
        ...

    def reachable(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Whether the gripper can take this pose."""
        ...

    def owns(self, entity: sapien.Entity) -> bool:
        """Whether a SAPIEN entity is part of the mover."""
        ...

    def joints_rad(self) -> Float[np.ndarray, " joints"]:
        """Joint angles [rad]; empty where there is no arm."""
        ...


class FloatingMover:
    """A `Mover` that is only a stem: a capsule on the gripper's axis above the soft pad.

    The pad itself has no collision shape.
    """

    def __init__(self, world: sapien.Scene, hand: HandConfig, table_side_m: float) -> None:
        self._half_m = table_side_m / 2
        self._home_m = hand.home_m
        self._radius_m = hand.stem_radius_m
        self._begins_m = hand.stem_begins_m
        self._half_length_m = (hand.length_m - self._begins_m - 2 * hand.stem_radius_m) / 2
        self._rigid = sapien.physx.PhysxRigidDynamicComponent()
        material = sapien.physx.PhysxMaterial(hand.friction, hand.friction, 0.0)
        self._rigid.attach(
            sapien.physx.PhysxCollisionShapeCapsule(
                hand.stem_radius_m, max(self._half_length_m, 1e-3), material
            )
        )
        self._rigid.kinematic = True
        self._entity = sapien.Entity()
        self._entity.name = "gripper"
        self._entity.add_component(self._rigid)
        world.add_entity(self._entity)
        self.reset()

    def reset(self) -> None:
        """Put the gripper upright above the middle of the table, at once."""
        self._pose = np.eye(4)
        self._pose[2, 3] = self._home_m
        self._entity.pose = self._stem_pose()

    def drive(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Move the stem to the pose by the end of the next physics step; it can always follow."""
        self._pose = world_from_gripper
        self._rigid.kinematic_target = self._stem_pose()
        return True

    def pose(self) -> Float[np.ndarray, "4 4"]:
        """The pose last commanded, world_from_gripper: the stem follows exactly."""
        return self._pose.copy()

    def reachable(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Whether the pose is above the table with the pad facing down."""
        place = world_from_gripper[:3, 3]
        above = bool(np.abs(place[:2]).max() <= self._half_m and place[2] >= 0.0)
        return above and bool(world_from_gripper[2, 2] > 0.0)

    def owns(self, entity: sapien.Entity) -> bool:
        """Whether the entity is the stem."""
        return bool(entity == self._entity)

    def joints_rad(self) -> Float[np.ndarray, " joints"]:
        """An empty array: there are no joints."""
        return np.empty(0)

    def _stem_pose(self) -> sapien.Pose:
        """Pose of the capsule's centre in WCS; the long axis of a SAPIEN capsule is its x axis."""
        above = self._begins_m + self._radius_m + self._half_length_m
        centre = self._pose[:3, 3] + above * self._pose[:3, 2]
        return sapien.Pose(centre, quaternion_of(self._pose[:3, :3] @ _Z_FROM_X))
