"""Emptying one clutter: one attempt after another in one SAPIEN world, each judged by physics."""

from collections.abc import Mapping, Sequence

import numpy as np
import sapien
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.config.evaluation import PolicyName
from pipeline.control.attempts import JudgedAttempt, LoggedEyes, SeenPicture, failed_seals
from pipeline.control.decision import Cause, Decision, Strategy, TriedContact
from pipeline.control.policy import Attempt
from pipeline.control.ranking import Predict
from pipeline.control.strategies import build_strategy
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.gripper.pad import pad_of
from pipeline.physics.engine import Body, add_body, new_world
from pipeline.simulation.arm import ArmMover
from pipeline.simulation.ceiling import Ceilings
from pipeline.simulation.eyes import SimulatedEyes
from pipeline.simulation.floating import FloatingMover, Mover
from pipeline.simulation.gripper_body import SuctionGripper
from pipeline.simulation.imperfection import WrenchSensor, draw_calibration
from pipeline.simulation.judges import build_judge
from pipeline.simulation.payload import GRAVITY_M_S2
from pipeline.world.scene import ClutterScene

_COLOUR = (0.5, 0.5, 0.5)  # no picture is rendered in this world
_GONE_M = -0.05  # an object whose centre is lower than this has left the table


def build_mover(world: sapien.Scene, config: RunConfig) -> Mover:
    """The stem or the arm that `evaluate.robot` names, added to the world."""
    if config.evaluate.robot == "iiwa14":
        pad_radius_m = config.gripper.pad.radius_m
        return ArmMover(world, config.evaluate.hand, config.evaluate.arm, pad_radius_m)
    return FloatingMover(world, config.evaluate.hand, config.scenes.table_side_m)


class Clutter:
    """One clutter in a SAPIEN world of its own, with a gripper and cameras."""

    def __init__(
        self,
        scene: ClutterScene,
        objects: Mapping[str, CatalogueObject],
        config: RunConfig,
        rng: np.random.Generator,
    ) -> None:
        self._config = config
        self._rng = rng
        self.world = new_world(config.scenes, render=False)
        self.items = {p.body_id: objects[p.object_name] for p in scene.objects}
        self.bodies: dict[int, Body] = {
            p.body_id: add_body(
                self.world,
                self.items[p.body_id],
                p.world_from_object,
                p.body_id,
                _COLOUR,
                config.scenes,
            )
            for p in scene.objects
        }
        mover = build_mover(self.world, config)
        # The same errors for every policy at this clutter, and at every scale.
        calibrated, felt = rng.spawn(2)
        imperfection = config.evaluate.imperfection
        beside = len(config.cameras.static.elevations_rad)
        calibration = draw_calibration(imperfection, beside, calibrated)
        pad, sensor = pad_of(config.gripper.pad), None
        if imperfection.scale > 0.0:
            sensor = WrenchSensor(imperfection, calibration.wrench_bias, felt)
        self.gripper = SuctionGripper(
            self.world, self.bodies, self.items, pad, config, mover, sensor
        )
        self._ceilings = Ceilings(
            self.items, pad, build_judge(config, pad), mover.reachable, config, scene.seed
        )
        self.eyes = SimulatedEyes(self.gripper, self.items, config, calibration, rng)

    def make_attempt(
        self,
        strategy: Strategy,
        avoid_m: list[Float[np.ndarray, " 3"]],
        felt: Sequence[TriedContact] = (),
    ) -> JudgedAttempt:
        """Make one attempt, judge it, and remove what was lifted or fell off the table.

        Parameters
        ----------
        strategy
            The policy.
        avoid_m
            Contacts that failed before, in WCS [m], each of shape (3,).
        felt
            Seals that failed before.

        Returns
        -------
        The attempt and how it ended.
        """
        self.gripper.begin()
        ceilings_n = self._find_ceilings()
        eyes = LoggedEyes(self.eyes, lambda: len(self.gripper.samples) - 1)
        decision = Attempt(
            eyes,
            self.gripper,
            strategy,
            self._config.evaluate,
            self._config.grasps.normal_radius_m,
            self._rng,
            avoid_m,
            felt,
        ).run()
        made = self._judge(decision, eyes.seen, ceilings_n)
        lifted = {self.gripper.target} if made.cause is Cause.LIFTED else set()
        self.gripper.begin()
        for body_id in lifted:
            self.world.remove_entity(self.bodies.pop(body_id).entity)
        self.gripper.settle(self._config.evaluate.settle_s)
        for body_id in self._off_the_table():
            self.world.remove_entity(self.bodies.pop(body_id).entity)
        return made

    def _find_ceilings(self) -> dict[int, tuple[float, float]]:
        """What the best pose bears of each object as it lies, and its weight [N]."""
        if self._config.evaluate.ceiling.poses == 0:
            return {}
        poses = {i: body.world_from_object for i, body in self.bodies.items()}
        found = self._ceilings.update(poses, self.gripper.surfaces())
        return {i: (best.borne_n, best.weight_n) for i, best in found.items()}

    def _judge(
        self,
        decision: Decision,
        seen: list[SeenPicture],
        ceilings_n: dict[int, tuple[float, float]],
    ) -> JudgedAttempt:
        """Correct the policy's own verdict by what physics shows, such as a low lift."""
        gripper, cause = self.gripper, decision.cause
        height = gripper.lifted_m()
        if cause is Cause.LIFTED and height < self._config.evaluate.lift.height_m:
            cause = Cause.LOST_IN_SHAKE
        if cause is Cause.NO_SEAL and gripper.sealed:
            cause = Cause.LOST_IN_LIFT  # the seal was made and broke at the start of the lift
        if cause is not Cause.LIFTED and gripper.target in self._off_the_table():
            cause = Cause.OFF_THE_TABLE
        return JudgedAttempt(
            decision=decision,
            cause=cause,
            target=self.items[gripper.target].name if gripper.target else "",
            reached_quality=gripper.reached_quality,
            seal_pressure=gripper.seal_pressure,
            borne_n=gripper.borne_n,
            weight_n=GRAVITY_M_S2 * self.items[gripper.target].mass_kg if gripper.target else 0.0,
            lifted_height_m=height,
            duration_s=gripper.time_s,
            reached_pose=gripper.reached_pose,
            samples=gripper.samples,
            seen=seen,
            body_id=gripper.target,
            ceilings_n=ceilings_n,
        )

    def _off_the_table(self) -> set[int]:
        """Ids of the bodies that fell off the table."""
        return {i for i, body in self.bodies.items() if body.world_from_object[2, 3] < _GONE_M}


def run_clutter(
    scene: ClutterScene,
    objects: Mapping[str, CatalogueObject],
    policy: PolicyName,
    predict: Predict,
    config: RunConfig,
    rng: np.random.Generator,
) -> list[JudgedAttempt]:
    """Make attempts until the table is empty, or the number of attempts or failures is reached.

    Parameters
    ----------
    scene
        The clutter.
    objects
        Catalogue entry of each object by its name.
    policy
        Name of the policy.
    predict
        Rates grasps for this policy, see `build_strategy`.
    config
        The run; section evaluate holds the limits.
    rng
        Draws the policy's candidates and the sensors' noise.

    Returns
    -------
    The attempts in their order.
    """
    clutter = Clutter(scene, objects, config, rng)
    strategy = build_strategy(policy, predict, config)
    attempts: list[JudgedAttempt] = []
    failed_contacts_m: list[Float[np.ndarray, " 3"]] = []
    felt: list[TriedContact] = []
    in_a_row = 0
    while (
        clutter.bodies
        and len(attempts) < config.evaluate.attempts_per_clutter
        and in_a_row < config.evaluate.failures_per_clutter
    ):
        made = clutter.make_attempt(strategy, failed_contacts_m, felt)
        attempts.append(made)
        # A place that failed is tried again only where no other is left.
        failed_contacts_m += made.decision.failed_contacts_m
        felt += failed_seals(made)
        if made.cause is Cause.LIFTED:
            in_a_row = 0
        else:
            in_a_row += 1
            failed_contacts_m.append(made.decision.world_from_contact[:3, 3])
    return attempts
