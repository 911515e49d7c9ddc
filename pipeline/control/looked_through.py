"""Whether what was measured before still stands where it stood.

A camera that now measures something farther along the ray to an earlier point looks through that
point: what was there has gone. What comes into view for the first time says nothing.
"""

import numpy as np
from jaxtyping import Float
from scipy.ndimage import minimum_filter

from pipeline.control.cloud import DepthPicture
from pipeline.geometry.transforms import invert, transform_points

_FARTHER_M = 0.008  # more than the noise of two measurements
_AROUND_M = 0.004  # an edge is measured no better than this aside


def looked_through(points_m: Float[np.ndarray, "n 3"], picture: DepthPicture) -> float:
    """Share of the earlier points in view that the picture looks through; 0 where none is.

    points_m : measured before, in WCS.
    """
    camera = picture.camera
    x, y, z = transform_points(invert(camera.world_from_camera), points_m).T
    k = camera.intrinsics
    ahead = z > camera.near_m
    x, y, z = x[ahead], y[ahead], z[ahead]
    if len(z) == 0:
        return 0.0
    height, width = picture.depth_m.shape
    column = np.floor(k[0, 0] * x / z + k[0, 2]).astype(np.int64)
    row = np.floor(k[1, 1] * y / z + k[1, 2]).astype(np.int64)
    # The nearest that is measured around each pixel; where nothing is, nothing is known.
    measured = np.where(picture.depth_m > 0, picture.depth_m, np.inf)
    pixels = 2 * round(_AROUND_M * k[0, 0] / float(np.median(z))) + 1
    nearest = minimum_filter(measured, size=max(pixels, 1), mode="nearest")
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    seen = nearest[row[inside], column[inside]]
    known = np.isfinite(seen)
    if not known.any():
        return 0.0
    return float(np.mean(seen[known] > z[inside][known] + _FARTHER_M))
