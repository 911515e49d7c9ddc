"""The surface under a pad: one ray down the approach from each of its vertices (S-1.07)."""

import numpy as np
from jaxtyping import Float, Int

from pipeline.gripper.pad import Pad
from pipeline.world.raycasting import Surfaces


def pad_heights(
    world_from_contact: Float[np.ndarray, "n 4 4"],
    surfaces: Surfaces,
    pad: Pad,
    clearance_m: float,
) -> tuple[Float[np.ndarray, "n v"], Int[np.ndarray, "n v"]]:
    """z_s(v): height of the scene under each pad vertex above the frame's origin (S-1.07).

    Parameters
    ----------
    world_from_contact
        Pose of each grasp, shape (n, 4, 4); the pad approaches along -z.
    surfaces
        Everything that the pad may touch.
    pad
        The pad in GCS, of v vertices.
    clearance_m
        Height above the origin at which rays begin [m]; they miss everything higher.

    Returns
    -------
    Heights, shape (n, v) [m], -inf where nothing is below; and the body that is hit there, shape
    (n, v), -1 for none.
    """
    count, vertices = len(world_from_contact), len(pad.vertices_xy_m)
    above = np.column_stack([pad.vertices_xy_m, np.full(vertices, clearance_m)])
    rotation = world_from_contact[:, :3, :3]
    origins = above @ rotation.transpose(0, 2, 1) + world_from_contact[:, None, :3, 3]
    down = np.repeat(-rotation[:, :, 2], vertices, axis=0)
    hits = surfaces.cast(origins.reshape(-1, 3), down)
    return (
        (clearance_m - hits.distance_m).reshape(count, vertices),
        hits.body.reshape(count, vertices),
    )
