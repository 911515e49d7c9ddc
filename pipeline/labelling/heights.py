"""The surface under a pad: what lies down the approach from each of its vertices (S-1.07).

Triangles are drawn onto the pad's vertices, or, where they are many and small, rays are cast. Rays
are rounded to single precision (some 1e-7 of the scene, which moves what lies at an outline), lines
are not; elsewhere both find the same within 1e-8 m.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from pipeline.geometry.mesh import Mesh
from pipeline.gripper.pad import Pad
from pipeline.world.lines_down import follow_lines
from pipeline.world.raycasting import Surfaces
from pipeline.world.triangle_blocks import mean_area_m2

# Rays are quicker at one body whose triangles are smaller than the first: a tenth of what a vertex
# of the pad of Table I has for itself. At several bodies rays need a tree of all, which costs more
# than drawing triangles does down to the second. Measured in `runs/SPEED.md`.
_FINEST_M2 = 0.3e-6
_FINEST_OF_MANY_M2 = 0.05e-6
# Triangles of no area at all count as this small, so that nothing is divided by zero.
_NO_AREA_M2 = 1e-18


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
        Height above the origin from which the surface is sought [m]; everything higher is missed.

    Returns
    -------
    Heights, shape (n, v) [m], -inf where nothing is below; and the body that is hit there, shape
    (n, v), -1 for none.
    """
    bodies = surfaces.bodies
    finest_m2 = _FINEST_M2 if len(bodies) == 1 else _FINEST_OF_MANY_M2
    if bodies and triangles_per_m2([body.mesh for body in bodies]) <= 1.0 / finest_m2:
        posed = [body.posed_blocks for body in bodies]
        return follow_lines(posed, world_from_contact, pad.vertices_xy_m, clearance_m)
    return pad_heights_by_rays(world_from_contact, surfaces, pad, clearance_m)


def triangles_per_m2(meshes: Sequence[Mesh]) -> float:
    """Triangles under a pad on one of these bodies, on the mean, for each square metre of it.

    Bodies of long triangles alone, like a table, do not count: they cost nothing.

    Parameters
    ----------
    meshes
        Surfaces of the bodies [m].

    Returns
    -------
    Mean over bodies of what their triangles' mean areas [m2] go into one; 0 where none counts.
    """
    areas = [area for mesh in meshes if np.isfinite(area := mean_area_m2(mesh))]
    return float(np.mean([1.0 / max(area, _NO_AREA_M2) for area in areas])) if areas else 0.0


def pad_heights_by_rays(
    world_from_contact: Float[np.ndarray, "n 4 4"],
    surfaces: Surfaces,
    pad: Pad,
    clearance_m: float,
) -> tuple[Float[np.ndarray, "n v"], Int[np.ndarray, "n v"]]:
    """The same as `pad_heights` by one ray from each vertex.

    Parameters
    ----------
    world_from_contact
        Pose of each grasp, shape (n, 4, 4).
    surfaces
        Everything that the pad may touch.
    pad
        The pad in GCS, of v vertices.
    clearance_m
        Height above the origin at which rays begin [m].

    Returns
    -------
    Heights and bodies, both of shape (n, v).
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
