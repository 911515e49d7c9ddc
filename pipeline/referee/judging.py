"""Many grasps judged: what each bears, and which to judge."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from pydantic import ValidationError

from pipeline.config.referee import RefereeConfig
from pipeline.geometry.mesh import Mesh
from pipeline.referee.seal import Seal, referee_of, seal, straight_pull_n, weight_borne_n
from pipeline.referee.surface import surface_under
from pipeline.world.raycasting import RayScene
from pipeline.world.table import table_mesh

# What is no property of the pad, the air or the robot.
NOT_VARIED = ("element_rg",)


@dataclass(frozen=True)
class Judged:
    """Grasps of one scene as the referee finds them; arrays of one length n.

    Attributes
    ----------
    borne_n
        Largest weight at the object's centre of mass that is lifted and moved aside [N].
    straight_n
        Largest straight pull through the pad's centre [N].
    suction_n
        The vacuum's force on the object [N].
    vacuum_pa
        What the fan keeps up [Pa].
    """

    borne_n: Float[np.ndarray, " n"]
    straight_n: Float[np.ndarray, " n"]
    suction_n: Float[np.ndarray, " n"]
    vacuum_pa: Float[np.ndarray, " n"]


@dataclass(frozen=True, eq=False)
class Placed:
    """A scene for the referee: rays, and by index of body its centre of mass in the world [m]."""

    rays: RayScene
    centres_m: Float[np.ndarray, "bodies 3"]
    clearance_m: float


def placed(
    meshes: Sequence[Mesh],
    world_from_objects: Sequence[Float[np.ndarray, "4 4"]],
    table_side_m: float,
    clearance_m: float,
) -> Placed:
    """A scene on a table, the table its last body.

    Parameters
    ----------
    meshes
        Of the objects, each in a frame whose origin is its centre of mass.
    world_from_objects
        Their poses.
    table_side_m
        Side of the table [m].
    clearance_m
        How far above a grasp its rays begin [m].

    Returns
    -------
    The scene, ready for rays.
    """
    bodies = [m.transformed(pose) for m, pose in zip(meshes, world_from_objects, strict=True)]
    centres = np.array([pose[:3, 3] for pose in world_from_objects])
    return Placed(RayScene([*bodies, table_mesh(table_side_m)]), centres, clearance_m)


def sealed(
    config: RefereeConfig,
    radius_m: float,
    scene: Placed,
    world_from_gripper: Float[np.ndarray, "4 4"],
    body: int,
) -> Seal | None:
    """The seal of one grasp; None where the pad meets nothing of its object.

    Parameters
    ----------
    config
        Section referee.
    radius_m
        r_G [m].
    scene
        Where the bodies are.
    world_from_gripper
        The pad's pose, shape (4, 4).
    body
        Index of the object among the scene's bodies.

    Returns
    -------
    The seal, or None.
    """
    pad = referee_of(config, radius_m)
    surface, _ = surface_under(pad.disc, world_from_gripper, scene.rays, body, scene.clearance_m)
    return seal(pad, surface) if surface.on_target.any() else None


def judged(
    config: RefereeConfig,
    radius_m: float,
    scene: Placed,
    world_from_gripper: Float[np.ndarray, "n 4 4"],
    bodies: Int[np.ndarray, " n"],
) -> Judged:
    """Every grasp of a scene judged by itself.

    Parameters
    ----------
    config
        Section referee.
    radius_m
        r_G [m].
    scene
        Where the bodies are.
    world_from_gripper
        Poses of the pad, shape (n, 4, 4).
    bodies
        Index of each grasp's object among the scene's bodies, shape (n,).

    Returns
    -------
    What each grasp bears, in their order.
    """
    rows = np.zeros((len(bodies), 4))
    for row, (pose, body) in enumerate(zip(world_from_gripper, bodies, strict=True)):
        found = sealed(config, radius_m, scene, pose, int(body))
        if found is not None:
            rows[row] = (
                weight_borne_n(found, config, pose, scene.centres_m[body]),
                straight_pull_n(found),
                found.pull_n,
                found.vacuum.in_cushion_pa,
            )
    return Judged(*rows.T)


def weights_borne_n(
    config: RefereeConfig,
    radius_m: float,
    scene: Placed,
    world_from_gripper: Float[np.ndarray, "n 4 4"],
    bodies: Int[np.ndarray, " n"],
) -> Float[np.ndarray, " n"]:
    """`Judged.borne_n` alone, parameters as of `judged`."""
    borne_n = np.zeros(len(bodies))
    for row, (pose, body) in enumerate(zip(world_from_gripper, bodies, strict=True)):
        found = sealed(config, radius_m, scene, pose, int(body))
        if found is not None:
            borne_n[row] = weight_borne_n(found, config, pose, scene.centres_m[body])
    return borne_n


def variations(config: RefereeConfig) -> Iterator[tuple[str, float, RefereeConfig]]:
    """Each figure halved and doubled, as (name, factor, configuration), where that is allowed."""
    for name in type(config).model_fields:
        if name in NOT_VARIED:
            continue
        for factor in (0.5, 2.0):
            changed = config.model_dump() | {name: factor * getattr(config, name)}
            try:
                yield name, factor, RefereeConfig.model_validate(changed)
            except ValidationError:  # more than can be: a discharge over 1
                continue


def chosen_evenly(
    quality: Float[np.ndarray, " n"],
    objects: Int[np.ndarray, " n"],
    wanted: int,
    rng: np.random.Generator,
) -> Int[np.ndarray, " k"]:
    """Grasps spread over tenths of q and over objects: of every pair as many, as far as there are.

    Parameters
    ----------
    quality
        q of each grasp, shape (n,).
    objects
        Index of each grasp's object, shape (n,).
    wanted
        How many.
    rng
        Draws within a pair.

    Returns
    -------
    Indices in order, shape (k,), k = min(n, wanted).
    """
    tenth = np.clip((10 * quality).astype(np.int64), 0, 9)
    shuffled = rng.permutation(len(quality))
    pair = (objects * 10 + tenth)[shuffled]
    order = np.argsort(pair, kind="stable")
    _, first, counts = np.unique(pair[order], return_index=True, return_counts=True)
    turn = np.empty(len(quality), dtype=np.int64)
    turn[order] = np.arange(len(quality)) - np.repeat(first, counts)
    return np.sort(shuffled[np.argsort(turn, kind="stable")[:wanted]])


def stands_for(
    quality: Float[np.ndarray, " n"], chosen: Int[np.ndarray, " k"]
) -> Float[np.ndarray, " k"]:
    """How many grasps of its tenth of q each chosen one stands for.

    Parameters
    ----------
    quality
        q of all grasps, shape (n,).
    chosen
        Indices of some, shape (k,).

    Returns
    -------
    At least 1, shape (k,).
    """
    tenth = np.clip((10 * quality).astype(np.int64), 0, 9)
    every, some = (np.bincount(part, minlength=10) for part in (tenth, tenth[chosen]))
    return np.asarray(every[tenth[chosen]] / some[tenth[chosen]])
