"""Two surfaces laid on each other by a rigid motion, and how far apart they then are.

Turns about the centres of mass: those that bring principal axes together, then turns all over.
The most promising are refined point to plane (Chen and Medioni, "Object modelling by registration
of multiple range images", 1992). Mirroring is no motion.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from pipeline.geometry.descriptor import points_and_faces
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.shape import mass_properties, surface_area

# Points with normals that stand for a surface, those of them that are laid on, and those that
# rate a turn: distances to the planes of 8192 are exact to 3e-4 sqrt(A) on the roundest bodies.
_POINTS, _FITTED_POINTS, _COARSE_POINTS = 8192, 1024, 128
# Turns all over: no turn is farther than some 25 degrees from one of them.
_TURNS = 512
_TURN_SEED = 0
# Turns refined of each set, and steps of that; a step below the least ends it.
_REFINED, _STEPS, _LEAST_STEP = 6, 20, 1e-6
# How near two points are counts their normals too, lest the two sides of a wall be taken for one:
# a normal turned by a right angle is as far as 7 % of sqrt(A).
_NORMAL_WEIGHT = 0.05
# Points of a surface lie a hundredth of sqrt(A) apart; what has none within five of these beside it
# lies beyond the other surface's rim, and its distance is to the point, not to its plane.
_BESIDE = 0.05


@dataclass(frozen=True, eq=False)
class Shape:
    """Points spread over a closed surface about its centre of mass, in units of its sqrt(A)."""

    length_m: float
    """sqrt(A)."""

    points: Float[np.ndarray, "n 3"]
    normals: Float[np.ndarray, "n 3"]
    places: cKDTree
    """The points by place."""
    sides: cKDTree
    """The points by place and weighted normal."""
    axes: Float[np.ndarray, "3 3"]
    """Principal axes as columns, right-handed."""


def shape_of(mesh: Mesh) -> Shape:
    """What of a closed surface is laid on another; free of size."""
    mass = mass_properties(mesh, 1.0)
    _, axes = np.linalg.eigh(mass.inertia_kg_m2)
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    points, faces = points_and_faces(mesh, _POINTS)
    length = float(np.sqrt(surface_area(mesh)))
    points = (points - mass.centre_of_mass_m) / length
    normals = _normals(mesh)[faces]
    sides = cKDTree(_sided(points, normals))
    return Shape(length, points, normals, cKDTree(points), sides, axes)


def distance_laid_on(one: Shape, other: Shape, factor: float, near: float) -> float:
    """How far two surfaces are from each other when one is laid on the other.

    Parameters
    ----------
    one
        The surface that is moved.
    other
        The surface that it is laid on.
    factor
        What the first is multiplied by, as by a factor between units [1].
    near
        Distance with which the search ends [1].

    Returns
    -------
    Root mean square of the distances from points of each surface to the other, in units of
    the second's sqrt(A), for the best motion found, or the first that is `near`.
    """
    scale = factor * one.length_m / other.length_m
    # Axes of equal moments are any axes: a cube's or a can's own say nothing.
    swaps = Rotation.create_group("O").as_matrix()
    by_axes = other.axes @ swaps @ one.axes.T
    all_over = Rotation.random(_TURNS, rng=np.random.default_rng(_TURN_SEED)).as_matrix()
    coarse = scale * one.points[:: len(one.points) // _COARSE_POINTS]
    best = np.inf
    for turns in (by_axes, all_over):
        turned = coarse @ turns.transpose(0, 2, 1)
        rated = np.square(other.places.query(turned)[0]).mean(axis=1)
        for index in np.argsort(rated, kind="stable")[:_REFINED]:
            best = min(best, _refined(one, other, turns[index], scale))
            if best <= near:
                return best
    return best


def _refined(one: Shape, other: Shape, turn: Float[np.ndarray, "3 3"], scale: float) -> float:
    """Distance both ways after turning and shifting on, each step a least-squares one."""
    whole, shift = turn, np.zeros(3)
    every = _POINTS // _FITTED_POINTS
    few, facing = scale * one.points[::every], one.normals[::every]
    for _ in range(_STEPS):
        moved = few @ whole.T + shift
        nearest = _nearest(moved, facing @ whole.T, other)
        normal = other.normals[nearest]
        off = np.einsum("ij,ij->i", normal, other.points[nearest] - moved)
        rows = np.concatenate([np.cross(moved, normal), normal], axis=1)
        step = np.linalg.lstsq(rows, off, rcond=1e-8)[0]
        further = Rotation.from_rotvec(step[:3]).as_matrix()
        whole, shift = further @ whole, further @ shift + step[3:]
        if np.abs(step).max() < _LEAST_STEP:
            break
    there = _distances(few @ whole.T + shift, facing @ whole.T, other)
    behind = (other.points[::every] - shift) @ whole / scale
    back = scale * _distances(behind, other.normals[::every] @ whole, one)
    return float(np.sqrt(np.square(np.concatenate([there, back])).mean()))


def _nearest(
    points: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], onto: Shape
) -> Int[np.ndarray, " n"]:
    return np.asarray(onto.sides.query(_sided(points, normals))[1])


def _distances(
    points: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], onto: Shape
) -> Float[np.ndarray, " n"]:
    """From each point to the plane of the nearest one on a surface, or to that point itself."""
    nearest = _nearest(points, normals, onto)
    between = onto.points[nearest] - points
    off = np.abs(np.einsum("ij,ij->i", onto.normals[nearest], between))
    apart = np.linalg.norm(between, axis=1)
    return np.asarray(np.where(np.square(apart) - np.square(off) > _BESIDE**2, apart, off))


def _sided(
    points: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 6"]:
    return np.concatenate([points, _NORMAL_WEIGHT * normals], axis=1)


def _normals(mesh: Mesh) -> Float[np.ndarray, "m 3"]:
    """Unit normals of the faces; zero where a face has no area."""
    a, b, c = (mesh.vertices_m[mesh.faces[:, k]] for k in range(3))
    crossed = np.cross(b - a, c - a)
    length = np.linalg.norm(crossed, axis=1, keepdims=True)
    return np.asarray(crossed / np.where(length > 0.0, length, 1.0))
