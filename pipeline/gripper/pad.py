"""The pad: a flat polar grid of vertices and triangles; Table I, S-1.02 and S-1.03."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.config.grasps import PadConfig

# A step that divides the circle or a radius to within rounding does so exactly.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Pad:
    """The undeformed pad in GCS: its plane is z = 0, its centre the origin.

    Vertex 0 is the centre; vertex 1 + i * sectors + k lies on ring i in sector k,
    so ``vertices[1:].reshape(rings, sectors, 2)`` is the disk.

    Attributes
    ----------
    vertices_xy_m
        V of the supplement, x and y in GCS [m].
    triangles
        T of the supplement, vertex indices, counter-clockwise seen from +z.
    edges
        Every edge of the triangulation once, ordered from the centre outwards.
    areas_m2
        Undeformed area of each triangle [m2].
    in_seal_region
        Which triangles are Reg.V, that is, lie inside r_v.
    ring_radii_m
        Radius of each ring [m].
    sectors
        Number of sectors of the polar grid.
    seal_area_m2
        A of Reg.V in Eq. (2) [m2].
    area_m2
        A^G, area of the whole flat pad [m2].
    radius_m
        r_G [m].
    config
        What the pad was built from.
    """

    vertices_xy_m: Float[np.ndarray, "vertices 2"]
    triangles: Int[np.ndarray, "triangles 3"]
    edges: Int[np.ndarray, "edges 2"]
    areas_m2: Float[np.ndarray, " triangles"]
    in_seal_region: Bool[np.ndarray, " triangles"]
    ring_radii_m: Float[np.ndarray, " rings"]
    sectors: int
    seal_area_m2: float
    area_m2: float
    radius_m: float
    config: PadConfig

    @property
    def rings(self) -> int:
        """Number of rings around the centre."""
        return len(self.ring_radii_m)


def build_pad(config: PadConfig) -> Pad:
    """Build the geometric model of G from Table I (S-1.02, S-1.03).

    Every step is the largest that divides its range evenly and stays within its
    bound; r_v and r_G are both rings.
    """
    radii = _ring_radii(config)
    sectors = max(3, math.ceil(2 * math.pi / config.rotation_step_rad - _ROUNDING))
    angles = 2 * math.pi * np.arange(sectors) / sectors
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    disk = radii[:, None, None] * directions[None, :, :]
    vertices = np.concatenate([np.zeros((1, 2)), disk.reshape(-1, 2)])
    triangles = _triangles(len(radii), sectors)
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    # Outermost ring of a triangle, 1-based; the centre is ring 0.
    outermost = ((triangles + sectors - 1) // sectors).max(axis=1)
    in_seal = radii[outermost - 1] <= config.seal_radius_m * (1 + _ROUNDING)
    pad = Pad(
        vertices_xy_m=vertices,
        triangles=triangles,
        edges=_edges(len(radii), sectors),
        areas_m2=areas,
        in_seal_region=in_seal,
        ring_radii_m=radii,
        sectors=sectors,
        seal_area_m2=float(areas[in_seal].sum()),
        area_m2=float(areas.sum()),
        radius_m=config.radius_m,
        config=config,
    )
    for array in (vertices, triangles, pad.edges, areas, in_seal, radii):
        array.setflags(write=False)
    return pad


@lru_cache(maxsize=4)
def pad_of(config: PadConfig) -> Pad:
    """`build_pad`, once for each configuration in a process: its arrays cannot be written."""
    return build_pad(config)


def _ring_radii(config: PadConfig) -> Float[np.ndarray, " rings"]:
    """Rings up to r_v, then on to r_G, each in even steps of at most Delta_r."""
    # Counted in multiples of r_G: lengths in metres are rounded, which may add a ring.
    inner = math.ceil(config.seal_radius_rg / config.radius_step_rg - _ROUNDING)
    radii = config.seal_radius_m * np.arange(1, inner + 1) / inner
    margin = config.radius_m - config.seal_radius_m
    outer = math.ceil((1.0 - config.seal_radius_rg) / config.radius_step_rg - _ROUNDING)
    if outer > 0:
        beyond = config.seal_radius_m + margin * np.arange(1, outer + 1) / outer
        radii = np.concatenate([radii, beyond])
    return radii


def _vertex(ring: int, sector: int, sectors: int) -> int:
    return 1 + ring * sectors + sector % sectors


def _triangles(rings: int, sectors: int) -> Int[np.ndarray, "triangles 3"]:
    """A fan around the centre, then two triangles a cell.

    The diagonal always leads from (i, k) to (i+1, k+1), so that a turn by whole
    sectors maps the triangulation onto itself.
    """
    faces = [(0, _vertex(0, k, sectors), _vertex(0, k + 1, sectors)) for k in range(sectors)]
    for i in range(rings - 1):
        for k in range(sectors):
            inner, inner_next = _vertex(i, k, sectors), _vertex(i, k + 1, sectors)
            outer, outer_next = _vertex(i + 1, k, sectors), _vertex(i + 1, k + 1, sectors)
            faces += [(inner, outer, outer_next), (inner, outer_next, inner_next)]
    return np.array(faces, dtype=np.int64)


def _edges(rings: int, sectors: int) -> Int[np.ndarray, "edges 2"]:
    """Spokes, diagonals and circumference, ring by ring from the centre outwards."""
    pairs: list[tuple[int, int]] = []
    for i in range(rings):
        for k in range(sectors):
            pairs.append((0 if i == 0 else _vertex(i - 1, k, sectors), _vertex(i, k, sectors)))
            if i > 0:
                pairs.append((_vertex(i - 1, k, sectors), _vertex(i, k + 1, sectors)))
        pairs += [(_vertex(i, k, sectors), _vertex(i, k + 1, sectors)) for k in range(sectors)]
    return np.array(pairs, dtype=np.int64)
