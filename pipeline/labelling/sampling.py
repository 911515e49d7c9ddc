"""Where grasps are tried: contacts, approach directions and poses, S-1.04 - S-1.06.

A contact c is a point of the object's surface that the camera sees, because the policy can only
grasp what was observed. The camera must also see the surface around c that the pad would touch, so
c must fulfil two conditions: it lies at least r_G inside the border of the picture, and the surface
at c faces the camera. A tilted d_G must face the camera too. On a surface seen at a slant, half of
what lies under the pad is hidden.

The approach d_G is the mean surface normal around c, as the policy estimates it (Supplement VI).
Part of the proposals are tilted away from it. The spin about d_G is uniform. Labels fall from a
full seal to none within a few millimetres, so a second round proposes grasps near those whose
labels are rare. Each grasp records the rule that proposed it.
"""

from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import cKDTree

from pipeline.compiled_code import njit
from pipeline.config.grasps import GraspsConfig
from pipeline.labelling.neighbourhood import sums_within
from pipeline.read_only import read_only


class Proposal(IntEnum):
    """The rule that proposed a grasp; with it a user can correct the sampler's bias."""

    NORMAL = 0  # contact uniform over what is seen face on, approach along the mean normal
    TILTED = 1  # the same, approach tilted off the normal
    NEARBY = 2  # a small step from a grasp with a rare label


@dataclass(frozen=True)
class VisibleSurface:
    """Points of the objects that a camera sees, in WCS.

    Attributes
    ----------
    points_m
        Points on the true surface [m], shape (n, 3).
    normals
        Unit outward normals there, shape (n, 3).
    body_id
        Body id of the object that each point lies on, shape (n,).
    eye_m
        Position of the camera [m], shape (3,).
    whole
        Whether the camera measures everything within r_G of the point, shape (n,).
    """

    points_m: Float[np.ndarray, "n 3"]
    normals: Float[np.ndarray, "n 3"]
    body_id: Int[np.ndarray, " n"]
    eye_m: Float[np.ndarray, " 3"]
    whole: Bool[np.ndarray, " n"]

    def of_body(self, body_id: int | np.integer) -> "VisibleSurface":
        """The points that lie on one object."""
        mine = self.body_id == body_id
        return replace(
            self,
            points_m=self.points_m[mine],
            normals=self.normals[mine],
            body_id=self.body_id[mine],
            whole=self.whole[mine],
        )

    def contacts(self, angle_max_rad: float) -> Int[np.ndarray, " k"]:
        """Indices of the points where grasps may be tried: `whole`, and facing the camera."""
        return np.flatnonzero(self.whole & (self._cosine >= np.cos(angle_max_rad)))

    @cached_property
    def _cosine(self) -> Float[np.ndarray, " n"]:
        """Cosine between each normal and the direction to the camera: asked for by every round."""
        return read_only(_cosines(self.points_m, self.normals, self.eye_m))

    def seen_face_on(
        self,
        points_m: Float[np.ndarray, "k 3"],
        approach: Float[np.ndarray, "k 3"],
        angle_max_rad: float,
    ) -> Bool[np.ndarray, " k"]:
        """Whether each approach points to the camera within an angle.

        Parameters
        ----------
        points_m
            Contacts in WCS [m], shape (k, 3).
        approach
            Unit vector d_G of each, shape (k, 3).
        angle_max_rad
            Greatest angle between d_G and the direction to the camera [rad].

        Returns
        -------
        Whether the angle is kept, shape (k,).
        """
        return np.asarray(_cosines(points_m, approach, self.eye_m) >= np.cos(angle_max_rad))


@dataclass(frozen=True)
class Candidates:
    """Grasps to be labelled; arrays of one length n.

    Attributes
    ----------
    world_from_contact
        Origin at the contact c, +z outwards along d_G (S-1.06), shape (n, 4, 4).
    body_id
        Body id of the object to be grasped, shape (n,).
    tilt_rad
        Angle between d_G and the mean normal [rad], shape (n,).
    proposal
        Values of `Proposal`, shape (n,).
    """

    world_from_contact: Float[np.ndarray, "n 4 4"]
    body_id: Int[np.ndarray, " n"]
    tilt_rad: Float[np.ndarray, " n"]
    proposal: Int[np.ndarray, " n"]

    def __len__(self) -> int:
        return len(self.body_id)

    def take(self, chosen: Int[np.ndarray, " k"]) -> "Candidates":
        """The candidates at the given indices."""
        return Candidates(
            self.world_from_contact[chosen],
            self.body_id[chosen],
            self.tilt_rad[chosen],
            self.proposal[chosen],
        )


def join_candidates(parts: list[Candidates]) -> Candidates:
    """Join several sets of candidates, in their order; at least one."""
    return Candidates(
        np.concatenate([part.world_from_contact for part in parts]),
        np.concatenate([part.body_id for part in parts]),
        np.concatenate([part.tilt_rad for part in parts]),
        np.concatenate([part.proposal for part in parts]),
    )


def propose(
    surface: VisibleSurface, count: int, config: GraspsConfig, rng: np.random.Generator
) -> Candidates:
    """First round: draw grasps of one object, their contacts uniform over `surface.contacts`.

    S-1.04 draws the contact c, S-1.05 the approach d_G, S-1.06 the spin about it.

    Parameters
    ----------
    surface
        Points of that object only; at least one of them is among its `contacts`.
    count
        Number of grasps.
    config
        Angles, shares and radii of the sampler.
    rng
        Draws contacts, tilts and spins.

    Returns
    -------
    ``count`` candidates.
    """
    contacts = surface.contacts(config.seen_angle_max_rad)
    at = contacts[rng.integers(len(contacts), size=count)]
    normals = mean_normals(
        surface.points_m, surface.normals, surface.points_m[at], config.normal_radius_m
    )
    tilted = rng.random(count) >= config.normal_share
    tilt = np.where(tilted, rng.uniform(0.0, config.tilt_max_rad, count), 0.0)
    approach = tilt_directions(normals, tilt, rng)
    # An approach that faces away from the camera is replaced by the normal.
    hidden = ~surface.seen_face_on(surface.points_m[at], approach, config.seen_angle_max_rad)
    tilted &= ~hidden
    approach = np.where(tilted[:, None], approach, normals)
    tilt = np.where(tilted, tilt, 0.0)
    return Candidates(
        contact_frames(surface.points_m[at], approach, rng.uniform(0, 2 * np.pi, count)),
        surface.body_id[at],
        tilt,
        np.where(tilted, Proposal.TILTED, Proposal.NORMAL),
    )


def propose_nearby(
    surface: VisibleSurface,
    grasps: Candidates,
    config: GraspsConfig,
    rng: np.random.Generator,
) -> Candidates:
    """Second round: move contact and approach of each grasp by a small random step.

    The new contact is one of the surface's `contacts` within ``config.nearby_radius_m`` of the old
    one, or the old one where there is none. The new approach is within ``config.nearby_tilt_rad``
    of the old one; where it would be tilted more than ``config.tilt_max_rad`` or would not face the
    camera, it is the mean normal.

    Parameters
    ----------
    surface
        Points of the object that all the grasps are on.
    grasps
        Grasps of one object.
    config
        Angles and radii of the sampler.
    rng
        Draws steps and spins.

    Returns
    -------
    One candidate for each grasp, in their order.
    """
    count = len(grasps)
    contacts = surface.points_m[surface.contacts(config.seen_angle_max_rad)]
    old = grasps.world_from_contact[:, :3, 3]
    offset = rng.normal(size=(count, 3))
    offset *= (config.nearby_radius_m * np.cbrt(rng.random(count)) / _lengths(offset))[:, None]
    # A tree that is not balanced is built in a third of the time, and asked about once.
    tree = cKDTree(contacts, balanced_tree=False, compact_nodes=False)
    distance, nearest = tree.query(old + offset)
    contact = np.where((distance <= config.nearby_radius_m)[:, None], contacts[nearest], old)
    step = rng.uniform(0.0, config.nearby_tilt_rad, count)
    approach = tilt_directions(grasps.world_from_contact[:, :3, 2], step, rng)
    normals = mean_normals(surface.points_m, surface.normals, contact, config.normal_radius_m)
    cosine = np.clip(np.einsum("ij,ij->i", normals, approach), -1.0, 1.0)
    tilt = np.arccos(cosine)
    # An approach that the first round could not have drawn is replaced by the normal.
    may = tilt <= config.tilt_max_rad
    may &= surface.seen_face_on(contact, approach, config.seen_angle_max_rad)
    approach = np.where(may[:, None], approach, normals)
    return Candidates(
        contact_frames(contact, approach, rng.uniform(0, 2 * np.pi, count)),
        grasps.body_id,
        np.where(may, tilt, 0.0),
        np.full(count, Proposal.NEARBY),
    )


def mean_normals(
    points_m: Float[np.ndarray, "n 3"],
    normals: Float[np.ndarray, "n 3"],
    around_m: Float[np.ndarray, "k 3"],
    radius_m: float,
) -> Float[np.ndarray, "k 3"]:
    """Unit mean of the surface normals around each point (Supplement VI).

    Parameters
    ----------
    points_m
        Points of a surface [m], at least one, shape (n, 3).
    normals
        Unit outward normals there, shape (n, 3).
    around_m
        Where the mean is wanted, in the same frame [m], shape (k, 3).
    radius_m
        Points within this distance count [m].

    Returns
    -------
    Unit vectors, shape (k, 3); the nearest point's normal where no point is within the radius or
    the normals cancel each other.
    """
    sums, counts = sums_within(points_m, normals, around_m, radius_m)
    lengths = _lengths(sums)
    lonely = lengths <= 1e-6 * np.maximum(counts, 1)
    means = sums / np.where(lonely, 1.0, lengths)[:, None]
    if lonely.any():
        _, nearest = cKDTree(points_m).query(around_m[lonely])
        means[lonely] = normals[nearest]
    return np.asarray(means)


def tilt_directions(
    directions: Float[np.ndarray, "n 3"],
    tilt_rad: Float[np.ndarray, " n"],
    rng: np.random.Generator,
) -> Float[np.ndarray, "n 3"]:
    """Turn each direction by its angle towards a uniformly random side.

    Parameters
    ----------
    directions
        Unit vectors, shape (n, 3).
    tilt_rad
        Angles [rad], shape (n,).
    rng
        Draws the sides.

    Returns
    -------
    Unit vectors, shape (n, 3).
    """
    across, side = tangents(directions)
    azimuth = rng.uniform(0.0, 2 * np.pi, len(directions))
    towards = np.cos(azimuth)[:, None] * across + np.sin(azimuth)[:, None] * side
    return np.asarray(np.cos(tilt_rad)[:, None] * directions + np.sin(tilt_rad)[:, None] * towards)


def contact_frames(
    contact_m: Float[np.ndarray, "n 3"],
    approach: Float[np.ndarray, "n 3"],
    spin_rad: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n 4 4"]:
    """Build the frame of each contact from c, d_G and the spin (S-1.06).

    Parameters
    ----------
    contact_m
        Contacts c in WCS [m], shape (n, 3).
    approach
        Unit vectors d_G, shape (n, 3).
    spin_rad
        Turn of the x axis about d_G [rad], shape (n,).

    Returns
    -------
    world_from_contact with origin c and z along d_G, shape (n, 4, 4).
    """
    return np.asarray(_frames(contact_m, approach, np.cos(spin_rad), np.sin(spin_rad)))


def tangents(
    normals: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Two unit vectors that make a right-handed frame with each unit normal."""
    frames = _frames(np.zeros_like(normals), normals, np.ones(len(normals)), np.zeros(len(normals)))
    return frames[:, :3, 0], frames[:, :3, 1]


@njit(error_model="numpy")
def _frames(
    contacts: Float[np.ndarray, "n 3"],
    normals: Float[np.ndarray, "n 3"],
    cosines: Float[np.ndarray, " n"],
    sines: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n 4 4"]:
    """Frames with z along each normal; x is turned about it from what the normal alone gives."""
    frames = np.zeros((len(normals), 4, 4))
    for i in range(len(normals)):
        x, y, z = normals[i, 0], normals[i, 1], normals[i, 2]
        # The world axis with the greatest angle to the normal: its cross product is never zero.
        if abs(x) <= abs(y) and abs(x) <= abs(z):
            a, b, c = 0.0, -z, y
        elif abs(y) <= abs(z):
            a, b, c = z, 0.0, -x
        else:
            a, b, c = -y, x, 0.0
        length = np.sqrt(a * a + b * b + c * c)
        a, b, c = a / length, b / length, c / length
        across = (a, b, c)
        side = (y * c - z * b, z * a - x * c, x * b - y * a)
        for axis in range(3):
            frames[i, axis, 0] = cosines[i] * across[axis] + sines[i] * side[axis]
            frames[i, axis, 1] = cosines[i] * side[axis] - sines[i] * across[axis]
            frames[i, axis, 2] = normals[i, axis]
            frames[i, axis, 3] = contacts[i, axis]
        frames[i, 3, 3] = 1.0
    return frames


@njit(error_model="numpy")
def _cosines(
    points: Float[np.ndarray, "n 3"],
    directions: Float[np.ndarray, "n 3"],
    eye: Float[np.ndarray, " 3"],
) -> Float[np.ndarray, " n"]:
    """Cosine between each unit direction and the way from its point to the eye."""
    cosines = np.empty(len(points))
    for i in range(len(points)):
        x, y, z = eye[0] - points[i, 0], eye[1] - points[i, 1], eye[2] - points[i, 2]
        along = directions[i, 0] * x + directions[i, 1] * y + directions[i, 2] * z
        cosines[i] = along / np.sqrt(x * x + y * y + z * z)
    return cosines


def _lengths(vectors: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
    return np.asarray(np.linalg.norm(vectors, axis=1))
