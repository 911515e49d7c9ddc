"""The surface under a pad: one ray down the approach from each of its vertices (S-1.07)."""

from typing import Protocol

import numpy as np
from jaxtyping import Float, Int

from pipeline.gripper.pad import Pad


class Hits(Protocol):
    """First hit of each ray; body -1 and distance inf where nothing is hit."""

    @property
    def distance_m(self) -> Float[np.ndarray, " n"]: ...

    @property
    def body(self) -> Int[np.ndarray, " n"]: ...


class Rays(Protocol):
    """Surfaces that rays can be cast at."""

    def cast(
        self, origins_m: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"], /
    ) -> Hits: ...


def pad_heights(
    world_from_contact: Float[np.ndarray, "n 4 4"], rays: Rays, pad: Pad, clearance_m: float
) -> tuple[Float[np.ndarray, "n v"], Int[np.ndarray, "n v"]]:
    """z_s(v): height of the scene under each pad vertex above the frame's origin, and its body.

    Rays go down the approach from ``clearance_m`` above the origin; -inf and -1 where nothing
    is hit.
    """
    count, vertices = len(world_from_contact), len(pad.vertices_xy_m)
    above = np.column_stack([pad.vertices_xy_m, np.full(vertices, clearance_m)])
    rotation = world_from_contact[:, :3, :3]
    origins = above @ rotation.transpose(0, 2, 1) + world_from_contact[:, None, :3, 3]
    down = np.repeat(-rotation[:, :, 2], vertices, axis=0)
    hits = rays.cast(origins.reshape(-1, 3), down)
    return (
        (clearance_m - hits.distance_m).reshape(count, vertices),
        hits.body.reshape(count, vertices),
    )
