"""Solids with their true volume and area, which no mesh reader has computed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

Polygon = tuple[int, ...]
Outline = Sequence[tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Solid:
    """Corners, outward polygons over them, and what they enclose.

    corners_m: (n, 3); polygons: corner indices of each, counter-clockwise from outside; area_m2: of
    the outer surface; volume_m3: without the cavities.
    """

    corners_m: Float[np.ndarray, "n 3"]
    polygons: tuple[Polygon, ...]
    volume_m3: float
    area_m2: float
    cavities_m3: float = 0.0

    @property
    def nsvr(self) -> float:
        """Eq. (15), by the outer surface."""
        return math.sqrt(self.area_m2) / math.cbrt(self.volume_m3 + self.cavities_m3)

    @property
    def triangular(self) -> bool:
        """Whether every polygon is a triangle."""
        return all(len(polygon) == 3 for polygon in self.polygons)

    def moved(self, by_m: Sequence[float]) -> "Solid":
        """The same solid elsewhere."""
        moved = self.corners_m + np.asarray(by_m, dtype=np.float64)
        return replace(self, corners_m=moved)

    def turned(self, rotation: Float[np.ndarray, "3 3"]) -> "Solid":
        """The same solid, rotated about the origin."""
        return replace(self, corners_m=self.corners_m @ rotation.T)

    def scaled(self, factor: float) -> "Solid":
        """A similar solid."""
        return Solid(
            self.corners_m * factor,
            self.polygons,
            self.volume_m3 * factor**3,
            self.area_m2 * factor**2,
            self.cavities_m3 * factor**3,
        )


def shoelace(outline: Outline) -> float:
    """Signed area of a plane polygon, positive if counter-clockwise."""
    following = [*outline[1:], outline[0]]
    return sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(outline, following, strict=True)) / 2


def prism(outline: Outline, height: float) -> Solid:
    """Over a counter-clockwise outline that does not cross itself; each cap is one polygon."""
    n = len(outline)
    corners = [(x, y, 0.0) for x, y in outline] + [(x, y, height) for x, y in outline]
    sides = [(i, (i + 1) % n, n + (i + 1) % n, n + i) for i in range(n)]
    lower, upper = tuple(range(n))[::-1], tuple(range(n, 2 * n))
    base = shoelace(outline)
    around = sum(math.dist(outline[i], outline[(i + 1) % n]) for i in range(n))
    return Solid(
        np.array(corners),
        (lower, upper, *sides),
        base * height,
        2 * base + around * height,
    )


def in_triangles(solid: Solid) -> Solid:
    """Convex polygons as fans. Right only for solids whose polygons are all convex."""
    fans = [(p[0], p[k], p[k + 1]) for p in solid.polygons for k in range(1, len(p) - 1)]
    return replace(solid, polygons=tuple(fans))


def together(
    parts: Sequence[Solid], volume_m3: float, area_m2: float, cavities_m3: float = 0.0
) -> Solid:
    """Several solids in one file, and what they enclose together."""
    starts = np.cumsum([0, *(len(part.corners_m) for part in parts)])
    polygons = tuple(
        tuple(int(start) + corner for corner in polygon)
        for start, part in zip(starts, parts, strict=False)
        for polygon in part.polygons
    )
    corners = np.concatenate([part.corners_m for part in parts])
    return Solid(corners, polygons, volume_m3, area_m2, cavities_m3)


def corners_of_triangles(solid: Solid) -> Float[np.ndarray, "m 3 3"]:
    """Each triangle's corners; the solid must be of triangles."""
    return np.asarray(solid.corners_m[np.array(solid.polygons)])


def box(x: float, y: float, z: float) -> Solid:
    """Sides along the axes, one corner in the origin, six quadrilaterals."""
    return prism([(0, 0), (x, 0), (x, y), (0, y)], z)


NOTCHED_OUTLINE = [(0, 0), (0.1, 0), (0.1, 0.1), (0.05, 0.025), (0, 0.1)]
BOX = box(0.10, 0.07, 0.04)
TRIANGLES = in_triangles(BOX)
NOTCHED = prism(NOTCHED_OUTLINE, 0.05)
