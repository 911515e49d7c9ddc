"""Surfaces under the referee's pad, by formula."""

import numpy as np

from pipeline.config.referee import RefereeConfig
from pipeline.referee.disc import Disc
from pipeline.referee.seal import Referee, referee_of
from pipeline.referee.surface import Surface, surface_of

RADIUS_M = 0.025
CONFIG = RefereeConfig()


def referee(element_rg: float = 1 / 16, **changed: float) -> Referee:
    """The pad of Table I with some of its figures changed."""
    return referee_of(RefereeConfig(element_rg=element_rg, **changed), RADIUS_M)


def level_surface(disc: Disc, height_m: np.ndarray, on_target: np.ndarray | None = None) -> Surface:
    """A surface whose normals are those of its slope; everywhere the target where none is given."""
    count = len(disc.areas_m2)
    normals = np.tile([0.0, 0.0, 1.0], (count, 1))
    on = np.ones(count, dtype=bool) if on_target is None else on_target
    return surface_of(disc, height_m, normals, on)


def sphere(disc: Disc, ball_m: float) -> Surface:
    """A ball's top at the origin, with its normals."""
    x, y = disc.vertices_xy_m.T
    z = np.sqrt(ball_m**2 - x**2 - y**2)
    normals = np.column_stack([x, y, z]) / ball_m
    return surface_of(disc, z - ball_m, normals, np.ones(len(x), dtype=bool))


def rough(disc: Disc, rng: np.random.Generator, height_m: float) -> Surface:
    """A sum of waves, with an edge of the object across it, and a neighbour or nothing past it."""
    x, y = disc.vertices_xy_m.T
    height = np.zeros(len(x))
    slope = np.zeros((2, len(x)))
    for _ in range(5):
        kx, ky = rng.normal(size=2) / 0.008
        phase = rng.uniform(0, 2 * np.pi)
        height += height_m / 5 * np.sin(kx * x + ky * y + phase)
        slope += height_m / 5 * np.cos(kx * x + ky * y + phase) * np.array([[kx], [ky]])
    normals = np.column_stack([-slope[0], -slope[1], np.ones(len(x))])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    turn = rng.uniform(0, 2 * np.pi)
    on = np.cos(turn) * x + np.sin(turn) * y < rng.uniform(-0.01, 0.04)
    height[~on] -= rng.choice([0.0, 0.01, np.inf])
    return surface_of(disc, height, normals, on)
