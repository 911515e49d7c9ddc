"""The gripper on a KUKA LBR iiwa 14 R820: SAPIEN's articulation, Pinocchio's inverse kinematics.

At every physics step the commanded gripper pose becomes joint targets. Joints keep their limits of
angle, speed and torque. Gravity of the arm is compensated, as the real arm's controller does. The
links push the objects and the table when they touch them. Joint angles at which links would
collide with each other or with the table count as unreachable, and a motion stops before them.
"""

import tempfile
from pathlib import Path

import numpy as np
import sapien
from jaxtyping import Float

from pipeline.config.evaluation import ArmConfig, HandConfig
from pipeline.control.viewpoints import gripper_above
from pipeline.errors import SoftgripError
from pipeline.geometry.compiled_poses import pose_of
from pipeline.geometry.iiwa14 import AXES, LIMITS_RAD
from pipeline.geometry.transforms import invert
from pipeline.physics.engine import sapien_pose
from pipeline.simulation.arm_clearance import ArmClearance
from pipeline.simulation.iiwa14 import GRIPPER_LINK, urdf

_STIFFNESS, _DAMPING = 4e4, 4e3  # of the joints' position drives [N m/rad, N m s/rad]
_SPEEDS = np.array([axis.speed_rad_s for axis in AXES])
_MARGIN_RAD = 0.01  # kept from the ends of the joints' ranges
# A posture far from every limit, from which inverse kinematics starts.
_ELBOW_UP = np.array([0.0, 0.5, 0.0, -1.4, 0.0, 1.2, 0.0])
_SEEDS = 12  # further postures, at random, to start from
_HEADINGS = 8  # turns of the round pad about its axis that are tried
_ITERATIONS = 150  # bounds inverse kinematics that does not converge
_GIVES_RAD = (0.1, 0.3, 0.6)  # steps of the elbow, where a joint is at its limit
_BY_ITSELF = [1, 1, 1, 0]  # shapes that share a bit of the third group do not collide


class ArmMover:
    """A `pipeline.simulation.floating.Mover` that is an arm standing beside the table."""

    def __init__(
        self, world: sapien.Scene, hand: HandConfig, arm: ArmConfig, pad_radius_m: float
    ) -> None:
        self._world = world  # owns the articulation, so it must live as long
        self._timestep_s = world.timestep
        self._base = np.eye(4)
        self._base[:3, 3] = arm.base_m
        self._articulation = _loaded(world, hand, arm.hand_mass_kg)
        self._articulation.root_pose = sapien_pose(self._base)
        links = self._articulation.links
        self._own = {link.entity.per_scene_id for link in links}
        for link in links:
            link.disable_gravity = True
            for shape in link.collision_shapes:
                shape.set_collision_groups(_BY_ITSELF)
        self._pad = next(link for link in links if link.name == GRIPPER_LINK)
        self._pad_index = links.index(self._pad)
        self._joints = self._articulation.active_joints
        for joint, axis in zip(self._joints, AXES, strict=True):
            joint.set_drive_properties(_STIFFNESS, _DAMPING, force_limit=axis.torque_nm)
        self._model = self._articulation.create_pinocchio_model()
        self._clearance = ArmClearance(hand, pad_radius_m, arm.base_m[2], arm.margin_m)
        rng = np.random.default_rng(0)
        self._seeds = [_ELBOW_UP, *(rng.uniform(-0.8, 0.8, 7) * LIMITS_RAD for _ in range(_SEEDS))]
        self._home_rad = self._most_comfortable(arm)
        self.reset()

    def reset(self) -> None:
        """Put the joints at their home angles at once, at rest."""
        self._q_rad = self._home_rad.copy()
        self._articulation.set_qpos(self._q_rad)
        self._articulation.set_qvel(np.zeros(7))
        self._to_drives(np.zeros(7))

    def drive(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Set joint targets one physics step closer to the pose.

        Parameters
        ----------
        world_from_gripper
            The commanded pose in WCS, shape (4, 4).

        Returns
        -------
        False where no joint angles reach the pose, or the step would collide; the arm then stops.
        """
        wanted = self._followed(world_from_gripper)
        if wanted is None:
            self._to_drives(np.zeros(7))
            return False
        step = wanted - self._q_rad
        most = float(np.max(np.abs(step) / (_SPEEDS * self._timestep_s)))
        step /= max(most, 1.0)
        if not self._clearance.is_free(self._q_rad + step):
            self._to_drives(np.zeros(7))
            return False
        self._q_rad = self._q_rad + step
        self._to_drives(step / self._timestep_s)
        return True

    def pose(self) -> Float[np.ndarray, "4 4"]:
        """Pose world_from_gripper that the simulated joints really have, shape (4, 4)."""
        placed = self._pad.entity_pose
        return np.asarray(pose_of(placed.p.astype(np.float64), placed.q.astype(np.float64)))

    def reachable(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> bool:
        """Whether joint angles within their limits reach the pose without a collision."""
        return self.joints_at(world_from_gripper, self._q_rad) is not None

    def owns(self, entity: sapien.Entity) -> bool:
        """Whether the entity is one of the arm's links."""
        return entity.per_scene_id in self._own

    def joints_at(
        self, world_from_gripper: Float[np.ndarray, "4 4"], near_rad: Float[np.ndarray, " 7"]
    ) -> Float[np.ndarray, " 7"] | None:
        """Find joint angles for a pose of the gripper by inverse kinematics.

        Parameters
        ----------
        world_from_gripper
            The pose in WCS, shape (4, 4).
        near_rad
            Joint angles from which the search starts first [rad], shape (7,); then it starts from
            fixed others.

        Returns
        -------
        Joint angles [rad], shape (7,), free of collisions; None where none were found.
        """
        for seed in (near_rad, *self._seeds):
            found = self._solution(world_from_gripper, seed)
            if found is not None and self._clearance.is_free(found):
                return found
        return None

    def _most_comfortable(self, arm: ArmConfig) -> Float[np.ndarray, " 7"]:
        """Joint angles at the home pose that are farthest from their limits [rad], shape (7,).

        The pad is round, so its heading is free and several headings are tried.
        """
        found = []
        for heading in np.arange(_HEADINGS) * 2 * np.pi / _HEADINGS:
            x_axis = np.diag([1.0, 1.0, 1.0, 1.0])
            x_axis[:2, 0] = [np.cos(heading), np.sin(heading)]
            home = gripper_above(np.asarray(arm.home_m), 0.0, x_axis)
            found += [self._solution(home, seed) for seed in self._seeds]
        solved = [q for q in found if q is not None and self._clearance.is_free(q)]
        if not solved:
            raise SoftgripError(
                f"the arm at {arm.base_m} cannot hold its gripper at home, {arm.home_m}",
                "Move evaluate.arm.base_m or evaluate.arm.home_m",
            )
        return max(solved, key=lambda q: float((1 - np.abs(q) / LIMITS_RAD).min()))

    def joints_rad(self) -> Float[np.ndarray, " 7"]:
        """Measured joint angles [rad], shape (7,)."""
        return np.asarray(self._articulation.qpos, dtype=np.float64)

    def _solution(
        self,
        world_from_gripper: Float[np.ndarray, "4 4"],
        seed_rad: Float[np.ndarray, " 7"],
    ) -> Float[np.ndarray, " 7"] | None:
        """Joint angles for a pose from one starting point [rad]; None if none are within limits."""
        base_from_gripper = invert(self._base) @ world_from_gripper
        found, solved, _ = self._model.compute_inverse_kinematics(
            self._pad_index,
            sapien_pose(base_from_gripper),
            initial_qpos=seed_rad,
            eps=1e-5,
            max_iterations=_ITERATIONS,
            dt=0.8,
            damp=1e-5,
        )
        if not solved:
            return None
        q_rad = np.asarray((np.asarray(found) + np.pi) % (2 * np.pi) - np.pi)
        return q_rad if bool((np.abs(q_rad) <= LIMITS_RAD - _MARGIN_RAD).all()) else None

    def _followed(
        self, world_from_gripper: Float[np.ndarray, "4 4"]
    ) -> Float[np.ndarray, " 7"] | None:
        """Joint angles for a pose, near the present ones [rad]; None where none are found.

        The pose takes six of the arm's seven degrees of freedom. The seventh, the null space of the
        Jacobian, moves the joints without moving the gripper. Where the direct search fails, the
        joint that is nearest to its limit is moved towards its middle in that null space, and the
        search starts again from there.
        """
        found = self._solution(world_from_gripper, self._q_rad)
        if found is not None:
            return found
        jacobian = self._model.compute_single_link_local_jacobian(self._q_rad, self._pad_index)
        still = np.linalg.svd(jacobian)[2][-1]
        share = self._q_rad / LIMITS_RAD
        worst = int(np.abs(share).argmax())
        inwards = -still * np.sign(still[worst] * share[worst])
        seeds = (self._q_rad + give * inwards for give in _GIVES_RAD)
        solved = (self._solution(world_from_gripper, seed) for seed in seeds)
        return next((q for q in solved if q is not None and self._clearance.is_free(q)), None)

    def _to_drives(self, speed_rad_s: Float[np.ndarray, " 7"]) -> None:
        """Send the joint targets and their speeds [rad/s] to SAPIEN's drives."""
        for joint, q, rate in zip(self._joints, self._q_rad, speed_rad_s, strict=True):
            joint.set_drive_target(q)
            joint.set_drive_velocity_target(rate)


def _loaded(
    world: sapien.Scene, hand: HandConfig, hand_mass_kg: float
) -> sapien.physx.PhysxArticulation:
    """Load the arm with its gripper into the world; its foot is fixed."""
    loader = world.create_urdf_loader()
    loader.fix_root_link = True
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "iiwa14.urdf"
        path.write_text(urdf(hand, hand_mass_kg))
        return loader.load(str(path))
