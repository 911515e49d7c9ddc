"""Disturb (S-1.15): what a real depth camera does to an exact depth image.

Time of flight: Kinect v2's axial spread of 1-2 mm within a metre, growing with distance
and incidence (Wasenmueller and Stricker, ACCV Workshops 2016). Structured light: axial
spread 1.2 mm + 1.9 mm (z/m - 0.4)^2 (Nguyen, Izadi and Lovell, 3DIMPVT 2012). Lidar: the
line through the L515 data sheet's bounds on the spread, 2.5 mm at 1 m and 15.5 mm at 9 m
(Intel, 2020). All of them see nothing at grazing incidence, and little along depth edges;
the angles and shares of that are our choice. So is the share of pixels on a transparent
object that return nothing; the others measure what lies behind it (the two errors that
Sajjan et al., ICRA 2020, name), so the supplement's first failure (VIII) is the sensor's.
"""

from dataclasses import dataclass

import numba
import numpy as np
from jaxtyping import Float, UInt8

from pipeline.config.cameras import DepthSensor
from pipeline.world.cameras import pixel_slopes
from pipeline.world.view import CameraView


@dataclass(frozen=True)
class NoiseModel:
    """A depth sensor's errors at depth z and angle of incidence a.

    The standard deviation is sigma(z, a) = (floor + linear z + quadratic (z - 0.4)^2) / cos a [m].

    Attributes
    ----------
    floor_m
        Constant part of sigma [m].
    linear
        Factor of z.
    quadratic_1_m
        Factor of (z - 0.4)^2 [1/m].
    grazing_rad
        Angle of incidence beyond which nothing is measured [rad].
    edge_m
        Depth step to a neighbouring pixel that makes a pixel an edge pixel [m].
    edge_loss
        Share of the edge pixels that measure nothing.
    transparent_loss
        Share of the pixels on transparent objects that measure nothing.
    """

    floor_m: float
    linear: float
    quadratic_1_m: float
    grazing_rad: float
    edge_m: float
    edge_loss: float
    transparent_loss: float


NOISE_MODELS: dict[DepthSensor, NoiseModel] = {
    "time-of-flight": NoiseModel(0.0008, 0.0007, 0.0, 1.40, 0.02, 0.5, 0.3),
    "lidar": NoiseModel(0.000875, 0.001625, 0.0, 1.31, 0.02, 0.5, 0.3),
    "structured-light": NoiseModel(0.0012, 0.0, 0.0019, 1.22, 0.01, 0.8, 0.6),
}
_STEEPEST = 0.05  # cosine below which the spread grows no more


def disturb(view: CameraView, rng: np.random.Generator) -> Float[np.ndarray, "h w"]:
    """The depth image as the view's own sensor would measure it; 0 where it sees nothing.

    An ideal sensor errs only in what is out of its range and in what is transparent, which it
    does not see at all.
    """
    camera = view.camera
    exact = view.depth_m.astype(np.float64)
    depth = exact if view.behind_m is None else view.behind_m.astype(np.float64)
    through = depth != exact
    in_range = (depth >= camera.near_m) & (depth <= camera.far_m)
    if camera.sensor == "ideal":
        return np.where(in_range, depth, 0.0)
    model = NOISE_MODELS[camera.sensor]
    cosine = cosine_of_incidence(view)
    spread = (
        model.floor_m + model.linear * depth + model.quadratic_1_m * (depth - 0.4) ** 2
    ) / np.maximum(cosine, _STEEPEST)
    measured = depth + spread * rng.standard_normal(depth.shape)
    lost = cosine < np.cos(model.grazing_rad)
    lost |= _edges(exact, model.edge_m) & (rng.random(depth.shape) < model.edge_loss)
    lost |= through & (rng.random(depth.shape) < model.transparent_loss)
    return np.where(in_range & ~lost, measured, 0.0)


def cosine_of_incidence(view: CameraView) -> Float[np.ndarray, "h w"]:
    """Cosine between each pixel's ray and the surface normal; 0 where nothing was seen.

    The normal is that of the first surface, transparent or not: there the light bends.
    """
    x, y = pixel_slopes(view.camera.intrinsics, view.depth_m.shape)
    return np.asarray(_cosines(view.normals, x, y))


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _cosines(
    normals: UInt8[np.ndarray, "h w 3"], x: Float[np.ndarray, " w"], y: Float[np.ndarray, " h"]
) -> Float[np.ndarray, "h w"]:
    """Against rays (x, y, 1), from the normal map itself."""
    cosines = np.zeros(normals.shape[:2])
    for i in range(len(y)):
        for j in range(len(x)):
            if normals[i, j, 0] == 0:
                continue
            nx = (normals[i, j, 0] - 128.0) / 127.0
            ny = (normals[i, j, 1] - 128.0) / 127.0
            nz = (normals[i, j, 2] - 128.0) / 127.0
            against = -(nx * x[j] + ny * y[i] + nz)
            lengths = (nx * nx + ny * ny + nz * nz) * (x[j] * x[j] + y[i] * y[i] + 1.0)
            cosines[i, j] = min(max(against / np.sqrt(lengths), 0.0), 1.0)
    return cosines


def _edges(depth: Float[np.ndarray, "h w"], step_m: float) -> np.ndarray:
    """Pixels with a step to a neighbour in depth."""
    edges = np.zeros(depth.shape, dtype=bool)
    across = np.abs(np.diff(depth, axis=1)) > step_m
    down = np.abs(np.diff(depth, axis=0)) > step_m
    edges[:, 1:] |= across
    edges[:, :-1] |= across
    edges[1:] |= down
    edges[:-1] |= down
    return edges
