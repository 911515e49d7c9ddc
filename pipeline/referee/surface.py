"""The true surface under the pad: one ray down the approach from each vertex of the disc."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.referee.disc import Disc
from pipeline.world.raycasting import Surfaces


@dataclass(frozen=True, eq=False)
class Surface:
    """What lies under each vertex of the pad, in GCS.

    Attributes
    ----------
    height_m
        Height of the first thing under the vertex, shape (n,); -inf where there is none [m].
    normals
        Unit normals of it that face the pad, shape (n, 3); (0, 0, 1) where there is none.
    on_target
        Whether it is the object to be held, shape (n,).
    open_to_air
        Where air comes in from below: nothing is there, or another body beside the target, for
        between two bodies is a crack. Shape (n,).
    """

    height_m: Float[np.ndarray, " n"]
    normals: Float[np.ndarray, "n 3"]
    on_target: Bool[np.ndarray, " n"]
    open_to_air: Bool[np.ndarray, " n"]


def surface_of(
    disc: Disc,
    height_m: Float[np.ndarray, " n"],
    normals: Float[np.ndarray, "n 3"],
    on_target: Bool[np.ndarray, " n"],
) -> Surface:
    """The surface, with what is open to the air found from what is the target.

    Parameters
    ----------
    disc
        The pad's elements.
    height_m
        Height under each vertex, shape (n,), GCS; -inf where there is none [m].
    normals
        Unit normals, shape (n, 3), GCS.
    on_target
        Whether it is the object's, shape (n,).

    Returns
    -------
    The surface under the pad.
    """
    owner = np.repeat(np.arange(len(height_m)), np.diff(disc.starts))
    beside = np.zeros(len(height_m), dtype=np.bool_)
    beside[owner[on_target[disc.neighbours]]] = True
    nothing = ~np.isfinite(height_m)
    return Surface(height_m, normals, on_target, nothing | (beside & ~on_target))


def surface_under(
    disc: Disc,
    world_from_gripper: Float[np.ndarray, "4 4"],
    scene: Surfaces,
    target: int,
    clearance_m: float,
) -> tuple[Surface, Int[np.ndarray, " n"]]:
    """Rays down the approach onto the bodies of a scene.

    Parameters
    ----------
    disc
        The pad's elements.
    world_from_gripper
        The pad's pose, shape (4, 4): origin anywhere on the approach, +z out of the object.
    scene
        The bodies.
    target
        The one to be held, by the number that the scene gives it.
    clearance_m
        How far above the origin rays begin [m].

    Returns
    -------
    The surface, and which body is under each vertex, shape (n,); -1 for none.
    """
    rotation = world_from_gripper[:3, :3]
    above = np.column_stack([disc.vertices_xy_m, np.full(len(disc.areas_m2), clearance_m)])
    origins = above @ rotation.T + world_from_gripper[:3, 3]
    down = np.broadcast_to(-rotation[:, 2], origins.shape)
    hits = scene.cast(origins, down)
    body, normals = hits.body, scene.normals_at(hits)
    local = np.where((body >= 0)[:, None], normals @ rotation, [0.0, 0.0, 1.0])
    local *= np.where(local[:, 2:] < 0.0, -1.0, 1.0)
    return surface_of(disc, clearance_m - hits.distance_m, local, body == target), body
