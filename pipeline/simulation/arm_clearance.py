"""Whether arm and hand would collide with themselves or the table: FCL on cylinders and spheres.

Links that are neighbours in the chain, or have one sphere between them, overlap at their joint by
design and are not checked against each other; the joint's limits keep them apart. The hand is
rigidly fixed to the last link.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import fcl
import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import HandConfig
from pipeline.geometry.iiwa14 import FLANGE_M, LINKS, LinkShape, link_poses
from pipeline.simulation.iiwa14 import flange_from_gripper, stem_shape

TABLE = "table"
_NEAR = 2  # links this near along the chain share a joint
_LAST = len(LINKS) - 1  # the link at the flange
_HAND = len(LINKS)  # place of the hand in the chain
_OFF_THE_TABLE = ("base", "link1", "pad")  # stands on it, or turns upright in place, or is soft


@dataclass(frozen=True, eq=False)
class _Part:
    """A collision shape, the link it is fixed to, its pose there, and its position in the chain."""

    name: str
    place: int
    link: int
    link_from_shape: Float[np.ndarray, "4 4"]
    solid: fcl.CollisionObject


class ArmClearance:
    """Collision shapes of the arm, each enlarged by half of the clearance that is asked for."""

    def __init__(
        self, hand: HandConfig, pad_radius_m: float, base_z_m: float, margin_m: float
    ) -> None:
        """Build the shapes of links, hand and camera.

        Parameters
        ----------
        hand
            Sizes of stem and camera.
        pad_radius_m
            r_G [m].
        base_z_m
            Height of the arm's foot above the table [m].
        margin_m
            Two shapes that are closer than this count as colliding [m].
        """
        self._parts = _parts(hand, pad_radius_m, margin_m / 2)
        self._pairs = [
            (a, b) for a, b in combinations(self._parts, 2) if abs(a.place - b.place) > _NEAR
        ]
        self._above = [part for part in self._parts if part.name not in _OFF_THE_TABLE]
        # A half space, not a box: there is nothing to reach beside the table.
        ground = fcl.Halfspace(np.array([0.0, 0.0, 1.0]), margin_m / 2 - base_z_m)
        self._table = fcl.CollisionObject(ground, fcl.Transform())
        self._request = fcl.CollisionRequest()

    def is_free(self, q_rad: Float[np.ndarray, " 7"]) -> bool:
        """Whether nothing collides at these joint angles [rad]."""
        return next(self.meetings(q_rad), None) is None

    def meetings(self, q_rad: Float[np.ndarray, " 7"]) -> Iterator[tuple[str, str]]:
        """Find everything that collides at some joint angles.

        Parameters
        ----------
        q_rad
            Joint angles [rad], shape (7,).

        Yields
        ------
        tuple[str, str]
            Names of two colliding parts, or of a part and the table.
        """
        base_from_link = link_poses(q_rad)
        for part in self._parts:
            pose = base_from_link[part.link] @ part.link_from_shape
            part.solid.setTransform(fcl.Transform(pose[:3, :3], pose[:3, 3]))
        for first, second in self._pairs:
            if self._meet(first.solid, second.solid):
                yield first.name, second.name
        for part in self._above:
            if self._meet(part.solid, self._table):
                yield part.name, TABLE

    def _meet(self, first: fcl.CollisionObject, second: fcl.CollisionObject) -> bool:
        return bool(fcl.collide(first, second, self._request, fcl.CollisionResult()))


def _parts(hand: HandConfig, pad_radius_m: float, grown_m: float) -> list[_Part]:
    """Shapes of links and stem, the pad in its free shape, and a sphere around the camera."""
    link_from_flange = _along_z(FLANGE_M)
    link_from_gripper = link_from_flange @ flange_from_gripper(hand)
    pad = LinkShape("pad", pad_radius_m, 0.0, hand.stem_begins_m)
    camera = LinkShape("camera", hand.camera_radius_m, 0.0, 0.0)
    camera_at = _along_z(hand.camera_above_m)
    camera_at[0, 3] = hand.camera_aside_m
    placed = [
        *((shape, place, place, np.eye(4)) for place, shape in enumerate(LINKS)),
        (stem_shape(hand), _HAND, _LAST, link_from_flange),
        (pad, _HAND, _LAST, link_from_gripper),
        (camera, _HAND, _LAST, link_from_gripper @ camera_at),
    ]
    return [
        _Part(s.link, place, link, pose @ _along_z(s.middle_m), _solid(s, grown_m))
        for s, place, link, pose in placed
    ]


def _solid(shape: LinkShape, grown_m: float) -> fcl.CollisionObject:
    radius = shape.radius_m + grown_m
    if shape.length_m > 0:
        return fcl.CollisionObject(fcl.Cylinder(radius, shape.length_m + 2 * grown_m))
    return fcl.CollisionObject(fcl.Sphere(radius))


def _along_z(distance_m: float) -> Float[np.ndarray, "4 4"]:
    pose = np.eye(4)
    pose[2, 3] = distance_m
    return pose
