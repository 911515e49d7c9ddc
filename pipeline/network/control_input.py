"""The network's input for control: the result of ``canonical.network_input``, compiled.

A control step prepares some fifty clouds. Computed with tensors, each of the seventy operations on
them reads and writes all of memory; here a cloud stays in the cache from first cell to last.
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from pipeline.compiled_code import njit
from pipeline.config.grasps import CELL_SIDE
from pipeline.network.input_channels import (
    CHANNELS,
    CONTACT_GAP,
    NOTHING,
    PAD_RADIUS,
    REACH,
    REFERENCE_PART,
    SWEEPS,
    Z_FINE_LIMIT,
    Z_LIMIT,
)

# In the order of ``input_channels.CHANNELS``.
_X, _Y, _X_IN_CELL, _Y_IN_CELL, _Z, _Z_FINE, _RADIUS, _SEEN, _PAD_GAP, _PAD_CONTACT = range(
    len(CHANNELS)
)


class _Lengths(NamedTuple):
    """Lengths of other modules, in single precision, as the tensors are."""

    beside: np.float32 = np.float32(CELL_SIDE)
    across: np.float32 = np.float32(math.sqrt(2.0) * CELL_SIDE)
    half_cell: np.float32 = np.float32(CELL_SIDE / 2)
    limit: np.float32 = np.float32(Z_LIMIT)
    fine_limit: np.float32 = np.float32(Z_FINE_LIMIT)
    pad_radius: np.float32 = np.float32(PAD_RADIUS)
    contact_gap: np.float32 = np.float32(CONTACT_GAP)
    nothing: np.float32 = np.float32(NOTHING)
    reach: np.float32 = np.float32(REACH)


_LENGTHS = _Lengths()


def control_input(
    cloud: Float[np.ndarray, "b h w 3"], mask: Bool[np.ndarray, "b h w"]
) -> Float[np.ndarray, "b c h w"]:
    """Canonical input of GA-CNN, of ``input_channels.CHANNELS``, in single precision.

    Parameters
    ----------
    cloud
        Points in GCS in units of r_G, shape (b, h, w, 3); unseen cells may hold anything.
    mask
        Cells that hold a measured point, shape (b, h, w).

    Returns
    -------
    The channels, shape (b, c, h, w), zero in unseen cells.
    """
    count, height, width = mask.shape
    inputs = np.zeros((count, len(CHANNELS), height, width), dtype=np.float32)
    middles = (np.arange(width, dtype=np.float32) - np.float32((width - 1) / 2)) * _LENGTHS.beside
    _fill(
        np.asarray(cloud, dtype=np.float32), mask, middles, inputs, _LENGTHS, SWEEPS, REFERENCE_PART
    )
    return inputs


@njit(error_model="numpy", nogil=True)
def _fill(
    cloud: Float[np.ndarray, "b h w 3"],
    mask: Bool[np.ndarray, "b h w"],
    middles: Float[np.ndarray, " w"],
    inputs: Float[np.ndarray, "b c h w"],
    lengths: _Lengths,
    sweeps: int,
    reference_part: int,
) -> None:
    """Every channel of every cloud; what is unseen stays zero."""
    _, height, width = mask.shape
    fine = lengths.fine_limit
    # With a border that holds nothing, so that every cell has eight neighbours.
    draped = np.full((height + 2, width + 2), lengths.nothing)
    swept = draped.copy()
    for b in range(len(mask)):
        seen, out = mask[b], inputs[b]
        reference = _reference_height(cloud[b, :, :, 2], seen, reference_part)
        draped[:] = lengths.nothing
        for i in range(height):
            for j in range(width):
                if not seen[i, j]:
                    continue
                x, y, z = cloud[b, i, j, 0], cloud[b, i, j, 1], cloud[b, i, j, 2] - reference
                out[_X, i, j], out[_Y, i, j] = x, y
                out[_X_IN_CELL, i, j] = (x - middles[j]) / lengths.half_cell
                out[_Y_IN_CELL, i, j] = (y - middles[i]) / lengths.half_cell
                out[_Z, i, j] = min(max(z, -lengths.limit), lengths.limit)
                out[_Z_FINE, i, j] = min(max(z, -fine), fine) / fine
                radius = np.sqrt(x * x + y * y)
                out[_RADIUS, i, j] = radius
                out[_SEEN, i, j] = 1.0
                if radius <= lengths.pad_radius:
                    draped[i + 1, j + 1] = z
        for _ in range(sweeps):
            _carry(draped, swept, lengths)
            draped, swept = swept, draped
        for i in range(height):
            for j in range(width):
                if seen[i, j] and out[_RADIUS, i, j] <= lengths.pad_radius:
                    z = cloud[b, i, j, 2] - reference
                    gap = min(draped[i + 1, j + 1] - z, lengths.reach)
                    out[_PAD_GAP, i, j] = gap / fine
                    out[_PAD_CONTACT, i, j] = 1.0 if gap <= lengths.contact_gap else 0.0


@njit(error_model="numpy", nogil=True)
def _carry(
    z: Float[np.ndarray, "h2 w2"], carried: Float[np.ndarray, "h2 w2"], lengths: _Lengths
) -> None:
    """One sweep of ``measured_drape.draped_gap``: what the highest of nine cells holds up."""
    for i in range(1, z.shape[0] - 1):
        for j in range(1, z.shape[1] - 1):
            beside = max(max(z[i, j - 1], z[i, j + 1]), max(z[i - 1, j], z[i + 1, j]))
            corner = max(
                max(z[i - 1, j - 1], z[i - 1, j + 1]), max(z[i + 1, j - 1], z[i + 1, j + 1])
            )
            carried[i, j] = max(z[i, j], max(beside - lengths.beside, corner - lengths.across))


@njit(error_model="numpy", nogil=True)
def _reference_height(
    z: Float[np.ndarray, "h w"], seen: Bool[np.ndarray, "h w"], part: int
) -> np.float32:
    """``canonical.reference_height`` of one cloud."""
    height, width = z.shape
    rows, columns = height // part, width // part
    middle = (slice(rows, height - rows), slice(columns, width - columns))
    found = z[middle].flatten()[seen[middle].flatten()]
    if len(found) == 0:
        found = z.flatten()[seen.flatten()]
    if len(found) == 0:
        return np.float32(0.0)
    found.sort()
    median: np.float32 = found[(len(found) - 1) // 2]
    return median
