"""Poses that physics decides: an object that comes to rest alone, and a pile."""

from collections.abc import Sequence

import numpy as np
import sapien
from jaxtyping import Float

from pipeline.config.scenes import ScenesConfig
from pipeline.errors import SceneError
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.transforms import random_rotation
from pipeline.physics.engine import Body, add_body, add_wall, new_world, sapien_pose
from pipeline.physics.settling import settle

_CLEARANCE_M = 0.005  # above what is below, when let go
_TRIES_ALONE = 8  # poses of a last object that found no room in the column
_WALL_M = 0.02  # thick enough that no body passes through in one step
# The column that a pile is dropped into is this much wider than its longest object.
_COLUMN_WIDTH = 1.5
_INVISIBLE = (0.5, 0.5, 0.5)


def resting_pose(
    item: CatalogueObject, config: ScenesConfig, rng: np.random.Generator
) -> Float[np.ndarray, "4 4"]:
    """A stable pose of the object alone on the table: dropped in SE(3), settled.

    Parameters
    ----------
    item
        The object.
    config
        Section scenes of the run.
    rng
        Draws orientations.

    Returns
    -------
    world_from_object at rest, shape (4, 4).

    Raises
    ------
    SceneError
        It never came to rest, in several tries.
    """
    for _ in range(_TRIES_ALONE):
        world = new_world(config, render=False)
        pose = np.eye(4)
        pose[:3, :3] = random_rotation(rng)
        pose[2, 3] = _height_to_clear(item, pose[:3, :3])
        body = add_body(world, item, pose, 1, _INVISIBLE, config)
        try:
            settle(world, [body], config)
        except SceneError:
            continue  # rolled off, or rocks for long: another orientation
        return body.world_from_object
    raise SceneError(f"{item.name} never comes to rest on the table", "Leave this mesh out")


def drop_pile(
    items: Sequence[CatalogueObject], config: ScenesConfig, rng: np.random.Generator
) -> tuple[sapien.Scene, list[Body], float]:
    """Drop objects one by one in SE(3) into a column of four walls, then remove the walls.

    Parameters
    ----------
    items
        The objects, in the order in which they are dropped.
    config
        Section scenes of the run.
    rng
        Draws orientations and places.

    Returns
    -------
    The world, its bodies at rest, and the simulated time [s].

    Raises
    ------
    SceneError
        The pile never came to rest.
    """
    world = new_world(config, render=False)
    half = _COLUMN_WIDTH * max(float(item.mesh.extents_m.max()) for item in items) / 2
    walls = [
        add_wall(world, centre, size, config)
        for centre, size in _column(half, height_m=half * 4 + 0.5)
    ]
    bodies: list[Body] = []
    elapsed_s = 0.0
    for number, item in enumerate(items, start=1):
        pose = np.eye(4)
        pose[:3, :3] = random_rotation(rng)
        pose[:2, 3] = rng.uniform(-0.3 * half, 0.3 * half, 2)
        top = max(
            (_top_of(body, below) for body, below in zip(bodies, items, strict=False)), default=0.0
        )
        pose[2, 3] = top + _height_to_clear(item, pose[:3, :3])
        bodies.append(add_body(world, item, pose, number, _INVISIBLE, config))
        elapsed_s += settle(world, bodies, config)
    for wall in walls:
        world.remove_entity(wall)
    for body in bodies:
        body.rigid.wake_up()
    return world, bodies, elapsed_s + settle(world, bodies, config)


def drop_again(
    world: sapien.Scene,
    bodies: Sequence[Body],
    items: Sequence[CatalogueObject],
    index: int,
    config: ScenesConfig,
    rng: np.random.Generator,
) -> float:
    """Take one body and let it fall onto the middle of the others; simulated time taken [s].

    A body that touches no other supports none: the others sleep on until they are hit.
    """
    others = [i for i in range(len(bodies)) if i != index]
    middle = np.median([bodies[i].world_from_object[:2, 3] for i in others], axis=0)
    pose = np.eye(4)
    pose[:3, :3] = random_rotation(rng)
    pose[:2, 3] = middle + rng.normal(0.0, 0.02, 2)
    top = max(_top_of(bodies[i], items[i]) for i in others)
    pose[2, 3] = top + _height_to_clear(items[index], pose[:3, :3])
    body = bodies[index]
    body.entity.pose = sapien_pose(pose)
    body.rigid.linear_velocity = body.rigid.angular_velocity = np.zeros(3)
    body.rigid.wake_up()
    return settle(world, bodies, config)


def _column(half_m: float, height_m: float) -> list[tuple[list[float], list[float]]]:
    """Centre and half size of four walls around the origin."""
    at, z = half_m + _WALL_M, height_m / 2
    long, thin = half_m + 2 * _WALL_M, _WALL_M
    return [
        ([at, 0, z], [thin, long, z]),
        ([-at, 0, z], [thin, long, z]),
        ([0, at, z], [long, thin, z]),
        ([0, -at, z], [long, thin, z]),
    ]


def _height_to_clear(item: CatalogueObject, rotation: Float[np.ndarray, "3 3"]) -> float:
    """Height of the origin at which the turned object just clears the ground."""
    return float(-(item.mesh.vertices_m @ rotation.T)[:, 2].min()) + _CLEARANCE_M


def _top_of(body: Body, item: CatalogueObject) -> float:
    return float(item.mesh.transformed(body.world_from_object).vertices_m[:, 2].max())
