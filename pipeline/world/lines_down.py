"""Highest surface on each of many parallel lines: triangles drawn onto the points of a plane.

What rays down the lines would hit first, found the other way round: a walk over the blocks of
triangles of each body, the highest first, finds those over the points, and each is drawn onto the
points that it covers (`covered_points`). Both sides of a triangle count, as for rays.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from pipeline.compiled_code import njit, unsigned
from pipeline.world.covered_points import (
    SINGLE,
    around_block,
    bound_triangles,
    draw_pairs,
    near_points,
    pairs_of,
    place_triangles,
    points_within,
)
from pipeline.world.node_children import place_children, rank_by_top
from pipeline.world.point_cells import CELLS, PointCells, cells_of
from pipeline.world.triangle_blocks import LANES, TriangleBlocks

# Nodes that wait: fifteen more a level, and seventeen levels hold more triangles than any memory.
_WAITING = 512
# A frame whose volume is farther from 1 is no pose.
_SKEW = 1e-3


@dataclass(frozen=True, eq=False)
class PosedBlocks:
    """A body at rest: the triangles of its mesh, and its pose.

    Attributes
    ----------
    blocks
        The triangles in the body's own frame.
    world_from_body
        The pose, shape (4, 4).
    body_id
        Number by which hits name the body.
    """

    blocks: TriangleBlocks
    world_from_body: Float[np.ndarray, "4 4"]
    body_id: int


def follow_lines(
    bodies: Sequence[PosedBlocks],
    world_from_frame: Float[np.ndarray, "n 4 4"],
    points_xy_m: Float[np.ndarray, "v 2"],
    top_m: float,
) -> tuple[Float[np.ndarray, "n v"], Int[np.ndarray, "n v"]]:
    """Highest surface below ``top_m`` on lines along z of each frame.

    Parameters
    ----------
    bodies
        What the lines may meet; of two at one height the one that comes first counts. Those that
        hide others should come first.
    world_from_frame
        The frames, shape (n, 4, 4), rigid to within rounding of single precision.
    points_xy_m
        Where the lines meet each frame's plane z = 0 [m], shape (v, 2), at least one.
    top_m
        Height above the frame's origin from which the surface is sought downwards [m].

    Returns
    -------
    Height above the frame's origin [m], shape (n, v), -inf where nothing is below; and the body
    that is there, shape (n, v), -1 for none.

    Raises
    ------
    ValueError
        A frame is not finite or no rigid pose.
    """
    frames = np.ascontiguousarray(world_from_frame, dtype=np.float64)
    if not _are_poses(frames):
        raise ValueError("lines need finite frames that are rigid poses")
    cells = cells_of(points_xy_m)
    shape = (len(frames), len(cells.order))
    height_m, body = np.full(shape, -np.inf), np.full(shape, -1, dtype=np.int64)
    for posed in bodies:
        _draw(
            *_arguments(posed, cells),
            frames,
            float(top_m),
            height_m,
            body,
        )
    _measure(frames, float(top_m), height_m)
    return height_m, body


def _arguments(
    posed: PosedBlocks, cells: PointCells
) -> tuple[
    tuple[np.ndarray, ...],
    tuple[np.ndarray, float, int],
    np.ndarray,
    tuple[np.ndarray, ...],
    tuple[np.ndarray, float, np.ndarray, np.ndarray, float],
]:
    """A body and the points as compiled code takes them."""
    blocks = posed.blocks
    return (
        (blocks.corners_m, blocks.near_m, blocks.first, blocks.count, blocks.boxes_m),
        (blocks.centre_m, blocks.extent_m, posed.body_id),
        np.ascontiguousarray(posed.world_from_body, dtype=np.float64),
        (cells.order, cells.x_m, cells.y_m, cells.near_x_m, cells.near_y_m),
        (cells.lower_m, cells.per_m, cells.rows, cells.within, cells.reach_m),
    )


@njit(error_model="numpy")
def _are_poses(frames: Float[np.ndarray, "n 4 4"]) -> bool:
    """Whether all frames are finite and turn without scaling."""
    for f in frames:
        volume = (
            f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
            - f[0, 1] * (f[1, 0] * f[2, 2] - f[1, 2] * f[2, 0])
            + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
        )
        # NaN fails each of these tests.
        if not (abs(volume - 1.0) < _SKEW and np.isfinite(f[0, 3] + f[1, 3] + f[2, 3])):
            return False
    return True


@njit(error_model="numpy")
def _measure(
    frames: Float[np.ndarray, "n 4 4"], top: float, height: Float[np.ndarray, "n v"]
) -> None:
    """Heights as rays measure them: from the top, in metres along z, whatever its length."""
    for row in range(len(frames)):
        x, y, z = frames[row, 0, 2], frames[row, 1, 2], frames[row, 2, 2]
        length = np.sqrt(x * x + y * y + z * z)
        for i in range(height.shape[1]):
            height[row, i] = top - (top - height[row, i]) * length


@njit(error_model="numpy")
def _draw(
    tree: tuple[np.ndarray, ...],
    whole: tuple[np.ndarray, float, int],
    pose: Float[np.ndarray, "4 4"],
    points: tuple[np.ndarray, ...],
    grid: tuple[np.ndarray, float, np.ndarray, np.ndarray, float],
    frames: Float[np.ndarray, "n 4 4"],
    top: float,
    height_out: Float[np.ndarray, "n v"],
    body_out: Int[np.ndarray, "n v"],
) -> None:
    """Draw one body onto the points of each frame, where it is higher than what is there."""
    corners, near, first, count, boxes = tree
    centre, extent, number = whole
    order, x, y, near_x, near_y = points
    lower, per_m, rows, within, reach = grid
    node_at, top_at = np.empty(_WAITING, dtype=np.int64), np.empty(_WAITING, dtype=np.float32)
    cells_at = np.empty((_WAITING, 4), dtype=np.int32)
    # Of each child: columns and rows of cells, lowest and highest z.
    cells = np.empty(4 * LANES, dtype=np.int32)
    low_high = np.empty(2 * LANES, dtype=np.float32)
    rank, keys = np.empty(LANES, dtype=np.int32), np.empty(LANES, dtype=np.int32)
    seen, edges = np.empty(9 * LANES), np.empty(10 * LANES, dtype=np.float32)
    sides, near_turn = np.empty(5 * LANES, dtype=np.float32), np.empty(12, dtype=np.float32)
    near_reach = np.float32(reach)
    so_far = np.empty(len(x), dtype=np.float32)
    found_at, found_lanes = (
        np.empty(len(x) + 1, dtype=np.int64),
        np.empty(len(x) + 1, dtype=np.uint32),
    )
    pair_at, pair_lane = (
        np.empty(LANES * len(x), dtype=np.int64),
        np.empty(LANES * len(x), dtype=np.int64),
    )
    for row in range(len(frames)):
        turn = _frame_from_body(frames[row], pose)
        ready = False
        node_at[0], top_at[0] = len(first) - 1, np.inf
        cells_at[0, 0], cells_at[0, 1], cells_at[0, 2], cells_at[0, 3] = 0, CELLS, 0, CELLS
        waiting = 1
        away = abs(turn[0, 3]) + abs(turn[1, 3]) + abs(turn[2, 3])
        away += abs(centre[0]) + abs(centre[1]) + abs(centre[2])
        slack = SINGLE * (extent + reach + abs(top) + away)
        near_slack = np.float32(slack)
        for axis in range(3):
            for other in range(3):
                near_turn[4 * axis + other] = turn[axis, other]
            near_turn[4 * axis + 3] = (
                turn[axis, 0] * centre[0]
                + turn[axis, 1] * centre[1]
                + turn[axis, 2] * centre[2]
                + turn[axis, 3]
            )
        height, body = height_out[row], body_out[row]
        while waiting > 0:
            waiting -= 1
            node, node_top = node_at[waiting], top_at[waiting]
            if ready and _hidden(rows, cells_at[waiting], so_far, node_top):
                continue
            if node >= len(corners):
                place_children(
                    boxes[node - len(corners)], turn, centre, slack, lower, per_m, cells, low_high
                )
                kept = rank_by_top(top, within, cells, low_high, count[node], keys, rank)
                for k in range(count[node]):
                    # The highest child is put last and walked first; what is left out lies beyond.
                    to = waiting + rank[k]
                    node_at[to], top_at[to] = first[node] + k, low_high[LANES + k]
                    for side in range(4):
                        cells_at[to, side] = cells[side * LANES + k]
                waiting += kept
                continue
            if not ready:
                for i in range(len(so_far)):
                    so_far[i] = np.float32(height[order[i]])
                ready = True
            bound_triangles(near[node], near_turn, near_reach, near_slack, edges, sides)
            # Lanes without a triangle are points, which have no lines to be outside of.
            for k in range(count[node], LANES):
                edges[9 * LANES + k] = -np.inf
            sifted = points_within(
                around_block(sides, near_slack),
                lower,
                per_m,
                rows,
                near_x,
                near_y,
                so_far,
                found_at,
            )
            found = near_points(edges, near_x, near_y, so_far, found_at, sifted, found_lanes)
            if found == 0:
                continue
            place_triangles(corners[node], turn, seen)
            pairs = pairs_of(found_at, found_lanes, found, pair_at, pair_lane)
            draw_pairs(
                seen, order, x, y, pair_at, pair_lane, pairs, top, number, height, body, so_far
            )


@njit(error_model="numpy")
def _frame_from_body(
    f: Float[np.ndarray, "4 4"], pose: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "3 4"]:
    """Coordinates in a frame of points of a body, by the frame's inverse."""
    inverse = np.empty((3, 3))
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            c, d = (j + 1) % 3, (j + 2) % 3
            inverse[j, i] = f[a, c] * f[b, d] - f[a, d] * f[b, c]
    volume = f[0, 0] * inverse[0, 0] + f[1, 0] * inverse[0, 1] + f[2, 0] * inverse[0, 2]
    turn = np.empty((3, 4))
    for i in range(3):
        for j in range(3):
            turn[i, j] = (
                inverse[i, 0] * pose[0, j] + inverse[i, 1] * pose[1, j] + inverse[i, 2] * pose[2, j]
            ) / volume
        turn[i, 3] = (
            inverse[i, 0] * (pose[0, 3] - f[0, 3])
            + inverse[i, 1] * (pose[1, 3] - f[1, 3])
            + inverse[i, 2] * (pose[2, 3] - f[2, 3])
        ) / volume
    return turn


@njit(error_model="numpy")
def _hidden(
    rows: Int[np.ndarray, "cells more"],
    cells: Int[np.ndarray, " 4"],
    so_far: Float[np.ndarray, " v"],
    top: float,
) -> bool:
    """Whether all points in a rectangle of cells have something higher than ``top``."""
    for y in range(cells[2], cells[3]):
        for i in range(
            rows[unsigned(y), unsigned(cells[0])], rows[unsigned(y), unsigned(cells[1])]
        ):
            if so_far[unsigned(i)] <= top:
                return False
    return True
