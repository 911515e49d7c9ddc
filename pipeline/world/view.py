"""What a camera saw, as arrays."""

from dataclasses import dataclass

import numba
import numpy as np
from jaxtyping import Float, UInt8, UInt16

from pipeline.world.cameras import PinholeCamera


@dataclass(frozen=True, eq=False)
class CameraView:
    """One exact picture of a scene, before its sensor disturbs it.

    depth_m : (h, w) along the camera's z, 0 where nothing was seen.
    segmentation : (h, w) body id, 0 for the table and the background.
    normals : (h, w, 3) unit shading normals in CCS as a normal map, 128 + 127 n; 0 where
        nothing was seen.
    behind_m : depth of what lies behind transparent objects, taken with these away; None where
        the scene has none.
    """

    camera: PinholeCamera
    depth_m: Float[np.ndarray, "h w"]
    colour: UInt8[np.ndarray, "h w 3"]
    segmentation: UInt16[np.ndarray, "h w"]
    normals: UInt8[np.ndarray, "h w 3"]
    behind_m: Float[np.ndarray, "h w"] | None = None


def normal_map(normals: Float[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w 3"]:
    """Unit normals in CCS as 128 + 127 n; where a normal is zero or not finite, 0."""
    return np.asarray(_normal_map(normals))


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _normal_map(normals: Float[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w 3"]:
    encoded = np.zeros(normals.shape, dtype=np.uint8)
    for i in range(normals.shape[0]):
        for j in range(normals.shape[1]):
            x, y, z = normals[i, j]
            largest = max(abs(x), abs(y), abs(z))
            if np.isfinite(x + y + z) and largest > 0.0:
                # From 1 to 255, so that no direction reads as nothing seen.
                for k in range(3):
                    scaled = 127.0 * min(max(normals[i, j, k], -1.0), 1.0)
                    encoded[i, j, k] = 128 + int(np.floor(scaled + 0.5))
    return encoded


def normals_of(view: CameraView) -> Float[np.ndarray, "h w 3"]:
    """Unit normals in CCS, good to half a degree; NaN where nothing was seen."""
    normals = (view.normals.astype(np.float64) - 128) / 127
    normals[(view.normals == 0).all(axis=2)] = np.nan
    return np.asarray(normals / np.linalg.norm(normals, axis=2, keepdims=True))
