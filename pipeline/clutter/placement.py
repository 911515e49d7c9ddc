"""Where resting objects stand on the table: isolated by darts, multiple by sliding together.

Both place objects in SE(2) (Supplement V): each keeps the rotation and height in which it rests
and gets a yaw and a position. Gaps are those of the true meshes.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from pipeline.clutter.gaps import Box, Surface, bounds_of, box_distance_m, gap_m
from pipeline.config.scenes import ScenesConfig
from pipeline.errors import SceneError

_DARTS_PER_OBJECT = 400  # random places tried; a table that is full needs most of them
_SLIDES_PER_OBJECT = 40  # directions from which an object is slid to its neighbour
_STEPS_PER_SLIDE = 200  # bisection ends long before: this bounds a slide that does not
# Objects settle by some tenths of a millimetre after placement: keep this far inside the bounds.
_MARGIN_M = 0.001
# A slide has arrived when its gap is this near to the one wanted.
_ARRIVED_M = 0.0002


def place_isolated(
    surfaces: Sequence[Surface],
    resting: Sequence[Float[np.ndarray, "4 4"]],
    config: ScenesConfig,
    rng: np.random.Generator,
) -> list[Float[np.ndarray, "4 4"]]:
    """Every gap at least ``isolated_gap_min_m``: random places, refused while too near.

    Parameters
    ----------
    surfaces
        True surfaces of the objects, in their own frames.
    resting
        A stable pose of each on the table.
    config
        Section scenes of the run.
    rng
        Draws places and headings.

    Returns
    -------
    world_from_object of each, in their order.

    Raises
    ------
    SceneError
        No room was found for an object.
    """
    placed: list[Float[np.ndarray, "4 4"]] = [np.eye(4)] * len(surfaces)
    boxes: dict[int, Box] = {}
    # The largest first: the smallest find room between them.
    order = np.argsort([-np.ptp(s.mesh.vertices_m, axis=0).max() for s in surfaces], kind="stable")
    for index in (int(i) for i in order):
        for _ in range(_DARTS_PER_OBJECT):
            pose = turn_pose(resting[index], rng.uniform(0, 2 * np.pi))
            pose = move_pose(pose, *_inside(surfaces[index], pose, config, rng))
            needed = config.isolated_gap_min_m + _MARGIN_M
            box = bounds_of(surfaces[index].mesh, pose)
            if all(
                box_distance_m(box, boxes[other]) >= needed
                or gap_m(surfaces[index], pose, surfaces[other], placed[other]) >= needed
                for other in boxes
            ):
                placed[index] = pose
                boxes[index] = box
                break
        else:
            raise SceneError(
                f"No room for object {len(boxes) + 1} of {len(surfaces)} with gaps of "
                f"{1e3 * config.isolated_gap_min_m:.0f} mm",
                "Raise scenes.workspace_side_m, or lower scenes.objects_per_clutter",
            )
    return placed


def place_multiple(
    surfaces: Sequence[Surface],
    resting: Sequence[Float[np.ndarray, "4 4"]],
    config: ScenesConfig,
    rng: np.random.Generator,
) -> list[Float[np.ndarray, "4 4"]]:
    """Every object within ``multiple_gap_max_m`` of another, none overlapping.

    Each object slides in from outside, towards one that stands already, until its nearest gap
    is a random one within the bound.

    Parameters
    ----------
    surfaces
        True surfaces of the objects, in their own frames.
    resting
        A stable pose of each on the table.
    config
        Section scenes of the run.
    rng
        Draws directions and gaps.

    Returns
    -------
    world_from_object of each, in their order.

    Raises
    ------
    SceneError
        An object found no place on the table.
    """
    placed = [turn_pose(resting[0], rng.uniform(0, 2 * np.pi))]
    for index in range(1, len(surfaces)):
        for _ in range(_SLIDES_PER_OBJECT):
            wanted = rng.uniform(_MARGIN_M, config.multiple_gap_max_m - 2 * _MARGIN_M)
            pose = turn_pose(resting[index], rng.uniform(0, 2 * np.pi))
            target = placed[int(rng.integers(index))][:2, 3]
            start = _outside(surfaces[: index + 1], placed, rng.uniform(0, 2 * np.pi))
            pose = move_pose(pose, *start)
            arrived = _slide(surfaces, placed, index, pose, target, wanted)
            if arrived is not None and _on_workspace(surfaces[index], arrived, config):
                placed.append(arrived)
                break
        else:
            raise SceneError(
                f"No place for object {index + 1} of {len(surfaces)} within "
                f"{1e3 * config.multiple_gap_max_m:.0f} mm of another",
                "Raise scenes.workspace_side_m, or draw another seed",
            )
    return placed


def turn_pose(pose: Float[np.ndarray, "4 4"], yaw_rad: float) -> Float[np.ndarray, "4 4"]:
    """The pose turned by ``yaw_rad`` about the vertical, with its origin moved to x = y = 0."""
    out = pose.copy()
    out[:3, :3] = Rotation.from_euler("z", yaw_rad).as_matrix() @ pose[:3, :3]
    out[:2, 3] = 0.0
    return out


def move_pose(pose: Float[np.ndarray, "4 4"], x_m: float, y_m: float) -> Float[np.ndarray, "4 4"]:
    """The pose with its origin at (x, y), height and rotation kept."""
    out = pose.copy()
    out[:2, 3] = x_m, y_m
    return out


def _slide(
    surfaces: Sequence[Surface],
    placed: Sequence[Float[np.ndarray, "4 4"]],
    index: int,
    pose: Float[np.ndarray, "4 4"],
    target_m: Float[np.ndarray, " 2"],
    wanted_m: float,
) -> Float[np.ndarray, "4 4"] | None:
    """Move straight to the target until the nearest gap is the wanted one; None if it passes by.

    A step as long as the excess gap can never overshoot: no point travels farther than it.
    """
    way = target_m - pose[:2, 3]
    left = float(np.linalg.norm(way))
    way = way / left
    boxes = [bounds_of(s.mesh, at) for s, at in zip(surfaces, placed, strict=False)]
    start, box = pose[:3, 3].copy(), bounds_of(surfaces[index].mesh, pose)
    for _ in range(_STEPS_PER_SLIDE):
        shift = pose[:3, 3] - start
        apart = [box_distance_m((box[0] + shift, box[1] + shift), other) for other in boxes]
        nearest = np.inf
        for other in np.argsort(apart, kind="stable"):
            if apart[other] >= nearest:
                break  # the boxes' distance is a lower bound
            gap = gap_m(surfaces[index], pose, surfaces[other], placed[other])
            nearest = min(nearest, gap)
        excess = nearest - wanted_m
        if abs(excess) <= _ARRIVED_M:
            return pose
        if excess < 0 or left <= 0:
            return None
        step = max(excess, _ARRIVED_M / 2)
        pose = move_pose(pose, *(pose[:2, 3] + step * way))
        left -= step
    return None


def _inside(
    surface: Surface,
    pose: Float[np.ndarray, "4 4"],
    config: ScenesConfig,
    rng: np.random.Generator,
) -> Float[np.ndarray, " 2"]:
    """A uniformly random position at which the object's box lies within the workspace."""
    lower, upper = bounds_of(surface.mesh, pose)
    half = config.workspace_side_m / 2
    return rng.uniform(np.minimum(-half - lower[:2], 0), np.maximum(half - upper[:2], 0))


def _on_workspace(surface: Surface, pose: Float[np.ndarray, "4 4"], config: ScenesConfig) -> bool:
    lower, upper = bounds_of(surface.mesh, pose)
    half = config.workspace_side_m / 2
    return bool((lower[:2] >= -half).all() and (upper[:2] <= half).all())


def _outside(
    surfaces: Sequence[Surface], placed: Sequence[Float[np.ndarray, "4 4"]], azimuth_rad: float
) -> Float[np.ndarray, " 2"]:
    """A position in that direction, clear of all that stands already."""
    reach = max(
        float(np.abs(bound[:2]).max())
        for surface, pose in zip(surfaces, placed, strict=False)
        for bound in bounds_of(surface.mesh, pose)
    )
    own = float(np.linalg.norm(surfaces[-1].mesh.extents_m))
    clear = np.sqrt(2) * reach + own
    return np.array([clear * np.cos(azimuth_rad), clear * np.sin(azimuth_rad)])
