"""Where to try: contacts on the measured cloud, approach along the mean surface normal.

Supplement VI: sub point clouds are sampled at random, and the grasp direction of each is its
average surface normal.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.compiled_code import njit
from pipeline.control.cloud import Cloud
from pipeline.labelling.sampling import contact_frames

FEWEST_POINTS = 6  # a plane through fewer is no surface


@dataclass(frozen=True, eq=False)
class Candidates:
    """Poses to try; arrays of one length k.

    Attributes
    ----------
    world_from_contact
        Origin at the contact, +z out along the mean normal.
    roughness_m
        Root mean square distance of the points around from their plane.
    normal_radius_m
        Radius of the neighbourhood that the normal is the mean of.
    """

    world_from_contact: Float[np.ndarray, "k 4 4"]
    roughness_m: Float[np.ndarray, " k"]
    normal_radius_m: Float[np.ndarray, " k"]

    def __len__(self) -> int:
        return len(self.roughness_m)

    def take(self, chosen: Bool[np.ndarray, " k"] | Int[np.ndarray, " j"]) -> "Candidates":
        """The candidates at the given indices, or where a mask is true."""
        return Candidates(
            self.world_from_contact[chosen],
            self.roughness_m[chosen],
            self.normal_radius_m[chosen],
        )

    def joined(self, others: "Candidates") -> "Candidates":
        """These candidates, then others."""
        return Candidates(
            np.concatenate([self.world_from_contact, others.world_from_contact]),
            np.concatenate([self.roughness_m, others.roughness_m]),
            np.concatenate([self.normal_radius_m, others.normal_radius_m]),
        )


_NONE = Candidates(np.empty((0, 4, 4)), np.empty(0), np.empty(0))  # no candidate at all


def sample_candidates(
    cloud: Cloud,
    count: int,
    radius_m: float,
    tilt_max_rad: float,
    rng: np.random.Generator,
    lean_max_rad: float = 0.0,
    fewest: int = FEWEST_POINTS,
) -> Candidates:
    """Draw contacts at random from the cloud and give each its frame.

    Parameters
    ----------
    cloud
        Measured points in WCS.
    count
        Contacts to draw, with repetition; u of Supplement VI.
    radius_m
        Radius of the neighbourhood whose mean normal is the approach axis [m].
    tilt_max_rad
        Largest angle between that normal and the vertical [rad]; steeper contacts are left out.
    rng
        Generator of the draw.
    lean_max_rad
        How much steeper a surface may be that is approached at ``tilt_max_rad`` all the same [rad].
    fewest
        Points that a neighbourhood must have.

    Returns
    -------
    At most ``count`` candidates: those too steep or with too few points around are left out.
    """
    if len(cloud) == 0:
        return _NONE
    at = rng.integers(len(cloud), size=count)
    contacts, eyes = cloud.points_m[at], cloud.eye_m[at]
    return candidates_at(cloud, contacts, eyes, radius_m, tilt_max_rad, lean_max_rad, fewest)


def sample_near(
    cloud: Cloud,
    contact_m: Float[np.ndarray, " 3"],
    within_m: float,
    count: int,
    radius_m: float,
    tilt_max_rad: float,
    rng: np.random.Generator,
    lean_max_rad: float = 0.0,
) -> Candidates:
    """Draw contacts at random near a given one, for corrections during the approach.

    Parameters
    ----------
    cloud
        Measured points in WCS.
    contact_m
        The contact aimed at, in WCS [m], shape (3,).
    within_m
        Radius around ``contact_m`` from which contacts are drawn [m].
    count
        Contacts to draw, the measured point nearest to ``contact_m`` included.
    radius_m
        Radius of the neighbourhood whose mean normal is the approach axis [m].
    tilt_max_rad
        Largest angle between that normal and the vertical [rad]; steeper contacts are left out.
    rng
        Generator of the draw.
    lean_max_rad
        As in `sample_candidates` [rad].

    Returns
    -------
    At most ``count`` candidates; the nearest measured point comes first unless it is left out. None
    where no point lies within the radius.
    """
    near = np.flatnonzero(np.linalg.norm(cloud.points_m - contact_m, axis=1) <= within_m)
    if len(near) == 0:
        return _NONE
    nearest = near[np.argmin(np.linalg.norm(cloud.points_m[near] - contact_m, axis=1))]
    at = np.concatenate([[nearest], rng.choice(near, size=count - 1)])
    contacts, eyes = cloud.points_m[at], cloud.eye_m[at]
    return candidates_at(cloud, contacts, eyes, radius_m, tilt_max_rad, lean_max_rad)


def candidates_at(
    cloud: Cloud,
    contacts_m: Float[np.ndarray, "k 3"],
    eyes_m: Float[np.ndarray, "k 3"],
    radius_m: float,
    tilt_max_rad: float,
    lean_max_rad: float = 0.0,
    fewest: int = FEWEST_POINTS,
) -> Candidates:
    """Compute the frame and roughness of each contact, and leave out steep ones.

    A contact is moved along its normal onto the plane through the points around it: their mean is
    nearer to the surface than one noisy point. On a surface that is a little too steep, as a wall
    is, the soft pad makes up for the angle between its normal and the steepest approach.

    Parameters
    ----------
    cloud
        Measured points in WCS.
    contacts_m
        Points of the surface in WCS [m], shape (k, 3).
    eyes_m
        Position of the camera that measured each contact, in WCS [m], shape (k, 3); normals point
        towards it.
    radius_m
        Radius of the neighbourhood that the plane is fitted to [m].
    tilt_max_rad
        Largest angle between normal and vertical [rad].
    lean_max_rad
        As in `sample_candidates` [rad].
    fewest
        Points that a neighbourhood must have.

    Returns
    -------
    Candidates in the order of the contacts, without those that are too steep or have too few points
    around them.
    """
    count, mean, scatter = _neighbourhoods(cloud.points_m, contacts_m, radius_m)
    enough = count >= fewest
    if not enough.any():
        return _NONE
    contacts, eyes, mean = contacts_m[enough], eyes_m[enough], mean[enough]
    squared, axes = np.linalg.eigh(scatter[enough])
    normals = axes[:, :, 0]
    away = np.einsum("ij,ij->i", normals, eyes - contacts) <= 0
    normals = np.where(away[:, None], -normals, normals)
    steep = normals[:, 2] < np.cos(tilt_max_rad + lean_max_rad)
    height = np.einsum("ij,ij->i", normals, mean - contacts)
    places = contacts + height[:, None] * normals
    frames = contact_frames(places, _no_steeper(normals, tilt_max_rad), np.zeros(len(normals)))
    roughness = np.sqrt(np.maximum(squared[:, 0], 0.0))
    fit = ~steep
    return Candidates(frames[fit], roughness[fit], np.full(int(fit.sum()), radius_m))


def _no_steeper(normals: Float[np.ndarray, "k 3"], tilt_max_rad: float) -> Float[np.ndarray, "k 3"]:
    """Those over the largest tilt [rad], raised to it about a level axis."""
    level = np.linalg.norm(normals[:, :2], axis=1)
    steep = normals[:, 2] < np.cos(tilt_max_rad)
    raised = np.where(steep, np.sin(tilt_max_rad) / np.maximum(level, 1e-12), 1.0)
    up = np.where(steep, np.cos(tilt_max_rad), normals[:, 2])
    return np.column_stack([raised[:, None] * normals[:, :2], up])


@njit()
def _neighbourhoods(
    points: Float[np.ndarray, "n 3"], at: Float[np.ndarray, "k 3"], radius: float
) -> tuple[Int[np.ndarray, " k"], Float[np.ndarray, "k 3"], Float[np.ndarray, "k 3 3"]]:
    """Number, mean and covariance of the points within a radius of each place.

    Every point is looked at: for some thousands that is faster than a tree with its lists.
    """
    counts = np.zeros(len(at), dtype=np.int64)
    means = np.zeros((len(at), 3))
    scatter = np.zeros((len(at), 3, 3))
    for i in range(len(at)):
        squares = np.zeros((3, 3))
        sums = np.zeros(3)
        for j in range(len(points)):
            x = points[j, 0] - at[i, 0]
            if x > radius or x < -radius:
                continue
            y = points[j, 1] - at[i, 1]
            z = points[j, 2] - at[i, 2]
            if x * x + y * y + z * z > radius * radius:
                continue
            counts[i] += 1
            sums[0] += x
            sums[1] += y
            sums[2] += z
            squares[0, 0] += x * x
            squares[0, 1] += x * y
            squares[0, 2] += x * z
            squares[1, 1] += y * y
            squares[1, 2] += y * z
            squares[2, 2] += z * z
        if counts[i] == 0:
            continue
        sums /= counts[i]
        means[i] = at[i] + sums
        for row in range(3):
            for column in range(row, 3):
                value = squares[row, column] / counts[i] - sums[row] * sums[column]
                scatter[i, row, column] = scatter[i, column, row] = value
    return counts, means, scatter
