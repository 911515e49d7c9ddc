"""The breakable joint between pad and object: a damped spring whose force is known exactly.

A drive of the physics engine would hold the object too, but does not report its force. So the
spring is applied here as a force on the object, and the load on the pad is its exact opposite.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.compiled_poses import cross_product, pose_of, turn_between
from pipeline.geometry.transforms import invert
from pipeline.physics.engine import Body, roll_freely
from pipeline.simulation.judges import Bearing

_RATE_1_S = 40.0  # natural frequency; critically damped
_GRAVITY = np.array([0.0, 0.0, -9.81])  # standard gravity to three digits


@dataclass(eq=False)
class SuctionJoint:
    """An object that is held by the pad until its load is more than the seal bears.

    Attributes
    ----------
    body
        The object in the world.
    item
        Its catalogue entry.
    limits
        The loads that the seal bears.
    gripper_from_object
        Pose of the object in GCS when it was sealed, shape (4, 4).
    rises_from_m
        Height of its centre in WCS when it was sealed [m].
    """

    body: Body
    item: CatalogueObject
    limits: Bearing
    gripper_from_object: Float[np.ndarray, "4 4"]
    rises_from_m: float

    @classmethod
    def close(
        cls,
        body: Body,
        item: CatalogueObject,
        limits: Bearing,
        world_from_gripper: Float[np.ndarray, "4 4"],
    ) -> "SuctionJoint":
        """Make the joint; the object keeps its present pose against the pad.

        Parameters
        ----------
        body
            The object in the world.
        item
            Its catalogue entry.
        limits
            The loads that the seal bears.
        world_from_gripper
            Present pose of the gripper, shape (4, 4).

        Returns
        -------
        The joint.
        """
        roll_freely(body, free=True)
        body.rigid.wake_up()
        pose = body.world_from_object
        return cls(body, item, limits, invert(world_from_gripper) @ pose, float(pose[2, 3]))

    def carry(
        self, world_from_gripper: Float[np.ndarray, "4 4"]
    ) -> tuple[Float[np.ndarray, " 6"], bool]:
        """Apply the spring's force for one physics step, unless the load breaks the seal.

        The load contains the object's weight, its inertia and its contacts, because all of them
        stretch the spring.

        Parameters
        ----------
        world_from_gripper
            Present pose of the gripper, shape (4, 4).

        Returns
        -------
        Force [N] and moment [N m] that the object exerts on the pad's centre, in GCS, shape (6,);
        and whether the seal holds.
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
        # The spring lets the object trail a fast pad by some centimetres; a real seal does not, so
        # the lever is that of the object where it was sealed.
        arm = wanted[:3, 3] - world_from_gripper[:3, 3]
        into_gripper = world_from_gripper[:3, :3].T
        moment = torque + cross_product(arm, force)
        load = -np.concatenate([into_gripper @ force, into_gripper @ moment])
        if not self.limits.bears(load):
            return load, False
        self.body.rigid.add_force_torque(force, torque)
        return load, True

    def open(self) -> None:
        """Release the object."""
        roll_freely(self.body, free=False)

    def risen_m(self) -> float:
        """Height of the object above where it was sealed [m]."""
        return float(self.body.world_from_object[2, 3]) - self.rises_from_m
