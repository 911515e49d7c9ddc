"""Where grasps are tried: contacts, approach directions and poses, S-1.04 - S-1.06.

A contact c is a point of the object's surface that the camera can see, for a
grasp is only ever tried on what was observed; and where the camera sees what
the pad would meet: around c the picture does not end, and the surface at c and
every tilted d_G face the camera, for at a slant half of what lies under the pad
is hidden. The approach d_G is the mean surface normal around c, as the policy
estimates it (Supplement VI), tilted off it for part of the proposals; the spin
about d_G is uniform. A second round proposes near grasps whose labels are
rare, for labels fall from a full seal to none within a few millimetres. Which
rule proposed a grasp is kept with it.
"""

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import cKDTree

from pipeline.config.grasps import GraspsConfig


class Proposal(IntEnum):
    """The rule that proposed a grasp: the sampler's bias, sample by sample."""

    NORMAL = 0  # contact uniform over what is seen face on, approach along the mean normal
    TILTED = 1  # the same, approach tilted off the normal
    NEARBY = 2  # a small step from a grasp with a rare label


@dataclass(frozen=True)
class VisibleSurface:
    """Points of the objects that a camera sees, in WCS.

    points_m : (n, 3) on the true surface. normals : (n, 3) unit, outward.
    body_id : (n,) which object a point lies on. eye_m : (3,) where the camera is.
    whole : (n,) the picture shows all around the point, as far as the pad reaches.
    """

    points_m: Float[np.ndarray, "n 3"]
    normals: Float[np.ndarray, "n 3"]
    body_id: Int[np.ndarray, " n"]
    eye_m: Float[np.ndarray, " 3"]
    whole: Bool[np.ndarray, " n"]

    def of_body(self, body_id: int | np.integer) -> "VisibleSurface":
        """The part that lies on one object."""
        mine = self.body_id == body_id
        return replace(
            self,
            points_m=self.points_m[mine],
            normals=self.normals[mine],
            body_id=self.body_id[mine],
            whole=self.whole[mine],
        )

    def contacts(self, angle_max_rad: float) -> Int[np.ndarray, " k"]:
        """Indices of the points where a pad may be tried: whole in the picture, seen face on."""
        return np.flatnonzero(
            self.whole & self.seen_face_on(self.points_m, self.normals, angle_max_rad)
        )

    def seen_face_on(
        self,
        points_m: Float[np.ndarray, "k 3"],
        approach: Float[np.ndarray, "k 3"],
        angle_max_rad: float,
    ) -> Bool[np.ndarray, " k"]:
        """Which unit approaches are within the angle off the direction to the camera."""
        to_eye = self.eye_m - points_m
        cosine = np.einsum("ij,ij->i", approach, to_eye) / _lengths(to_eye)
        return np.asarray(cosine >= np.cos(angle_max_rad))


@dataclass(frozen=True)
class Candidates:
    """Grasps to be labelled; arrays of one length n.

    world_from_contact : (n, 4, 4) origin at the contact c, +z out along d_G (S-1.06).
    body_id : (n,) the object to be grasped. tilt_rad : (n,) d_G off the mean normal.
    """

    world_from_contact: Float[np.ndarray, "n 4 4"]
    body_id: Int[np.ndarray, " n"]
    tilt_rad: Float[np.ndarray, " n"]
    proposal: Int[np.ndarray, " n"]

    def __len__(self) -> int:
        return len(self.body_id)

    def take(self, chosen: Int[np.ndarray, " k"]) -> "Candidates":
        """Those at the given indices."""
        return Candidates(
            self.world_from_contact[chosen],
            self.body_id[chosen],
            self.tilt_rad[chosen],
            self.proposal[chosen],
        )


def joined(parts: list[Candidates]) -> Candidates:
    """Several sets as one, in order."""
    return Candidates(
        np.concatenate([part.world_from_contact for part in parts]),
        np.concatenate([part.body_id for part in parts]),
        np.concatenate([part.tilt_rad for part in parts]),
        np.concatenate([part.proposal for part in parts]),
    )


def propose(
    surface: VisibleSurface, count: int, config: GraspsConfig, rng: np.random.Generator
) -> Candidates:
    """First round: ``count`` grasps of one object, contacts uniform over what is seen face on.

    S-1.04 draws the contact c, S-1.05 the approach d_G, S-1.06 the spin about it.

    surface : points of that object alone, with at least one of its `contacts`.
    """
    contacts = surface.contacts(config.seen_angle_max_rad)
    at = contacts[rng.integers(len(contacts), size=count)]
    normals = mean_normals(surface, surface.points_m[at], config.normal_radius_m)
    tilted = rng.random(count) >= config.normal_share
    tilt = np.where(tilted, rng.uniform(0.0, config.tilt_max_rad, count), 0.0)
    approach = tilt_directions(normals, tilt, rng)
    # Turned too far from the camera: take the normal itself.
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
    """Second round: a small step of contact and approach from each of ``grasps``.

    surface : points of the object that all ``grasps`` are on. The new contact is one of its
    `contacts` within ``config.nearby_radius_m`` of the old one (the old one itself where
    none is), the new approach within ``config.nearby_tilt_rad`` of the old approach, or the
    mean normal where that would lean too far off it or away from the camera.
    """
    count = len(grasps)
    contacts = surface.points_m[surface.contacts(config.seen_angle_max_rad)]
    old = grasps.world_from_contact[:, :3, 3]
    offset = rng.normal(size=(count, 3))
    offset *= (config.nearby_radius_m * np.cbrt(rng.random(count)) / _lengths(offset))[:, None]
    distance, nearest = cKDTree(contacts).query(old + offset)
    contact = np.where((distance <= config.nearby_radius_m)[:, None], contacts[nearest], old)
    step = rng.uniform(0.0, config.nearby_tilt_rad, count)
    approach = tilt_directions(grasps.world_from_contact[:, :3, 2], step, rng)
    normals = mean_normals(surface, contact, config.normal_radius_m)
    cosine = np.clip(np.einsum("ij,ij->i", normals, approach), -1.0, 1.0)
    tilt = np.arccos(cosine)
    # Off by more than the first round may be: take the normal itself.
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
    surface: VisibleSurface, points_m: Float[np.ndarray, "k 3"], radius_m: float
) -> Float[np.ndarray, "k 3"]:
    """Unit mean of the surface normals within ``radius_m`` of each point (Supplement VI).

    Where the mean vanishes, or nothing is near, the nearest point's normal stands.
    """
    tree = cKDTree(surface.points_m)
    near = tree.query_ball_point(points_m, radius_m)
    counts = np.array([len(indices) for indices in near], dtype=np.int64)
    owner = np.repeat(np.arange(len(points_m)), counts)
    flat = np.concatenate([np.asarray(i, dtype=np.int64) for i in near]) if len(near) else owner
    sums = np.zeros((len(points_m), 3))
    for axis in range(3):
        sums[:, axis] = np.bincount(
            owner, weights=surface.normals[flat, axis], minlength=len(points_m)
        )
    lengths = _lengths(sums)
    _, nearest = tree.query(points_m)
    lonely = lengths <= 1e-6 * np.maximum(counts, 1)
    return np.where(
        lonely[:, None], surface.normals[nearest], sums / np.where(lonely, 1.0, lengths)[:, None]
    )


def tilt_directions(
    directions: Float[np.ndarray, "n 3"],
    tilt_rad: Float[np.ndarray, " n"],
    rng: np.random.Generator,
) -> Float[np.ndarray, "n 3"]:
    """Each unit direction turned by its angle towards a uniformly random side."""
    across, side = tangents(directions)
    azimuth = rng.uniform(0.0, 2 * np.pi, len(directions))
    towards = np.cos(azimuth)[:, None] * across + np.sin(azimuth)[:, None] * side
    return np.asarray(np.cos(tilt_rad)[:, None] * directions + np.sin(tilt_rad)[:, None] * towards)


def contact_frames(
    contact_m: Float[np.ndarray, "n 3"],
    approach: Float[np.ndarray, "n 3"],
    spin_rad: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n 4 4"]:
    """world_from_contact with origin c, z along d_G and x turned by the spin about z."""
    across, side = tangents(approach)
    frames = np.zeros((len(contact_m), 4, 4))
    cosine, sine = np.cos(spin_rad)[:, None], np.sin(spin_rad)[:, None]
    frames[:, :3, 0] = cosine * across + sine * side
    frames[:, :3, 1] = cosine * side - sine * across
    frames[:, :3, 2] = approach
    frames[:, :3, 3] = contact_m
    frames[:, 3, 3] = 1.0
    return frames


def tangents(
    normals: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Two unit vectors that make a right-handed frame with each unit normal."""
    # The world axis least along the normal, so that the cross product never vanishes.
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    across = np.cross(helper, normals)
    across /= _lengths(across)[:, None]
    return across, np.cross(normals, across)


def _lengths(vectors: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
    return np.asarray(np.linalg.norm(vectors, axis=1))
