"""What objects stand on, and the walls around them: table, or bin floor and bin walls.

`support_search` finds the support in what was measured; this module says of points whether they
belong to the support or stand on it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import ConvexHull

from pipeline.camera.floor_bend import FloorBend
from pipeline.camera.planes import Plane
from pipeline.config.predict import PredictConfig, SupportConfig


@dataclass(frozen=True, eq=False)
class Support:
    """The plane that objects stand on, with what bounds the place above it.

    Attributes
    ----------
    world_from_support
        Frame on the plane, z up, shape (4, 4).
    share
        Share of the measured points that lie on the plane.
    walls
        Upright planes around, in the support's frame, normals inwards.
    outline_m
        Corners of the plane's visible part, in its own x and y, shape (n, 2).
    rim_m
        Height of the walls' upper edge over the plane; infinite where there are not two walls
        [m].
    bend
        How the floor departs from the plane; None where too little of it is seen to tell.
    """

    world_from_support: Float[np.ndarray, "4 4"]
    share: float
    walls: tuple[Plane, ...]
    outline_m: Float[np.ndarray, "corners 2"]
    rim_m: float = np.inf
    bend: FloorBend | None = None

    def height_m(self, points_m: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """Height of points of the support's frame over the floor, bent as it is [m]."""
        height = points_m[:, 2]
        return height if self.bend is None else height - self.bend.height_m(points_m[:, :2])


def level_support(height_m: float) -> Support:
    """A support without an edge, at a known height [m] of a world whose z is up."""
    pose = np.eye(4)
    pose[2, 3] = height_m
    return Support(pose, 0.0, (), np.empty((0, 2)))


def stands_out(
    support: Support,
    points_m: Float[np.ndarray, "n 3"],
    eyes_m: Float[np.ndarray, "n 3"],
    config: PredictConfig,
) -> Bool[np.ndarray, " n"]:
    """Whether points belong to what stands on the support, and not to floor, walls or rounding.

    Parameters
    ----------
    support
        What was found.
    points_m
        In the support's frame.
    eyes_m
        Where the camera stood that measured each, in the same frame.
    config
        How far out of the support things stand, and the margins of walls.

    Returns
    -------
    Whether each point does, shape (n,).
    """
    distance_m = np.linalg.norm(points_m - eyes_m, axis=1)
    least_m = np.maximum(config.above_support_m, config.above_support_share * distance_m)
    height_m = support.height_m(points_m)
    chosen = np.asarray(height_m > least_m)
    chosen[chosen] = inside(support, points_m[chosen], config.support)
    low = chosen & (height_m < config.support.rounding_m)
    chosen[low] = ~_on_rounding(support, points_m[low], height_m[low], least_m[low], config.support)
    return chosen


def inside(
    support: Support, points_m: Float[np.ndarray, "n 3"], config: SupportConfig
) -> Bool[np.ndarray, " n"]:
    """Whether points lie above the support's visible part, within the walls.

    Parameters
    ----------
    support
        What was found.
    points_m
        In the support's frame.
    config
        Margins.

    Returns
    -------
    Whether each point does, shape (n,).
    """
    within = np.ones(len(points_m), dtype=bool)
    for wall in support.walls:
        within &= wall.height_m(points_m) > config.wall_margin_m
    if len(support.outline_m) >= 3:
        middle = support.outline_m.mean(axis=0)
        away = support.outline_m - middle
        length = np.linalg.norm(away, axis=1, keepdims=True)
        grown = middle + away * (length + config.outline_margin_m) / np.maximum(length, 1e-9)
        x, y = np.ascontiguousarray(points_m[:, :2].T)
        # Edge by edge: a matrix product waits for OpenBLAS's threads, ten times as long.
        for outward_x, outward_y, offset in ConvexHull(grown).equations:
            within &= outward_x * x + outward_y * y + offset <= 0.0
        # A wall whose inner side is hidden shows its rim alone.
        high = within & (points_m[:, 2] > support.rim_m - config.rim_m)
        within[high] = from_edge(support.outline_m, points_m[high, :2]) >= config.rim_m
    return within


def from_edge(
    corners_m: Float[np.ndarray, "corners 2"], points_m: Float[np.ndarray, "n 2"]
) -> Float[np.ndarray, " n"]:
    """Distance from the nearest edge of a convex outline; negative outside [m]."""
    middle = corners_m.mean(axis=0)
    nearest = np.full(len(points_m), np.inf)
    for corner, following in zip(corners_m, np.roll(corners_m, -1, axis=0), strict=True):
        along = following - corner
        length = float(np.linalg.norm(along))
        if length == 0.0:
            continue
        normal = np.array([-along[1], along[0]]) / length
        if normal @ (middle - corner) < 0:
            normal = -normal
        nearest = np.minimum(nearest, (points_m - corner) @ normal)
    return nearest


def _on_rounding(
    support: Support,
    points_m: Float[np.ndarray, "n 3"],
    height_m: Float[np.ndarray, " n"],
    least_m: Float[np.ndarray, " n"],
    config: SupportConfig,
) -> Bool[np.ndarray, " n"]:
    """Whether points may belong to the rounding between a bin's floor and its walls.

    Think of a ball of the rounding's radius that rolls in the bin: its centre stays a radius away
    from floor and walls. A point that the ball cannot touch may belong to the rounding: it lies
    more than a radius from all places where the centre can be.

    Parameters
    ----------
    support
        What was found; without two walls it is no bin, and has no rounding.
    points_m
        In the support's frame.
    height_m
        Height of each over the floor [m].
    least_m
        How far out of a surface each must stand to be told from it [m].
    config
        The rounding's radius, and margins.

    Returns
    -------
    Whether each point may, shape (n,).
    """
    if len(support.walls) < 2 or len(support.outline_m) < 3:
        return np.zeros(len(points_m), dtype=bool)
    radius_m = config.rounding_m
    # How far the ball's centre must keep inwards of each point, for each wall.
    lacking = [radius_m - wall.height_m(points_m) for wall in support.walls]
    across = np.maximum(np.max(lacking, axis=0), 0.0)
    for i, one in enumerate(support.walls):
        for j in range(i):
            turn = float(one.normal @ support.walls[j].normal)
            across = np.maximum(across, _to_corner(lacking[i], lacking[j], turn))
    # A wall that is hidden or not flat ends the outline, a margin inwards of itself.
    edge_m = from_edge(support.outline_m, points_m[:, :2]) + config.wall_margin_m
    across = np.maximum(across, radius_m - edge_m)
    up = np.maximum(radius_m - height_m, 0.0)
    return np.asarray(np.hypot(across, up) > radius_m - least_m)


def _to_corner(
    first_m: Float[np.ndarray, " n"], second_m: Float[np.ndarray, " n"], turn: float
) -> Float[np.ndarray, " n"]:
    """Distance to the wedge between two planes, for points that lie outside both [m].

    Parameters
    ----------
    first_m
        How far each point is outside the first plane, negative inside [m].
    second_m
        The same of the second [m].
    turn
        Cosine between their normals.

    Returns
    -------
    Distance where the nearest place of the wedge lies on its edge, else 0; shape (n,).
    """
    at_edge = (second_m > turn * first_m) & (first_m > turn * second_m)
    square = first_m**2 + second_m**2 - 2.0 * turn * first_m * second_m
    sine2 = max(1.0 - turn**2, 1e-9)
    return np.where(at_edge, np.sqrt(np.maximum(square, 0.0) / sine2), 0.0)
