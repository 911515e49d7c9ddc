"""Emptying one clutter: attempt after attempt in one SAPIEN world, judged by physics."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import sapien
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.config.evaluation import PolicyName
from pipeline.control.decision import Cause, Decision, Strategy
from pipeline.control.policy import Attempt
from pipeline.control.ranking import GeometricRanking, NetworkRanking, Predict
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.gripper.pad import build_pad
from pipeline.physics.engine import Body, add_body, new_world
from pipeline.simulation.arm import ArmMover
from pipeline.simulation.eyes import SimulatedEyes
from pipeline.simulation.floating import FloatingMover, Mover
from pipeline.simulation.gripper_body import Sample, SuctionGripper
from pipeline.world.scene import ClutterScene

_COLOUR = (0.5, 0.5, 0.5)  # physics has no eyes
_GONE_M = -0.05  # an object whose centre is lower than this has left the table


@dataclass(frozen=True, eq=False)
class Made:
    """One attempt as it went: what was decided, what was reached, and how things moved."""

    decision: Decision
    cause: Cause
    target: str
    reached_quality: float
    seal_pressure: float
    lifted_height_m: float
    duration_s: float
    reached_pose: Float[np.ndarray, "4 4"]
    samples: list[Sample]


def strategy_of(name: PolicyName, predict: Predict, config: RunConfig) -> Strategy:
    """The policies that are compared.

    closed-loop : several views, corrections, and the wrench heeded. uncorrected : the same without
    corrections. open-loop : the pose that the network prefers on the first picture, executed.
    geometric : the flattest patch at the highest point of the first picture, executed.
    """
    network = NetworkRanking(
        predict,
        config.sensing,
        config.gripper.pad.radius_m,
        config.evaluate.policy,
    )
    if name == "geometric":
        geometric = GeometricRanking(config.evaluate.policy.picker)
        return Strategy(name, geometric, several_views=False, corrects=False, feels=False)
    closed = name == "closed-loop"
    views = name in ("closed-loop", "uncorrected")
    return Strategy(name, network, several_views=views, corrects=closed, feels=closed)


def mover_of(world: sapien.Scene, config: RunConfig) -> Mover:
    """What `evaluate.robot` names."""
    if config.evaluate.robot == "iiwa14":
        pad_radius_m = config.gripper.pad.radius_m
        return ArmMover(world, config.evaluate.hand, config.evaluate.arm, pad_radius_m)
    return FloatingMover(world, config.evaluate.hand, config.scenes.table_side_m)


class Clutter:
    """One clutter in a world of its own, with a gripper over it."""

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
        mover = mover_of(self.world, config)
        self.gripper = SuctionGripper(
            self.world, self.bodies, self.items, build_pad(config.gripper.pad), config, mover
        )
        self.eyes = SimulatedEyes(self.bodies, self.items, self.gripper.pose, config, rng)

    def attempted(self, strategy: Strategy, avoid_m: list[Float[np.ndarray, " 3"]]) -> Made:
        """One attempt; what was lifted or has left the table is taken out of the world."""
        self.gripper.begin()
        decision = Attempt(
            self.eyes,
            self.gripper,
            strategy,
            self._config.evaluate,
            self._config.grasps.normal_radius_m,
            self._rng,
            avoid_m,
        ).run()
        made = self._judged(decision)
        lifted = {self.gripper.target} if made.cause is Cause.LIFTED else set()
        self.gripper.begin()
        for body_id in lifted:
            self.world.remove_entity(self.bodies.pop(body_id).entity)
        self.gripper.settle(self._config.evaluate.settle_s)
        for body_id in self._off_the_table():
            self.world.remove_entity(self.bodies.pop(body_id).entity)
        return made

    def _judged(self, decision: Decision) -> Made:
        """Physics has the last word on what the policy believes."""
        gripper, cause = self.gripper, decision.cause
        height = gripper.lifted_m()
        if cause is Cause.LIFTED and height < self._config.evaluate.lift.height_m:
            cause = Cause.LOST_IN_SHAKE
        if (
            cause is Cause.NO_SEAL
            and gripper.seal_pressure >= self._config.evaluate.suction.seal_min
        ):
            cause = Cause.LOST_IN_LIFT  # it did seal, and broke in the first bit of the lift
        if cause is not Cause.LIFTED and gripper.target in self._off_the_table():
            cause = Cause.OFF_THE_TABLE
        return Made(
            decision=decision,
            cause=cause,
            target=self.items[gripper.target].name if gripper.target else "",
            reached_quality=gripper.reached_quality,
            seal_pressure=gripper.seal_pressure,
            lifted_height_m=height,
            duration_s=gripper.time_s,
            reached_pose=gripper.reached_pose,
            samples=gripper.samples,
        )

    def _off_the_table(self) -> set[int]:
        return {i for i, body in self.bodies.items() if body.world_from_object[2, 3] < _GONE_M}


def run_clutter(
    scene: ClutterScene,
    objects: Mapping[str, CatalogueObject],
    policy: PolicyName,
    predict: Predict,
    config: RunConfig,
    rng: np.random.Generator,
) -> list[Made]:
    """Attempts until the table is empty, or too many were made or failed in a row."""
    clutter = Clutter(scene, objects, config, rng)
    strategy = strategy_of(policy, predict, config)
    attempts: list[Made] = []
    failed_contacts_m: list[Float[np.ndarray, " 3"]] = []
    in_a_row = 0
    while (
        clutter.bodies
        and len(attempts) < config.evaluate.attempts_per_clutter
        and in_a_row < config.evaluate.failures_per_clutter
    ):
        made = clutter.attempted(strategy, failed_contacts_m)
        attempts.append(made)
        # What did not hold once is tried again only where nothing else is left.
        failed_contacts_m += made.decision.failed_contacts_m
        if made.cause is Cause.LIFTED:
            in_a_row = 0
        else:
            in_a_row += 1
            failed_contacts_m.append(made.decision.world_from_contact[:3, 3])
    return attempts
