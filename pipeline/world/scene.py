"""A clutter scene as data: its objects, their poses and gaps, and the pictures of its cameras."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pipeline.read_only import read_only
from pipeline.world.view import CameraView


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """An object in the pose at which it came to rest.

    Attributes
    ----------
    object_name
        Its name in the catalogue.
    body_id
        Its value in the segmentation image, from 1; 0 is the table.
    world_from_object
        Its pose, shape (4, 4).
    """

    object_name: str
    body_id: int
    world_from_object: Float[np.ndarray, "4 4"]

    def __post_init__(self) -> None:
        object.__setattr__(self, "world_from_object", read_only(self.world_from_object))


@dataclass(frozen=True, eq=False)
class ClutterScene:
    """One clutter of Table II, at rest on the table (WCS: z up, table top at z = 0).

    Attributes
    ----------
    scene_id
        Name of the scene.
    level
        Level of Table II, 1 to 9.
    split
        "train", "val" or "test".
    seed
        Seed that the scene was made from.
    objects
        The objects.
    gaps_m
        Distance from the surface of each object to that of its nearest neighbour [m], shape (n,);
        inf for a single object.
    contacts
        Pairs of body ids that touch.
    settle_time_s
        Simulated time until all objects were at rest [s].
    views
        Pictures of the cameras.
    key
        Digest of what the scene rests on; empty where it is not told.
    generator
        Where its generator stood when its objects were drawn; empty where it is not told.
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
    key: str = ""
    generator: str = ""
