"""Disturb (S-1.15): what a real depth camera does to an exact depth image.

Time of flight: Kinect v2's axial spread of 1-2 mm within a metre, growing with distance
and incidence (Wasenmueller and Stricker, ACCV Workshops 2016). Structured light: axial
spread 1.2 mm + 1.9 mm (z/m - 0.4)^2 (Nguyen, Izadi and Lovell, 3DIMPVT 2012). Lidar: the
line through the L515 data sheet's bounds on the spread, 2.5 mm at 1 m and 15.5 mm at 9 m
(Intel, 2020). All of them see nothing at grazing incidence, and little along depth edges;
the angles and shares of that are our choice.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pipeline.config.grasps import Noise, SensingConfig
from pipeline.sensing.view import CameraView


@dataclass(frozen=True)
class NoiseModel:
    """Spread sigma(z, a) = (floor + linear z + quadratic (z - 0.4)^2) / cos a, in metres.

    grazing_rad : no return beyond this incidence a. edge_m : a depth step to a neighbouring
    pixel that makes the pixel an edge. edge_loss : share of edge pixels without return.
    """

    floor_m: float
    linear: float
    quadratic_1_m: float
    grazing_rad: float
    edge_m: float
    edge_loss: float


NOISE_MODELS: dict[Noise, NoiseModel] = {
    "time-of-flight": NoiseModel(0.0008, 0.0007, 0.0, 1.40, 0.02, 0.5),
    "lidar": NoiseModel(0.000875, 0.001625, 0.0, 1.31, 0.02, 0.5),
    "structured-light": NoiseModel(0.0012, 0.0, 0.0019, 1.22, 0.01, 0.8),
}
_STEEPEST = 0.05  # cosine below which the spread grows no more


def disturb(
    view: CameraView, config: SensingConfig, rng: np.random.Generator
) -> Float[np.ndarray, "h w"]:
    """The depth image as the configured sensor would measure it; 0 where it sees nothing."""
    depth = view.depth_m.astype(np.float64)
    if config.noise == "none":
        return depth
    model = NOISE_MODELS[config.noise]
    cosine = np.cos(incidence_rad(view))
    spread = (
        model.floor_m + model.linear * depth + model.quadratic_1_m * (depth - 0.4) ** 2
    ) / np.maximum(cosine, _STEEPEST)
    measured = depth + spread * rng.standard_normal(depth.shape)
    lost = cosine < np.cos(model.grazing_rad)
    lost |= _edges(depth, model.edge_m) & (rng.random(depth.shape) < model.edge_loss)
    return np.where((depth > 0) & ~lost, measured, 0.0)


def incidence_rad(view: CameraView) -> Float[np.ndarray, "h w"]:
    """Angle between each pixel's ray and the surface normal, from differences of depth."""
    depth = view.depth_m.astype(np.float64)
    k = view.camera.intrinsics
    x = (np.arange(depth.shape[1]) + 0.5 - k[0, 2]) / k[0, 0]
    y = (np.arange(depth.shape[0]) + 0.5 - k[1, 2]) / k[1, 1]
    # Along z = f(x/z, y/z): the normal in CCS is (fx z_u, fy z_v, -(z + u z_u + v z_v)).
    by_row, by_column = np.gradient(depth)
    slope_x, slope_y = k[0, 0] * by_column, k[1, 1] * by_row
    along = depth + x[None, :] * slope_x + y[:, None] * slope_y
    normal = np.sqrt(slope_x**2 + slope_y**2 + along**2)
    ray = np.sqrt(1.0 + x[None, :] ** 2 + y[:, None] ** 2)
    cosine = np.clip(depth / np.maximum(normal * ray, 1e-12), 0.0, 1.0)
    return np.asarray(np.arccos(cosine))


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
