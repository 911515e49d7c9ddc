"""Labelled grasps ↔ softgrip.v1.GraspBatch, pads to look at ↔ softgrip.v1.DrapedPads."""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Integer

from pipeline.artifacts.tensors import set_tensors, tensors_of
from pipeline.errors import ContentError
from schemas.softgrip.v1.grasps_pb2 import DrapedPads, GraspBatch

# What each array is stored as; the field names are those of the message.
STORED_AS = {
    "object_index": "u2",
    "body_id": "u2",
    "world_from_gripper": "f8",
    "quality": "f8",
    "pressure": "f8",
    "wrench": "f8",
    "limit_slack": "f8",
    "weight_summary": "f8",
    "contact_mask": "u1",
    "status": "u1",
    "iterations": "u1",
    "tilt_rad": "f4",
    "proposal": "u1",
    "keep_probability": "f4",
    "cloud": "f2",
    "cloud_mask": "u1",
    "touch_height_m": "f8",
    "pictures": "u1",
}
SHAPES = {
    **dict.fromkeys(STORED_AS, "n"),
    "world_from_gripper": "n 4 4",
    "wrench": "n 4",
    "limit_slack": "n k",
    "weight_summary": "n 3",
    "contact_mask": "n v",
    "cloud": "n g g 3",
    "cloud_mask": "n g g",
}
# What the fields hold that v1 did not have from the start.
UNLESS_THERE = {"pictures": 1}


PADS_STORED_AS = {"grasp": "u4", "height_m": "f4", "pressure": "f4"}
PADS_SHAPES = {"grasp": "k", "height_m": "k v", "pressure": "k t"}


@dataclass(frozen=True)
class LabelledGrasps:
    """Grasps of one scene seen from one viewpoint; arrays of one length n.

    Attributes
    ----------
    world_from_gripper
        (n, 4, 4) GCS at first touch, in WCS.
    quality, pressure
        (n,) q of S-1.12 and p of Eq. (2).
    wrench
        (n, 4) GW, dimensionless.
    limit_slack
        (n, 8) room to Eq. (8)-(11).
    weight_summary
        (n, 3) least, greatest and rms deviation from 1 of W.
    contact_mask
        (n, v) pad vertices in contact.
    tilt_rad, proposal, keep_probability
        The sampler's bias.
    cloud, cloud_mask
        (n, g, g, 3) and (n, g, g), units of r_G, origin at the contact.
    touch_height_m
        (n,) first touch above the contact.
    pictures
        (n,) how many pictures the cloud was cut from: one, or all of the scene.
    """

    object_index: Integer[np.ndarray, " n"]
    body_id: Integer[np.ndarray, " n"]
    world_from_gripper: Float[np.ndarray, "n 4 4"]
    quality: Float[np.ndarray, " n"]
    pressure: Float[np.ndarray, " n"]
    wrench: Float[np.ndarray, "n 4"]
    limit_slack: Float[np.ndarray, "n 8"]
    weight_summary: Float[np.ndarray, "n 3"]
    contact_mask: Bool[np.ndarray, "n v"]
    status: Integer[np.ndarray, " n"]
    iterations: Integer[np.ndarray, " n"]
    tilt_rad: Float[np.ndarray, " n"]
    proposal: Integer[np.ndarray, " n"]
    keep_probability: Float[np.ndarray, " n"]
    cloud: Float[np.ndarray, "n g g 3"]
    cloud_mask: Bool[np.ndarray, "n g g"]
    touch_height_m: Float[np.ndarray, " n"]
    pictures: Integer[np.ndarray, " n"]

    def __len__(self) -> int:
        return len(self.quality)

    def rows(self, start: int, stop: int) -> "LabelledGrasps":
        """A contiguous part."""
        return LabelledGrasps(*(getattr(self, f.name)[start:stop] for f in fields(self)))


@dataclass(frozen=True)
class GraspOrigin:
    """What the grasps of one batch have in common, and the names its indices point into."""

    scene_id: str
    viewpoint: str
    level: int
    split: str
    object_names: tuple[str, ...]
    limit_names: tuple[str, ...]
    status_names: tuple[str, ...]
    proposal_names: tuple[str, ...]


def grasp_batch(origin: GraspOrigin, grasps: LabelledGrasps) -> GraspBatch:
    """The message of some grasps."""
    message = GraspBatch(
        scene_id=origin.scene_id,
        viewpoint=origin.viewpoint,
        level=origin.level,
        split=origin.split,
        object_names=origin.object_names,
        limit_names=origin.limit_names,
        status_names=origin.status_names,
        proposal_names=origin.proposal_names,
        pad_vertices=grasps.contact_mask.shape[1],
    )
    packed = {"contact_mask": np.packbits(grasps.contact_mask, axis=1)}
    set_tensors(message, vars(grasps) | packed, STORED_AS)
    return message


def grasps_of(message: GraspBatch) -> tuple[GraspOrigin, LabelledGrasps]:
    """The grasps of a message: views of its bytes wherever possible.

    Parameters
    ----------
    message
        Of a shard of stage grasps.

    Returns
    -------
    Where the grasps are from, and the grasps.

    Raises
    ------
    ContentError
        a tensor is missing, or they do not fit together.
    """
    arrays = tensors_of(message, STORED_AS, SHAPES, UNLESS_THERE)
    if arrays["contact_mask"].shape[1] != -(-message.pad_vertices // 8):
        raise ContentError(f"A contact mask is not of {message.pad_vertices} pad vertices")
    if (arrays["object_index"] >= len(message.object_names)).any():
        raise ContentError("A grasp is of an object that has no name")
    arrays["contact_mask"] = np.unpackbits(
        arrays["contact_mask"], axis=1, count=message.pad_vertices
    ).view(bool)
    arrays["cloud_mask"] = arrays["cloud_mask"].view(bool)
    origin = GraspOrigin(
        scene_id=message.scene_id,
        viewpoint=message.viewpoint,
        level=message.level,
        split=message.split,
        object_names=tuple(message.object_names),
        limit_names=tuple(message.limit_names),
        status_names=tuple(message.status_names),
        proposal_names=tuple(message.proposal_names),
    )
    return origin, LabelledGrasps(**arrays)


@dataclass(frozen=True)
class ShownPads:
    """Pads of some grasps of a shard, draped.

    Attributes
    ----------
    grasp
        Number of each grasp within its shard.
    height_m
        z(v) of S-1.07, in GCS.
    pressure
        p w_j of each triangle, 0 where it is not in contact.
    """

    grasp: Integer[np.ndarray, " k"]
    height_m: Float[np.ndarray, "k v"]
    pressure: Float[np.ndarray, "k t"]


def pads_message(pads: ShownPads) -> DrapedPads:
    """The message of some pads."""
    message = DrapedPads()
    set_tensors(message, vars(pads), PADS_STORED_AS)
    return message


def pads_of(message: DrapedPads) -> ShownPads:
    """The pads of a message. Raises ContentError where its tensors do not fit together."""
    return ShownPads(**tensors_of(message, PADS_STORED_AS, PADS_SHAPES))
