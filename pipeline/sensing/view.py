"""What a camera saw, as arrays."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8, UInt16

from pipeline.sensing.cameras import PinholeCamera


@dataclass(frozen=True, eq=False)
class CameraView:
    """One picture of a scene.

    depth_m : (h, w) along the camera's z, 0 where nothing was seen.
    segmentation : (h, w) body id, 0 for the table and the background.
    """

    camera: PinholeCamera
    depth_m: Float[np.ndarray, "h w"]
    colour: UInt8[np.ndarray, "h w 3"]
    segmentation: UInt16[np.ndarray, "h w"]
