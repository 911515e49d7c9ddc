"""Labelled grasps as data: where each is, what its label says, and what a camera saw there."""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Integer


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
