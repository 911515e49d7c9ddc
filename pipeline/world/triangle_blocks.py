"""Triangles in blocks of neighbours, and boxes around the blocks: what few walks find quickly.

Triangles are sorted along Hilbert's curve and cut into blocks of sixteen; sixteen blocks have a
parent, and so on up to one root. The boxes of a parent's children lie side by side, so that all are
tested in SIMD lanes.
"""

from dataclasses import dataclass
from functools import lru_cache
from threading import Lock

import numpy as np
from cachetools import LRUCache, cached
from jaxtyping import Float, Int

from pipeline.compiled_code import njit
from pipeline.geometry.mesh import Mesh
from pipeline.read_only import read_only

# Children of a node, and triangles of a block: two vectors of eight lanes in single precision.
# Loops over fewer are not vectorised.
LANES = 16
# Cells of Hilbert's curve along an axis, as a power of two: 2^16 cells of 30 um on a table of 2 m.
_BITS = 16
# Key digits sorted at a time: the counts of 2^13 digits stay in the L1 cache.
_DIGIT_BITS = 13
# Blocks of meshes kept for the next clutter, by their triangles: some 250 MB.
_KEPT_TRIANGLES = 1 << 21
# A triangle as long as this share of the scene lies in blocks of its own kind, so that a table does
# not blow up the box of what stands on it.
_LONG = 0.125


@dataclass(frozen=True, eq=False)
class TriangleBlocks:
    """Triangles and the boxes around them; nodes are blocks of triangles first, then parents.

    Attributes
    ----------
    corners_m
        Coordinates of the triangles of each block, shape (blocks, 144): 16 x, y, z of the first
        corner, then of the second and third [m]; its first corner where a block has fewer than 16.
    near_m
        The same in single precision, relative to ``centre_m`` [m].
    face
        Number of each triangle before it was sorted, shape (m,).
    first
        A block's first triangle, or a parent's first child, shape (nodes,).
    count
        How many triangles or children it has, shape (nodes,).
    boxes_m
        Middles (16 x, y, z) and halves of the sides of the children of each parent, shape
        (parents, 96), in single precision, relative to ``centre_m`` [m].
    centre_m
        Middle of all triangles [m], shape (3,).
    extent_m
        Longest side of the box around all triangles [m].
    """

    corners_m: Float[np.ndarray, "blocks 144"]
    near_m: Float[np.ndarray, "blocks 144"]
    face: Int[np.ndarray, " m"]
    first: Int[np.ndarray, " nodes"]
    count: Int[np.ndarray, " nodes"]
    boxes_m: Float[np.ndarray, "parents 96"]
    centre_m: Float[np.ndarray, " 3"]
    extent_m: float


@cached(LRUCache(_KEPT_TRIANGLES, getsizeof=lambda blocks: len(blocks.face)), lock=Lock())
def blocks_of(mesh: Mesh) -> TriangleBlocks:
    """The blocks of a mesh in its own frame; those of the last meshes are kept."""
    return build_blocks(_corners(mesh))


@lru_cache(maxsize=512)
def mean_area_m2(mesh: Mesh) -> float:
    """Mean area of the triangles not as long as an eighth of the mesh; inf where all are."""
    _, _, area = _measured(_corners(mesh), _LONG)
    return float(area)


def _corners(mesh: Mesh) -> Float[np.ndarray, "m 3 3"]:
    """Corners of each face [m]."""
    return np.ascontiguousarray(mesh.vertices_m[mesh.faces], dtype=np.float64)


def build_blocks(corners_m: Float[np.ndarray, "m 3 3"]) -> TriangleBlocks:
    """Sort triangles into blocks and build the boxes around them.

    Parameters
    ----------
    corners_m
        Corners of at least one triangle [m], shape (m, 3, 3).

    Returns
    -------
    The blocks.
    """
    lower, upper, _ = _measured(corners_m, _LONG)
    extent = float(np.max(upper - lower))
    keys = _curve_keys(corners_m, lower, extent, _LONG)
    face = _sorted_by(keys)
    centre = (lower + upper) / 2
    blocks, first, count, boxes = _boxed(corners_m, face, centre)
    by_axis = blocks.reshape(-1, 3, 3, LANES)
    near = (by_axis - centre[:, None]).astype(np.float32)
    return TriangleBlocks(
        corners_m=read_only(blocks),
        near_m=read_only(near.reshape(blocks.shape)),
        face=read_only(face),
        first=read_only(first),
        count=read_only(count),
        boxes_m=read_only(boxes),
        centre_m=read_only(centre),
        extent_m=extent,
    )


@njit(error_model="numpy")
def _measured(
    corners: Float[np.ndarray, "m 3 3"], long: float
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"], float]:
    """Box around all triangles, and the mean area of those that are not long."""
    lower, upper = np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(len(corners)):
        for corner in range(3):
            for axis in range(3):
                lower[axis] = min(lower[axis], corners[i, corner, axis])
                upper[axis] = max(upper[axis], corners[i, corner, axis])
    limit = long * max(upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2])
    area, counted = 0.0, 0
    for i in range(len(corners)):
        if _length(corners[i]) > limit:
            continue
        ux, uy, uz = corners[i, 1] - corners[i, 0]
        vx, vy, vz = corners[i, 2] - corners[i, 0]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area += 0.5 * np.sqrt(nx * nx + ny * ny + nz * nz)
        counted += 1
    return lower, upper, area / counted if counted else np.inf


@njit(error_model="numpy")
def _length(corners: Float[np.ndarray, "3 3"]) -> float:
    """Longest side of the box around a triangle."""
    longest = 0.0
    for axis in range(3):
        a, b, c = corners[0, axis], corners[1, axis], corners[2, axis]
        longest = max(longest, max(a, b, c) - min(a, b, c))
    return longest


@njit(error_model="numpy")
def _curve_keys(
    corners: Float[np.ndarray, "m 3 3"], lower: Float[np.ndarray, " 3"], extent: float, long: float
) -> Int[np.ndarray, " m"]:
    """Place of each triangle's middle on Hilbert's curve; long triangles come last."""
    keys = np.empty(len(corners), dtype=np.int64)
    scale = ((1 << _BITS) - 1) / extent if extent > 0.0 else 0.0
    place = np.empty(3, dtype=np.int64)
    for i in range(len(corners)):
        for axis in range(3):
            middle = (corners[i, 0, axis] + corners[i, 1, axis] + corners[i, 2, axis]) / 3.0
            place[axis] = np.int64(max(middle - lower[axis], 0.0) * scale)
        keys[i] = _hilbert(place[0], place[1], place[2])
        if _length(corners[i]) > long * extent:
            keys[i] |= np.int64(1) << (3 * _BITS)
    return keys


@njit(error_model="numpy")
def _hilbert(x: np.int64, y: np.int64, z: np.int64) -> np.int64:
    """Place of a cell on Hilbert's curve in three dimensions (Skilling, 2004)."""
    highest = np.int64(1) << (_BITS - 1)
    bit = highest
    while bit > 1:
        below = bit - 1
        if x & bit:
            x ^= below
        if y & bit:
            x ^= below
        else:
            swapped = (x ^ y) & below
            x ^= swapped
            y ^= swapped
        if z & bit:
            x ^= below
        else:
            swapped = (x ^ z) & below
            x ^= swapped
            z ^= swapped
        bit >>= 1
    y ^= x
    z ^= y
    turned = np.int64(0)
    bit = highest
    while bit > 1:
        if z & bit:
            turned ^= bit - 1
        bit >>= 1
    place = (_spread(x ^ turned) << 2) | (_spread(y ^ turned) << 1) | _spread(z ^ turned)
    return np.int64(place)


@njit(error_model="numpy")
def _spread(number: np.int64) -> np.int64:
    """The number's 16 bits with two zeros before each."""
    number = (number | (number << 16)) & 0x0000FF0000FF
    number = (number | (number << 8)) & 0x00F00F00F00F
    number = (number | (number << 4)) & 0x0C30C30C30C3
    return (number | (number << 2)) & 0x249249249249


@njit(error_model="numpy")
def _sorted_by(keys: Int[np.ndarray, " m"]) -> Int[np.ndarray, " m"]:
    """Order that sorts keys of 49 bits, equal ones as they come: by digits, the last first."""
    order, keys = np.arange(len(keys)), keys.copy()
    order_after, keys_after = np.empty_like(order), np.empty_like(keys)
    digits = np.int64(1) << _DIGIT_BITS
    for shift in range(0, 3 * _BITS + 1, _DIGIT_BITS):
        place = np.zeros(digits + 1, dtype=np.int64)
        for i in range(len(keys)):
            place[((keys[i] >> shift) & (digits - 1)) + 1] += 1
        for digit in range(digits):
            place[digit + 1] += place[digit]
        for i in range(len(keys)):
            digit = (keys[i] >> shift) & (digits - 1)
            order_after[place[digit]] = order[i]
            keys_after[place[digit]] = keys[i]
            place[digit] += 1
        order, order_after = order_after, order
        keys, keys_after = keys_after, keys
    return order


@njit(error_model="numpy")
def _boxed(
    corners: Float[np.ndarray, "m 3 3"],
    face: Int[np.ndarray, " m"],
    centre: Float[np.ndarray, " 3"],
) -> tuple[
    Float[np.ndarray, "blocks 144"],
    Int[np.ndarray, " nodes"],
    Int[np.ndarray, " nodes"],
    Float[np.ndarray, "parents 96"],
]:
    """Blocks of the sorted triangles; first, count and children's boxes of the nodes."""
    blocks = (len(face) + LANES - 1) // LANES
    nodes, level = blocks, blocks
    while level > 1:
        level = (level + LANES - 1) // LANES
        nodes += level
    corners_of = np.empty((blocks, 9 * LANES))
    first, count = np.empty(nodes, dtype=np.int64), np.empty(nodes, dtype=np.int64)
    lower, upper = np.full((nodes, 3), np.inf), np.full((nodes, 3), -np.inf)
    boxes = np.zeros((nodes - blocks, 6 * LANES), dtype=np.float32)
    for block in range(blocks):
        first[block] = block * LANES
        count[block] = min(LANES, len(face) - block * LANES)
        for lane in range(count[block]):
            triangle = face[block * LANES + lane]
            for corner in range(3):
                for axis in range(3):
                    value = corners[triangle, corner, axis]
                    corners_of[block, (3 * corner + axis) * LANES + lane] = value
                    lower[block, axis] = min(lower[block, axis], value)
                    upper[block, axis] = max(upper[block, axis], value)
        # Lanes without a triangle have one without area, which covers nothing.
        for lane in range(count[block], LANES):
            for axis in range(3):
                value = corners_of[block, axis * LANES]
                for corner in range(3):
                    corners_of[block, (3 * corner + axis) * LANES + lane] = value
    below, size, above = 0, blocks, blocks
    while size > 1:
        parents = (size + LANES - 1) // LANES
        for parent in range(parents):
            node = above + parent
            first[node] = below + parent * LANES
            count[node] = min(LANES, size - parent * LANES)
            for lane in range(count[node]):
                child = first[node] + lane
                for axis in range(3):
                    low, high = lower[child, axis], upper[child, axis]
                    boxes[node - blocks, axis * LANES + lane] = (low + high) / 2 - centre[axis]
                    boxes[node - blocks, (3 + axis) * LANES + lane] = (high - low) / 2
                    lower[node, axis] = min(lower[node, axis], low)
                    upper[node, axis] = max(upper[node, axis], high)
        below, size, above = above, parents, above + parents
    return corners_of, first, count, boxes
