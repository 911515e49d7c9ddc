"""Disturb (S-1.15): what a real depth camera does to an exact depth image.

Time of flight: Kinect v2's axial spread of 1-2 mm within a metre, growing with distance
and incidence (Wasenmueller and Stricker, ACCV Workshops 2016). Structured light: axial
spread 1.2 mm + 1.9 mm (z/m - 0.4)^2 (Nguyen, Izadi and Lovell, 3DIMPVT 2012). Lidar: the
line through the L515 data sheet's bounds on the spread, 2.5 mm at 1 m and 15.5 mm at 9 m
(Intel, 2020). All of them see nothing at grazing incidence, and little along depth edges;
the angles and shares of that are our choice. So is the share of pixels on a transparent
object that return nothing; the others measure what lies behind it (the two errors that
Sajjan et al., ICRA 2020, name), so the supplement's first failure (VIII) is the sensor's.

Coded light and active stereo were fitted to real frames (`pipeline.sensing.noise_fit`, `make
sensors`): two consumer cameras for some 0.35 to 0.9 m, of 2016 and 2018. Their noise has a grain,
as neighbouring pixels err alike; and background beside a near edge is in the shadow of one of the
two lenses. Angles beyond those of the frames, and transparent objects, are our choice there too.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy import ndimage

from pipeline.compiled_code import njit
from pipeline.config.cameras import DepthSensor
from pipeline.world.cameras import pixel_slopes
from pipeline.world.view import CameraView


@dataclass(frozen=True)
class NoiseModel:
    """A depth sensor's errors at depth z and angle of incidence a.

    The standard deviation is sigma(z, a) = (floor + linear z + quadratic (z - 0.4)^2) / cos(a)^p,
    in metres, with p the steepness.

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
    steepness
        Power of the cosine of incidence by which sigma grows.
    grain_px
        Standard deviation of the Gaussian by which independent errors of pixels are blurred [px].
    step_m
        Depth is rounded to multiples of this; 0: it is not [m].
    baseline_m
        Where the other lens (or projector) stands to the right of the camera: what it does not see
        is not measured [m].
    """

    floor_m: float
    linear: float
    quadratic_1_m: float
    grazing_rad: float
    edge_m: float
    edge_loss: float
    transparent_loss: float
    steepness: float = 1.0
    grain_px: float = 0.0
    step_m: float = 0.0
    baseline_m: float = 0.0

    def sigma_m(
        self, depth_m: Float[np.ndarray, "*shape"], cosine: Float[np.ndarray, "*shape"]
    ) -> Float[np.ndarray, "*shape"]:
        """Standard deviation of the error before rounding, of depths at cosines of incidence."""
        facing = self.floor_m + self.linear * depth_m + self.quadratic_1_m * (depth_m - 0.4) ** 2
        return np.asarray(facing / np.maximum(cosine, _STEEPEST) ** self.steepness)


_STEEPEST = 0.05  # cosine below which the spread grows no more
NOISE_MODELS: dict[DepthSensor, NoiseModel] = {
    "time-of-flight": NoiseModel(0.0008, 0.0007, 0.0, 1.40, 0.02, 0.5, 0.3),
    "lidar": NoiseModel(0.000875, 0.001625, 0.0, 1.31, 0.02, 0.5, 0.3),
    "structured-light": NoiseModel(0.0012, 0.0, 0.0019, 1.22, 0.01, 0.8, 0.6),
    "coded-light": NoiseModel(
        floor_m=0.000024,
        linear=0.00044,
        quadratic_1_m=0.00011,
        grazing_rad=1.31,
        edge_m=0.02,
        edge_loss=0.78,
        transparent_loss=0.6,
        steepness=1.7,
        grain_px=0.7,
        step_m=0.0001,
    ),
    "active-stereo": NoiseModel(
        floor_m=0.0,
        linear=0.00069,
        quadratic_1_m=0.00096,
        grazing_rad=1.25,
        edge_m=0.02,
        edge_loss=0.63,
        transparent_loss=0.6,
        steepness=0.0,
        grain_px=2.4,
        step_m=0.001,
        baseline_m=0.073,
    ),
}


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
    error = _grained(rng.standard_normal(depth.shape), model.grain_px)
    measured = depth + model.sigma_m(depth, cosine) * error
    if model.step_m > 0.0:
        measured = np.round(measured / model.step_m) * model.step_m
    lost = cosine < np.cos(model.grazing_rad)
    lost |= _edges(exact, model.edge_m) & (rng.random(depth.shape) < model.edge_loss)
    lost |= through & (rng.random(depth.shape) < model.transparent_loss)
    if model.baseline_m != 0.0:
        lost |= _shadow(exact, float(camera.intrinsics[0, 0]) * model.baseline_m)
    return np.where(in_range & ~lost, measured, 0.0)


def _grained(error: Float[np.ndarray, "h w"], grain_px: float) -> Float[np.ndarray, "h w"]:
    """Errors of unit spread, blurred over neighbouring pixels and of unit spread again."""
    if grain_px == 0.0:
        return error
    impulse = np.zeros(2 * int(np.ceil(5 * grain_px)) + 1)
    impulse[len(impulse) // 2] = 1.0
    shrinks = float(np.sum(ndimage.gaussian_filter1d(impulse, grain_px) ** 2))
    return np.asarray(ndimage.gaussian_filter(error, grain_px, mode="wrap") / shrinks)


def _shadow(depth: Float[np.ndarray, "h w"], focal_baseline: float) -> Bool[np.ndarray, "h w"]:
    """Pixels that the other lens does not see, as something nearer stands before them.

    The lens at +b along x sees a pixel of column u at u - f b / z. With b > 0 a pixel is hidden
    where one to its right lies farther to the left in that picture, by half a pixel at least.
    """
    if focal_baseline < 0:
        return _shadow(depth[:, ::-1], -focal_baseline)[:, ::-1]
    away = np.where(depth > 0, depth, np.inf)
    seen_at = np.arange(depth.shape[1], dtype=np.float64) - focal_baseline / away
    first = np.minimum.accumulate(seen_at[:, ::-1], axis=1)[:, ::-1]
    return np.asarray((seen_at > first + 0.5) & (depth > 0))


def cosine_of_incidence(view: CameraView) -> Float[np.ndarray, "h w"]:
    """Cosine between each pixel's ray and the surface normal; 0 where nothing was seen.

    The normal is that of the first surface, transparent or not: there the light bends.
    """
    x, y = pixel_slopes(view.camera.intrinsics, view.depth_m.shape)
    return np.asarray(_cosines(view.normals, x, y))


@njit()
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
