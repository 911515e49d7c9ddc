"""Sizes of the training objects: each mesh is rescaled to a drawn target; Supplement III."""

import numpy as np
from jaxtyping import Float

from pipeline.config.objects import ObjectsConfig
from pipeline.geometry.mesh import Mesh


def draw_target_extent(
    config: ObjectsConfig, rng: np.random.Generator, least_m: float = 0.0
) -> float:
    """Longest extent after rescaling, uniform between the configured bounds [m].

    least_m: a lower bound that the object itself asks for, at most the upper one.
    """
    least = min(max(config.target_extent_min_m, least_m), config.target_extent_max_m)
    return float(rng.uniform(least, config.target_extent_max_m))


def draw_stretch(config: ObjectsConfig, rng: np.random.Generator) -> Float[np.ndarray, " 3"]:
    """Factors along the object's axes, their logarithms uniform; their product is 1."""
    exponents = rng.uniform(-0.5, 0.5, 3)
    return np.asarray(config.stretch_max ** (exponents - exponents.mean()))


def rescale(mesh: Mesh, target_extent_m: float) -> tuple[Mesh, float]:
    """The mesh scaled about its origin so that its longest extent is the target, and the scale.

    The longest extent is that of the axis-aligned box in the mesh's own frame.

    Parameters
    ----------
    mesh
        In any unit.
    target_extent_m
        Longest side of the box around the result [m].

    Returns
    -------
    The mesh [m], and its lengths over those of the one given.

    Raises
    ------
    ValueError
        The mesh has extent zero.
    """
    longest = float(mesh.extents_m.max())
    if not longest > 0.0:
        raise ValueError("a mesh of extent zero cannot be rescaled")
    scale = target_extent_m / longest
    return Mesh(mesh.vertices_m * scale, mesh.faces), scale
