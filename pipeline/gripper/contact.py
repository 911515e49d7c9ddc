"""Contact triangles, their deformed shape, and the pressure: S-1.08, Eq. (2)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.gripper.pad import Pad


@dataclass(frozen=True)
class Contact:
    """The n contact triangles of a draped pad, in GCS, and the pressure over them.

    Attributes
    ----------
    triangles
        Indices into `Pad.triangles`.
    areas_m2
        A^{t_j}, deformed areas [m2].
    normals
        (n_x, n_y, n_z) of each, unit length, n_z > 0.
    centres_m
        Geometric centres [m].
    pressure
        p of Eq. (2) [1].
    """

    triangles: Int[np.ndarray, " n"]
    areas_m2: Float[np.ndarray, " n"]
    normals: Float[np.ndarray, "n 3"]
    centres_m: Float[np.ndarray, "n 3"]
    pressure: float


def contact_of(
    pad: Pad,
    draped_m: Float[np.ndarray, " vertices"],
    vertex_contact: Bool[np.ndarray, " vertices"],
) -> Contact:
    """T of S-1.08: a triangle is in contact where its three vertices are."""
    chosen = np.flatnonzero(vertex_contact[pad.triangles].all(axis=1))
    corners = np.concatenate([pad.vertices_xy_m, draped_m[:, None]], axis=1)[pad.triangles[chosen]]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(doubled, axis=1)
    return Contact(
        triangles=chosen,
        areas_m2=0.5 * lengths,
        normals=doubled / lengths[:, None],
        centres_m=corners.mean(axis=1),
        pressure=pressure_of(pad, chosen),
    )


def pressure_of(pad: Pad, contact_triangles: Int[np.ndarray, " n"]) -> float:
    """p of Eq. (2): squared share of Reg.V that is in contact, by undeformed area."""
    sealed = contact_triangles[pad.in_seal_region[contact_triangles]]
    share = pad.areas_m2[sealed].sum() / pad.seal_area_m2
    return min(float(share), 1.0) ** 2  # rounding must not lift p over 1
