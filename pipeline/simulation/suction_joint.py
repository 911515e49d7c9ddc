"""The breakable joint between pad and object: a damped spring whose force is known exactly.

A drive of the physics engine would hold as well, but tells nobody how hard; this one is applied
as a force, so what the pad bears is what the object feels, with the sign turned.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.compiled_poses import pose_of, turn_between
from pipeline.geometry.transforms import invert
from pipeline.physics.engine import Body, roll_freely
from pipeline.simulation.judges import Bearing

_RATE_1_S = 40.0  # natural frequency; critically damped
_GRAVITY = np.array([0.0, 0.0, -9.81])  # standard gravity to three digits


@dataclass(eq=False)
class SuctionJoint:
    """An object that hangs on the pad, until its load is more than the seal holds."""

    body: Body
    item: CatalogueObject
    limits: Bearing
    gripper_from_object: Float[np.ndarray, "4 4"]
    rises_from_m: float

    @classmethod
    def closed(
        cls,
        body: Body,
        item: CatalogueObject,
        limits: Bearing,
        world_from_gripper: Float[np.ndarray, "4 4"],
    ) -> "SuctionJoint":
        """The joint as it closes: the object stays where it is against the pad."""
        roll_freely(body, free=True)
        body.rigid.wake_up()
        pose = body.world_from_object
        return cls(body, item, limits, invert(world_from_gripper) @ pose, float(pose[2, 3]))

    def carry(
        self, world_from_gripper: Float[np.ndarray, "4 4"]
    ) -> tuple[Float[np.ndarray, " 6"], bool]:
        """One physics step: pull the object along; the load on the pad, and whether it holds.

        The load is what the object exerts on the pad, in GCS at the pad's centre: its weight,
        what accelerates it, and what it touches, for all of these draw on the spring.
        """
        placed = self.body.entity.pose
        now = pose_of(placed.p.astype(np.float64), placed.q.astype(np.float64))
        wanted = world_from_gripper @ self.gripper_from_object
        error = wanted[:3, 3] - now[:3, 3]
        turn = turn_between(now, wanted)
        stiff, damp = _RATE_1_S**2, 2 * _RATE_1_S
        linear = np.asarray(self.body.rigid.linear_velocity, dtype=np.float64)
        angular = np.asarray(self.body.rigid.angular_velocity, dtype=np.float64)
        force = self.item.mass_kg * (stiff * error - damp * linear - _GRAVITY)
        inertia = now[:3, :3] @ self.item.inertia_kg_m2 @ now[:3, :3].T
        torque = inertia @ (stiff * turn - damp * angular)
        arm = now[:3, 3] - world_from_gripper[:3, 3]
        into_gripper = world_from_gripper[:3, :3].T
        load = -np.concatenate(
            [into_gripper @ force, into_gripper @ (torque + np.cross(arm, force))]
        )
        if not self.limits.bears(load):
            return load, False
        self.body.rigid.add_force_torque(force, torque)
        return load, True

    def open(self) -> None:
        """Let go of the object."""
        roll_freely(self.body, free=False)

    def risen_m(self) -> float:
        """How far the object is above where it was sealed."""
        return float(self.body.world_from_object[2, 3]) - self.rises_from_m
