"""How far a contact lies from an edge of what was measured around it.

An edge is a depth edge or a crease of the organised cloud, smoothed a little against noise. A depth
edge lies where measured cells end, single lost cells excepted, and where the height changes by more
than a cell's side over two cells. A crease lies where the slope changes within a pad's reach.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage

from pipeline.config.grasps import CELL_SIDE

# A crease: the surface bends by this much from three cells before to three cells behind a place.
CREASE_RAD = np.deg2rad(30.0)
_REACH = 3  # cells: over less, noise of a millimetre bends a plane as much
# Standard deviation in cells of a smoothing that leaves such bends and takes most of the noise, and
# how many cells it spreads a jump over.
_SMOOTHING = 0.9
_SPREAD = 2


def edge_distance(
    cloud: Float[np.ndarray, "n g g 3"], mask: Bool[np.ndarray, "n g g"]
) -> Float[np.ndarray, " n"]:
    """Distance from the middle of each cloud to the nearest edge in it.

    Parameters
    ----------
    cloud
        Points in GCS in units of r_G, shape (n, g, g, 3); cells are 0.1 r_G apart.
    mask
        Cells that hold a measured point, shape (n, g, g).

    Returns
    -------
    Distance in the pad's plane in units of r_G, shape (n,); inf where there is no edge.
    """
    height = _smoothed(np.where(mask, cloud[..., 2], 0.0).astype(np.float64), mask)
    whole = _without_single_holes(mask)
    edge = np.zeros(mask.shape, dtype=bool)
    for axis in (1, 2):
        jump = np.zeros(mask.shape, dtype=bool)
        ends = _window(whole, axis, 0, 1) != _window(whole, axis, 1, 1)
        for shift in (0, 1):
            _mark(jump, ends, axis, shift)
        change = np.abs(_window(height, axis, 2, 2) - _window(height, axis, 0, 2))
        _mark(jump, _all_seen(whole, axis, 2) & (change > CELL_SIDE), axis, 1)
        crease = np.zeros(mask.shape, dtype=bool)
        _mark(crease, _crease(height, whole, axis), axis, _REACH)
        # A jump bends what is measured across it: that is the same edge, not another.
        near = ndimage.maximum_filter1d(jump, 2 * (_REACH + _SPREAD) + 1, axis)
        edge |= whole & (jump | (crease & ~near))
    side = (np.arange(mask.shape[1]) - (mask.shape[1] - 1) / 2) * CELL_SIDE
    away = np.hypot(side[:, None], side[None])
    return np.asarray(np.where(edge, away, np.inf).min(axis=(1, 2)))


def _smoothed(
    height: Float[np.ndarray, "n g g"], mask: Bool[np.ndarray, "n g g"]
) -> Float[np.ndarray, "n g g"]:
    """Heights smoothed over measured cells."""
    sigma = (0.0, _SMOOTHING, _SMOOTHING)
    total = ndimage.gaussian_filter(height, sigma, mode="constant")
    weight = ndimage.gaussian_filter(mask.astype(np.float64), sigma, mode="constant")
    return np.asarray(total / np.maximum(weight, 1e-12))


def _crease(
    height: Float[np.ndarray, "n g g"], mask: Bool[np.ndarray, "n g g"], axis: int
) -> Bool[np.ndarray, "n _ _"]:
    """Where the slopes before and behind a cell differ by more than `CREASE_RAD`."""
    run = _REACH * CELL_SIDE
    before, here, behind = (
        _window(height, axis, shift, 2 * _REACH) for shift in (0, _REACH, 2 * _REACH)
    )
    bend = np.arctan((behind - here) / run) - np.arctan((here - before) / run)
    return np.asarray(_all_seen(mask, axis, 2 * _REACH) & (np.abs(bend) > CREASE_RAD))


def _without_single_holes(mask: Bool[np.ndarray, "n g g"]) -> Bool[np.ndarray, "n g g"]:
    """Measured cells, and lost ones that have measured cells on both sides."""
    block = np.ones((1, 3, 3), dtype=bool)
    wide = ndimage.binary_dilation(mask, block)
    return np.asarray(ndimage.binary_erosion(wide, block, border_value=1))


def _all_seen(mask: Bool[np.ndarray, "n g g"], axis: int, room: int) -> Bool[np.ndarray, "n _ _"]:
    """Where a cell and the ``room`` cells behind it along an axis were measured."""
    windows = [_window(mask, axis, shift, room) for shift in range(room + 1)]
    return np.asarray(np.logical_and.reduce(windows))


def _window(array: np.ndarray, axis: int, shift: int, room: int) -> np.ndarray:
    """The part of an array that begins at ``shift`` and is ``room`` shorter along an axis."""
    return np.asarray(np.take(array, np.arange(shift, array.shape[axis] - room + shift), axis))


def _mark(
    edge: Bool[np.ndarray, "n g g"],
    found: Bool[np.ndarray, "n _ _"],
    axis: int,
    shift: int,
) -> None:
    """Set the cells of ``edge`` that lie so far behind the places of ``found``."""
    part = [slice(None)] * edge.ndim
    part[axis] = slice(shift, shift + found.shape[axis])
    edge[tuple(part)] |= found
