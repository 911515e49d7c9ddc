"""A clutter scene as data: what lies where, how near, and what cameras saw of it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pipeline.world.view import CameraView


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """An object where it came to rest.

    body_id : 1-based, its value in the segmentation image; 0 is the table.
    """

    object_name: str
    body_id: int
    world_from_object: Float[np.ndarray, "4 4"]


@dataclass(frozen=True, eq=False)
class ClutterScene:
    """One clutter of Table II, at rest on the table (WCS: z up, table top at z = 0).

    gaps_m : (n,) surface-to-surface distance of each object to its nearest neighbour; inf for
        a lone object. contacts : pairs of body ids that touch.
    settle_time_s : simulated time until everything was at rest.
    """

    scene_id: str
    level: int
    split: str
    seed: int
    objects: tuple[PlacedObject, ...]
    gaps_m: Float[np.ndarray, " n"]
    contacts: tuple[tuple[int, int], ...]
    settle_time_s: float
    views: tuple[CameraView, ...]
