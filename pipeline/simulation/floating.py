"""The gripper without an arm: a kinematic stem that is wherever it is told to be."""

from typing import Protocol

import numpy as np
import sapien
from jaxtyping import Float

from pipeline.config.evaluation import HandConfig
from pipeline.geometry.compiled_poses import quaternion_of

"""Where the pad waits: upright above the table's middle."""
# SAPIEN's capsules lie along x.
_Z_FROM_X = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])


class Mover(Protocol):
    """What holds the gripper in a SAPIEN world."""

    def reset(self) -> None:
        """Home, at once."""
        ...

    def drive(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Where to be at the end of the next physics step; False where it cannot follow."""
        ...

    def pose(self) -> Float[np.ndarray, "4 4"]:
        """world_from_gripper as it is."""
        ...

    def reachable(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Whether it can be there."""
        ...

    def owns(self, entity: sapien.Entity) -> bool:
        """Whether an entity is part of it."""
        ...

    def joints_rad(self) -> Float[np.ndarray, " joints"]:
        """Joint angles now; none where nothing but the gripper moves."""
        ...


class FloatingMover:
    """`Mover`: a capsule along the axis, above the soft pad, which is out of collision."""

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
        """Home, at once."""
        self._pose = np.eye(4)
        self._pose[2, 3] = self._home_m
        self._entity.pose = self._stem_pose()

    def drive(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """There by the end of the next physics step."""
        self._pose = world_from_gripper
        self._rigid.kinematic_target = self._stem_pose()
        return True

    def pose(self) -> Float[np.ndarray, "4 4"]:
        """Exactly where it was told to be."""
        return self._pose.copy()

    def reachable(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Above the table, pointing down."""
        place = world_from_gripper[:3, 3]
        above = bool(np.abs(place[:2]).max() <= self._half_m and place[2] >= 0.0)
        return above and bool(world_from_gripper[2, 2] > 0.0)

    def owns(self, entity: sapien.Entity) -> bool:
        """The stem alone."""
        return bool(entity == self._entity)

    def joints_rad(self) -> Float[np.ndarray, " joints"]:
        """None."""
        return np.empty(0)

    def _stem_pose(self) -> sapien.Pose:
        """The capsule's centre; a capsule lies along its x."""
        above = self._begins_m + self._radius_m + self._half_length_m
        centre = self._pose[:3, 3] + above * self._pose[:3, 2]
        return sapien.Pose(centre, quaternion_of(self._pose[:3, :3] @ _Z_FROM_X))
