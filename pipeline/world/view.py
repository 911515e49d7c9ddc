"""A camera's picture of a scene, as arrays."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8, UInt16

from pipeline.compiled_code import njit
from pipeline.world.cameras import PinholeCamera


@dataclass(frozen=True, eq=False)
class CameraView:
    """One exact picture of a scene, without the noise of the sensor.

    Attributes
    ----------
    camera
        The camera that took it.
    depth_m
        Depth along the camera's z [m], shape (h, w); 0 where nothing was seen.
    colour
        Red, green and blue, shape (h, w, 3).
    segmentation
        Body id, shape (h, w); 0 for the table and the background.
    normals
        Unit shading normals in CCS as a normal map, 128 + 127 n, shape (h, w, 3); 0 where nothing
        was seen.
    behind_m
        Depth of the scene without its transparent objects [m], shape (h, w); None where it has
        none.
    """

    camera: PinholeCamera
    depth_m: Float[np.ndarray, "h w"]
    colour: UInt8[np.ndarray, "h w 3"]
    segmentation: UInt16[np.ndarray, "h w"]
    normals: UInt8[np.ndarray, "h w 3"]
    behind_m: Float[np.ndarray, "h w"] | None = None


def normal_map(normals: Float[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w 3"]:
    """Encode unit normals in CCS as 128 + 127 n; 0 where a normal is zero or not finite."""
    return np.asarray(_normal_map(normals))


@njit()
def _normal_map(normals: Float[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w 3"]:
    encoded = np.zeros(normals.shape, dtype=np.uint8)
    for i in range(normals.shape[0]):
        for j in range(normals.shape[1]):
            x, y, z = normals[i, j]
            largest = max(abs(x), abs(y), abs(z))
            if np.isfinite(x + y + z) and largest > 0.0:
                # Values are 1 to 255, because 0 means that nothing was seen.
                for k in range(3):
                    scaled = 127.0 * min(max(normals[i, j, k], -1.0), 1.0)
                    encoded[i, j, k] = 128 + int(np.floor(scaled + 0.5))
    return encoded


def normals_of(view: CameraView) -> Float[np.ndarray, "h w 3"]:
    """Decode unit normals in CCS, exact to half a degree; NaN where nothing was seen."""
    normals = (view.normals.astype(np.float64) - 128) / 127
    normals[(view.normals == 0).all(axis=2)] = np.nan
    return np.asarray(normals / np.linalg.norm(normals, axis=2, keepdims=True))
