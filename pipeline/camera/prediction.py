"""What a prediction is: grasps, the pictures they were found on, and what ranked them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from pipeline.camera.frame import Frame
from pipeline.camera.proposals import Proposals, pixels_of
from pipeline.geometry.transforms import invert


@dataclass(frozen=True, eq=False)
class Prediction:
    """What `make predict` found, with what it was found on.

    Attributes
    ----------
    frames
        The pictures, the first of which positions in a camera's frame refer to.
    proposals
        Grasps in descending order of q-hat.
    ranking
        What predicted the quality: a network's file, or ``analytic``.
    radius_m
        r_G of the gripper [m].
    quality_min
        Under this q-hat no grasp is called good.
    """

    frames: Sequence[Frame]
    proposals: Proposals
    ranking: str
    radius_m: float
    quality_min: float

    @property
    def camera_from_contact(self) -> Float[np.ndarray, "k 4 4"]:
        """Poses in CCS of the first picture, shape (k, 4, 4) [m]."""
        camera_from_world = invert(self.frames[0].camera.world_from_camera)
        return np.asarray(camera_from_world @ self.proposals.world_from_contact)

    @property
    def pixel(self) -> Int[np.ndarray, "k 2"]:
        """Column and row of each contact in the first picture, shape (k, 2)."""
        places = self.proposals.world_from_contact[:, :3, 3]
        return pixels_of(self.frames[0], places)[0]

    @property
    def good(self) -> int:
        """How many grasps promise at least `quality_min`."""
        return int((self.proposals.quality >= self.quality_min).sum())

    @property
    def verdict(self) -> str:
        """One sentence: how many grasps are good, or that there is none."""
        quality = self.proposals.quality
        if self.good:
            return f"{self.good} good grasps, the best with q-hat {quality[0]:.2f}"
        best = f"the best has q-hat {quality[0]:.2f}" if len(quality) else "no contact is left"
        return f"no good grasp here: {best}, and {self.quality_min:.2f} is asked for"
