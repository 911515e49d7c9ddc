"""Labelled grasps as arrays: the pose of each, its label, and the cloud measured around it."""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Integer


@dataclass(frozen=True)
class LabelledGrasps:
    """Grasps of one scene that were proposed from one viewpoint; arrays of one length n.

    Attributes
    ----------
    object_index
        Index of the grasped object in `GraspOrigin.object_names`, shape (n,).
    body_id
        Body id of the grasped object in its scene, shape (n,).
    world_from_gripper
        Pose of GCS at first touch, in WCS, shape (n, 4, 4).
    quality
        q of S-1.12, shape (n,).
    pressure
        p of Eq. (2), shape (n,).
    wrench
        GW, dimensionless, shape (n, 4).
    limit_slack
        Slack of each limit of Eq. (8)-(11), shape (n, 8); columns as `GraspOrigin.limit_names`.
    weight_summary
        Least, greatest and root-mean-square deviation from 1 of W, shape (n, 3).
    contact_mask
        Whether each of the pad's v vertices is in contact with the target, shape (n, v).
    status
        Index of the solver's status in `GraspOrigin.status_names`, shape (n,).
    iterations
        The solver's iterations, shape (n,).
    tilt_rad
        Angle between d_G and the mean normal [rad], shape (n,).
    proposal
        Index of the proposing rule in `GraspOrigin.proposal_names`, shape (n,).
    keep_probability
        Share of the labels in the same tenth of [0, 1] that balancing kept, shape (n,).
    cloud
        Points in units of r_G, origin at the contact, shape (n, g, g, 3).
    cloud_mask
        Cells of the cloud that hold a measured point, shape (n, g, g).
    touch_height_m
        Height of the first touch above the contact, along d_G [m], shape (n,).
    pictures
        Number of pictures that the cloud was cut from, shape (n,): one, or all of the scene.
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
        """Rows from ``start`` up to, but not including, ``stop``."""
        return LabelledGrasps(*(getattr(self, f.name)[start:stop] for f in fields(self)))


@dataclass(frozen=True)
class GraspOrigin:
    """Scene and viewpoint of the grasps of one batch, and the names that its indices refer to.

    Attributes
    ----------
    scene_id
        The scene.
    viewpoint
        Name of the camera.
    level
        Level of the scene, 1 to 9.
    split
        "train", "val" or "test".
    object_names
        Names of the scene's objects, sorted.
    limit_names
        Names of the columns of `LabelledGrasps.limit_slack`.
    status_names
        Names of the solver's statuses.
    proposal_names
        Names of the proposing rules.
    """

    scene_id: str
    viewpoint: str
    level: int
    split: str
    object_names: tuple[str, ...]
    limit_names: tuple[str, ...]
    status_names: tuple[str, ...]
    proposal_names: tuple[str, ...]
