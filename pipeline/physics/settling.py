"""Run physics until all bodies are at rest."""

from collections.abc import Sequence

import sapien

from pipeline.config.scenes import ScenesConfig
from pipeline.errors import SceneError
from pipeline.physics.engine import Body


def settle(world: sapien.Scene, bodies: Sequence[Body], config: ScenesConfig) -> float:
    """Step the world until every body has been at rest for a while.

    At rest means: linear speed below ``settle_linear_m_s`` and angular speed below
    ``settle_angular_rad_s`` throughout ``settle_hold_s``, or put to sleep by PhysX.

    Parameters
    ----------
    world
        PhysX scene.
    bodies
        Bodies that must come to rest.
    config
        Section scenes: what counts as rest, and how long to wait.

    Returns
    -------
    Simulated time [s].

    Raises
    ------
    SceneError
        A body still moves after ``settle_max_s``.
    """
    resting_s = elapsed_s = 0.0
    while resting_s < config.settle_hold_s:
        if elapsed_s > config.settle_max_s:
            raise SceneError(
                f"The clutter still moved after {config.settle_max_s} s",
                "Raise scenes.settle_max_s, or draw another seed",
            )
        world.step()
        elapsed_s += config.timestep_s
        resting_s = resting_s + config.timestep_s if _at_rest(bodies, config) else 0.0
    return elapsed_s


def fallen_off(bodies: Sequence[Body], config: ScenesConfig) -> list[Body]:
    """Bodies whose centre of mass is beyond or below the table."""
    half = config.table_side_m / 2
    return [
        body
        for body in bodies
        if abs(body.world_from_object[:2, 3]).max() > half or body.world_from_object[2, 3] < 0
    ]


def _at_rest(bodies: Sequence[Body], config: ScenesConfig) -> bool:
    return all(
        body.rigid.is_sleeping
        or (
            body.linear_speed_m_s < config.settle_linear_m_s
            and body.angular_speed_rad_s < config.settle_angular_rad_s
        )
        for body in bodies
    )
