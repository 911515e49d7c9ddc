"""What a closed surface looks like, whatever its size, place and turn: a descriptor of its shape.

Osada et al., "Shape Distributions", 2002: distances of points on the surface, here from the
middle of the solid and from each other, as sorted quantiles.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.distance import pdist

from pipeline.geometry.mesh import Mesh
from pipeline.geometry.shape import mass_properties, outer_surface, surface_area, volume

# Points on the surface whose distances from the middle are taken, and quantiles of distances.
_POINTS = 4096
_QUANTILES = 64
# Additive recurrences by the plastic number fill the unit square more evenly than any draw.
_PLASTIC = 1.324717957244746
# Points whose distances from each other are taken: half a million chords.
_CHORD_POINTS = 1024


@dataclass(frozen=True, eq=False)
class ShapeDescriptor:
    """A closed surface's shape, free of scale, place, turn and mirroring, in units of cbrt(V)."""

    length: float
    """cbrt(V) in the mesh's unit; no part of the shape."""
    radii: Float[np.ndarray, " q"]
    """Sorted quantiles of the distances of surface points from the centre of mass [1]."""
    chords: Float[np.ndarray, " q"]
    """Sorted quantiles of the distances between surface points [1]."""
    moments: Float[np.ndarray, " 3"]
    """Sorted principal radii of gyration of the solid [1]."""
    nsvr: float
    """Eq. (15)."""


def describe(mesh: Mesh) -> ShapeDescriptor:
    """The descriptor of a closed mesh's outer surface.

    Parameters
    ----------
    mesh
        Closed and outward, with a positive volume; in any frame and unit.

    Returns
    -------
    The same to sampling, some thousandths, however the surface is cut into triangles.
    """
    outer = outer_surface(mesh)
    enclosed = volume(outer)
    length = float(np.cbrt(enclosed))
    mass = mass_properties(outer, 1.0)
    points = (surface_points(outer, _POINTS) - mass.centre_of_mass_m) / length
    # Second moments along the axes from moments of inertia about them.
    inertia = np.sort(np.linalg.eigvalsh(mass.inertia_kg_m2)) / (enclosed * length**2)
    second = np.sort(inertia.sum() / 2 - inertia)
    return ShapeDescriptor(
        length=length,
        radii=_quantiles(np.linalg.norm(points, axis=1)),
        chords=_quantiles(pdist(surface_points(outer, _CHORD_POINTS)) / length),
        moments=np.sqrt(np.maximum(second, 0.0)),
        nsvr=float(np.sqrt(surface_area(outer)) / length),
    )


def shape_distance(one: ShapeDescriptor, other: ShapeDescriptor) -> float:
    """How unlike two shapes are, whatever their sizes [1]; 0 for a shape and its mirror image.

    The greatest of four differences, each relative to the larger of the two: mean difference of
    radii and of chords (transport distances), largest of the moments, and that of the NSVR.
    """
    widest = max(one.moments.max(), other.moments.max())
    return max(
        _mean_difference(one.radii, other.radii),
        _mean_difference(one.chords, other.chords),
        float(np.abs(one.moments - other.moments).max() / widest),
        abs(one.nsvr - other.nsvr) / max(one.nsvr, other.nsvr),
    )


def surface_points(mesh: Mesh, count: int) -> Float[np.ndarray, "count 3"]:
    """Points spread evenly over a surface, each for an equal share of its area; no draw in it."""
    return points_and_faces(mesh, count)[0]


def points_and_faces(
    mesh: Mesh, count: int
) -> tuple[Float[np.ndarray, "count 3"], Int[np.ndarray, " count"]]:
    """`surface_points`, and the face that each lies on."""
    a, b, c = (mesh.vertices_m[mesh.faces[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    reached = np.cumsum(areas)
    index = np.arange(count)
    face = np.searchsorted(reached, (index + 0.5) / count * reached[-1], side="right")
    face = np.minimum(face, len(areas) - 1)
    u, v = (index / _PLASTIC) % 1.0, (index / _PLASTIC**2) % 1.0
    root = np.sqrt(u)
    weights = np.stack([1.0 - root, root * (1.0 - v), root * v], axis=1)
    points = weights[:, :1] * a[face] + weights[:, 1:2] * b[face] + weights[:, 2:] * c[face]
    return points, face


def _quantiles(distances: Float[np.ndarray, " n"]) -> Float[np.ndarray, " q"]:
    return np.asarray(np.quantile(distances, (np.arange(_QUANTILES) + 0.5) / _QUANTILES))


def _mean_difference(one: Float[np.ndarray, " q"], other: Float[np.ndarray, " q"]) -> float:
    return float(np.abs(one - other).mean() / max(one.mean(), other.mean()))
