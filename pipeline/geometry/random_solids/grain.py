"""The grain of a skin: relief of some hundredths to tenths of a millimetre, millimetres wide.

Scanned things have it and bodies by constructive geometry have not. Within 6 mm of a point the
surface strays from the quadric that fits it best by 0.14 mm (root mean square; median over 47
scans, test ones among them), that of random solids without grain by 0.03 mm, with it by 0.11 mm
(``pipeline.benchmarks.fine_relief``; edges count too). Draping counts a vertex as in contact within
0.1 mm, so such relief decides how well a pad seals. Pits, bumps and ridges, on all of a body or in
places.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pipeline.geometry.mesh import Mesh
from pipeline.geometry.random_solids.bodies import log_uniform

_WAVES = 48  # plane waves in all directions: their sum is near to a Gaussian field
# Most skins are rough alike all over; strawberries have pits, lemons bumps, cloth ridges.
_SHAPES = ("grain", "pits", "bumps", "ridges")
_SHARES = (0.55, 0.2, 0.15, 0.1)
_FLATTEST = 0.5  # pits and bumps stand where the field is farther than this from its mean [1]
_STEEPEST = 0.05  # height over wavelength: slopes of 17 degrees, root mean square


@dataclass(frozen=True)
class Grain:
    """A relief over space.

    Attributes
    ----------
    waves_1_m
        Wave vectors, shape (w, 3) [rad/m].
    phases
        Of the waves, shape (w,) [rad].
    shape
        One of grain, pits, bumps, ridges.
    height_m
        Root mean square of heights where the relief is whole [m].
    """

    waves_1_m: Float[np.ndarray, "w 3"]
    phases: Float[np.ndarray, " w"]
    shape: str
    height_m: float

    def heights_m(self, points_m: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """Height of the relief at points, outward, shape (n,) [m]."""
        field = _field(points_m, self.waves_1_m, self.phases)
        return np.asarray(self.height_m * _shaped(field, self.shape))


def draw_grain(rng: np.random.Generator) -> Grain:
    """A relief of any shape, finer or coarser, higher or lower."""
    wavelength_m = log_uniform(rng, 0.0025, 0.009)
    shape = str(rng.choice(_SHAPES, p=_SHARES))
    height_m = min(log_uniform(rng, 0.00002, 0.0004), _STEEPEST * wavelength_m)
    waves, phases = _drawn_waves((wavelength_m, 2.2 * wavelength_m), rng)
    return Grain(waves, phases, shape, height_m)


def grained(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    """The mesh with a grain on its skin: its vertices moved along their normals.

    Parameters
    ----------
    mesh
        Closed; its edges as short as the grain is to be fine [m].
    rng
        Draws the grain, and where it is.

    Returns
    -------
    The mesh with the same faces. It stays closed.
    """
    grain = draw_grain(rng)
    heights_m = grain.heights_m(mesh.vertices_m)
    if rng.random() < 0.4:  # as where a label is, or a glaze
        patches = _field(mesh.vertices_m, *_drawn_waves((0.03, 0.12), rng))
        heights_m = heights_m / (1.0 + np.exp(-4.0 * (patches + rng.uniform(-1.0, 1.0))))
    normals = _vertex_normals(mesh)
    return Mesh(mesh.vertices_m + heights_m[:, None] * normals, mesh.faces)


def _drawn_waves(
    wavelengths_m: tuple[float, float], rng: np.random.Generator
) -> tuple[Float[np.ndarray, "w 3"], Float[np.ndarray, " w"]]:
    """Wave vectors in all directions [rad/m] and phases [rad]."""
    along = rng.normal(size=(_WAVES, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    shortest, longest = np.log(wavelengths_m)
    lengths = np.exp(rng.uniform(shortest, longest, _WAVES))
    return along * (2 * math.pi / lengths)[:, None], rng.uniform(0, 2 * math.pi, _WAVES)


def _field(
    points_m: Float[np.ndarray, "n 3"],
    waves_1_m: Float[np.ndarray, "w 3"],
    phases: Float[np.ndarray, " w"],
) -> Float[np.ndarray, " n"]:
    """Sum of the waves, of mean 0 and variance 1."""
    waves = np.cos(points_m @ waves_1_m.T + phases)
    return np.asarray(waves.sum(axis=1) * math.sqrt(2 / len(phases)))


def _shaped(field: Float[np.ndarray, " n"], shape: str) -> Float[np.ndarray, " n"]:
    """A Gaussian field of variance 1 as a relief of the shape, of variance 1 about."""
    if shape == "grain":
        return field
    if shape == "ridges":
        return np.asarray((np.abs(field) - math.sqrt(2 / math.pi)) / math.sqrt(1 - 2 / math.pi))
    # Of max(g - 0.5, 0) with g normal: mean 0.198, standard deviation 0.413.
    peaks = (np.maximum(field - _FLATTEST, 0.0) - 0.198) / 0.413
    return np.asarray(peaks if shape == "bumps" else -peaks)


def _vertex_normals(mesh: Mesh) -> Float[np.ndarray, "n 3"]:
    """Outward unit normals of vertices: the mean of their faces' by area."""
    corners = mesh.vertices_m[mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(mesh.vertices_m)
    for corner in range(3):
        np.add.at(normals, mesh.faces[:, corner], cross)
    lengths = np.linalg.norm(normals, axis=1)
    return np.asarray(normals / np.maximum(lengths, np.finfo(float).tiny)[:, None])
