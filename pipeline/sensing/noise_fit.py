"""A depth sensor's noise model fitted to its pictures, with nothing else known of the scenes.

Spread: in blocks of pixels that show a plane, 1/z is linear in column and row, and what is left of
a linear fit is noise. Grain: how alike the residues of neighbours are. Shadow and lost edges: how
many pixels are missing where depth jumps, along rows and along columns (the other lens stands
beside the camera, so columns show no shadow). A block on a curved surface has a residue of its own;
medians over blocks bear some of those, so a spread is rather too large than too small.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import nnls

BLOCK_PX = 11  # a side: some grains wide, and 1 to 3 cm on what lies at 0.4 to 0.9 m
FEWEST_BLOCKS = 10  # in a bin of distance and angle, for its median
LONGEST_GAP_PX = 80  # wider gaps are not of an edge
EDGE_M = 0.02  # a block of greater range off a plane shows more than one surface
JUMP_M = 0.05  # a jump in depth that is an edge: neither noise nor a slanted table has such
DISTANCES_M = np.arange(0.2, 3.01, 0.1)  # within a bin the spread hardly changes with distance
ANGLES_RAD = np.radians(np.arange(0.0, 86.0, 10.0))  # and little with the angle of incidence
GRAINS_PX = np.arange(0.0, 6.01, 0.1)  # that are compared
STEEPNESSES = np.arange(0.0, 3.01, 0.1)  # that are compared
LEAST_PARALLAX_PX = 5.0  # a shadow must be so wide to tell a baseline


@dataclass(frozen=True, eq=False)
class PlaneResidues:
    """What planes leave in blocks of pixels; arrays of one length n, a block each.

    Attributes
    ----------
    depth_m
        Depth in the middle of each block [m].
    incidence_rad
        Angle between its ray and its plane's normal [rad].
    variance_m2
        Mean square residue over the pixels [m^2].
    neighbour_m2
        Mean product of the residues of horizontal and vertical neighbours [m^2].
    """

    depth_m: Float[np.ndarray, " n"]
    incidence_rad: Float[np.ndarray, " n"]
    variance_m2: Float[np.ndarray, " n"]
    neighbour_m2: Float[np.ndarray, " n"]


@dataclass(frozen=True, eq=False)
class EdgeGaps:
    """Jumps in depth and how many pixels between them are missing; arrays of one length n.

    Attributes
    ----------
    missing_px
        Pixels without a measurement between the two sides.
    parallax
        Of each, |1/z - 1/z'| between its sides, with its sign: above 0 where the nearer side has
        the higher column or row [1/m].
    """

    missing_px: Int[np.ndarray, " n"]
    parallax: Float[np.ndarray, " n"]


@dataclass(frozen=True, eq=False)
class SensorFit:
    """A fitted model, with what it was fitted to.

    Attributes
    ----------
    floor_m
        Constant part of sigma [m].
    linear
        Factor of z.
    quadratic_1_m
        Factor of (z - 0.4)^2 [1/m].
    steepness
        Power of the cosine of incidence by which sigma grows.
    grain_px
        Blur of independent errors [px].
    step_m
        Unit of depth [m].
    baseline_m
        Where the other lens stands to the right of the camera [m].
    edge_loss
        Share of edge pixels that measure nothing, shadow apart.
    steepest_rad
        99th percentile of the angles of incidence that were measured [rad].
    bins
        Depth [m], incidence [rad], sigma without rounding [m] and blocks of each bin, shape (n, 4).
    """

    floor_m: float
    linear: float
    quadratic_1_m: float
    steepness: float
    grain_px: float
    step_m: float
    baseline_m: float
    edge_loss: float
    steepest_rad: float
    bins: Float[np.ndarray, "n 4"]


def plane_residues(
    depth_m: Float[np.ndarray, "h w"], intrinsics: Float[np.ndarray, "3 3"]
) -> PlaneResidues:
    """Fit a plane to each block of pixels that is wholly measured.

    Parameters
    ----------
    depth_m
        A picture, 0 where nothing was measured [m].
    intrinsics
        Its camera matrix, pixel centres at +0.5, shape (3, 3) [px].

    Returns
    -------
    Residues by block. Blocks across an edge are left out: their range exceeds `EDGE_M` off a plane.
    """
    side = BLOCK_PX
    down, along = depth_m.shape[0] // side, depth_m.shape[1] // side

    def blocks(picture: np.ndarray) -> np.ndarray:
        cut = picture[: down * side, : along * side].reshape(down, side, along, side)
        return np.asarray(cut.swapaxes(1, 2).reshape(-1, side * side))

    rows, columns = np.indices(depth_m.shape)
    z = blocks(depth_m)
    whole = (z > 0).all(axis=1)
    z = z[whole]
    x = blocks((columns + 0.5 - intrinsics[0, 2]) / intrinsics[0, 0])[whole]
    y = blocks((rows + 0.5 - intrinsics[1, 2]) / intrinsics[1, 1])[whole]
    middle_x, middle_y = x.mean(axis=1, keepdims=True), y.mean(axis=1, keepdims=True)
    inverse = 1.0 / z
    mean = inverse.mean(axis=1, keepdims=True)
    over_x = _slope(inverse, x - middle_x)
    over_y = _slope(inverse, y - middle_y)
    left = inverse - mean - over_x * (x - middle_x) - over_y * (y - middle_y)
    residue = -left / mean**2
    normal = np.hstack([over_x, over_y, mean - over_x * middle_x - over_y * middle_y])
    ray = np.hstack([middle_x, middle_y, np.ones_like(middle_x)])
    cosine = (normal * ray).sum(axis=1) / (
        np.linalg.norm(normal, axis=1) * np.linalg.norm(ray, axis=1)
    )
    square = residue.reshape(-1, side, side)
    across = (square[:, :, 1:] * square[:, :, :-1]).mean(axis=(1, 2))
    downwards = (square[:, 1:] * square[:, :-1]).mean(axis=(1, 2))
    flat = np.ptp(residue, axis=1) < EDGE_M
    return PlaneResidues(
        depth_m=1.0 / mean[flat, 0],
        incidence_rad=np.arccos(np.clip(cosine[flat], 0.0, 1.0)),
        variance_m2=(residue**2).mean(axis=1)[flat],
        neighbour_m2=(across + downwards)[flat] / 2,
    )


def edge_gaps(depth_m: Float[np.ndarray, "h w"]) -> EdgeGaps:
    """Jumps in depth along the rows of a picture, and the pixels that are missing in them.

    Parameters
    ----------
    depth_m
        A picture, 0 where nothing was measured; its transpose gives the jumps along columns [m].

    Returns
    -------
    The jumps of more than `JUMP_M` with at most `LONGEST_GAP_PX` missing.
    """
    row, column = np.nonzero(depth_m > 0)
    missing = np.diff(column) - 1
    before, after = depth_m[row[:-1], column[:-1]], depth_m[row[1:], column[1:]]
    chosen = (row[1:] == row[:-1]) & (missing <= LONGEST_GAP_PX) & (np.abs(before - after) > JUMP_M)
    return EdgeGaps(missing[chosen], (1.0 / after - 1.0 / before)[chosen])


def fit_sensor(
    pictures: Sequence[tuple[Float[np.ndarray, "_ _"], Float[np.ndarray, "3 3"]]],
) -> SensorFit:
    """Fit a noise model to pictures of one camera.

    Parameters
    ----------
    pictures
        Depth [m], 0 where nothing was measured, and camera matrix of each.

    Returns
    -------
    The model and what it was fitted to.
    """
    step_m = unit_of([depth for depth, _ in pictures])
    found = [plane_residues(depth, intrinsics) for depth, intrinsics in pictures]
    depth = np.concatenate([one.depth_m for one in found])
    incidence = np.concatenate([one.incidence_rad for one in found])
    # Rounding adds a twelfth of its step's square; between neighbours it is independent.
    rounding = step_m**2 / 12.0
    variance = np.concatenate([one.variance_m2 for one in found])
    neighbour = np.concatenate([one.neighbour_m2 for one in found])
    bins = _bins(depth, incidence, variance, neighbour, rounding)
    told = bins[:, 2] > 0
    alike = (
        float(np.average(bins[told, 3] / bins[told, 2], weights=bins[told, 4]))
        if told.any()
        else 0.0
    )
    grain = float(GRAINS_PX[np.argmin([abs(_left_by_plane(g)[1] - alike) for g in GRAINS_PX])])
    sigma = np.sqrt(bins[:, 2] / _left_by_plane(grain)[0])
    floor, linear, quadratic, steepness = _spread(bins[:, 0], bins[:, 1], sigma, bins[:, 4])
    focal = float(np.median([intrinsics[0, 0] for _, intrinsics in pictures]))
    baseline, loss = _edges([one for one, _ in pictures], focal)
    return SensorFit(
        floor_m=floor,
        linear=linear,
        quadratic_1_m=quadratic,
        steepness=steepness,
        grain_px=grain,
        step_m=step_m,
        baseline_m=baseline,
        edge_loss=loss,
        steepest_rad=float(np.percentile(incidence, 99)),
        bins=np.column_stack([bins[:, :2], sigma, bins[:, 4]]),
    )


def unit_of(depths_m: Sequence[Float[np.ndarray, "_ _"]]) -> float:
    """Unit of depth: the least difference between values that occur [m]."""
    least = [np.diff(np.unique(np.round(depth[depth > 0], 6))) for depth in depths_m]
    return float(np.round(min(float(step.min()) for step in least if len(step)), 6))


def _slope(
    value: Float[np.ndarray, "n k"], from_middle: Float[np.ndarray, "n k"]
) -> Float[np.ndarray, "n 1"]:
    """Slope of values over places, by block; rows and columns of a block are orthogonal."""
    product = (value * from_middle).sum(axis=1, keepdims=True)
    return np.asarray(product / (from_middle**2).sum(axis=1, keepdims=True))


def _left_by_plane(grain_px: float) -> tuple[float, float]:
    """Of unit noise with a grain, what a fitted plane leaves in a block.

    Parameters
    ----------
    grain_px
        Blur of independent errors [px].

    Returns
    -------
    Mean square that is left, and the mean product of neighbours over it.
    """
    rows, columns = np.indices((BLOCK_PX, BLOCK_PX)).reshape(2, -1).astype(np.float64)
    plane = np.column_stack([np.ones_like(rows), rows, columns])
    basis = np.linalg.qr(plane)[0]
    square = (rows[:, None] - rows) ** 2 + (columns[:, None] - columns) ** 2
    alike = (
        np.exp(-square / (4.0 * grain_px**2)) if grain_px > 0 else (square == 0).astype(np.float64)
    )
    left = alike - basis @ (basis.T @ alike)
    left = left - (left @ basis) @ basis.T
    mean = float(np.trace(left)) / len(rows)
    return mean, float(left[square == 1.0].mean()) / mean


def _bins(
    depth_m: Float[np.ndarray, " n"],
    incidence_rad: Float[np.ndarray, " n"],
    variance_m2: Float[np.ndarray, " n"],
    neighbour_m2: Float[np.ndarray, " n"],
    rounding_m2: float,
) -> Float[np.ndarray, "bins 5"]:
    """Medians by distance and angle: depth, incidence, variance, neighbours' product, blocks."""
    key = np.digitize(depth_m, DISTANCES_M) * 100 + np.digitize(incidence_rad, ANGLES_RAD)
    rows = []
    for one in np.unique(key):
        own = key == one
        if own.sum() < FEWEST_BLOCKS:
            continue
        variance = max(float(np.median(variance_m2[own])) - rounding_m2, 0.0)
        rows.append(
            (
                float(np.median(depth_m[own])),
                float(np.median(incidence_rad[own])),
                variance,
                float(np.clip(np.median(neighbour_m2[own]), 0.0, variance)),
                float(own.sum()),
            )
        )
    return np.array(rows).reshape(-1, 5)


def _spread(
    depth_m: Float[np.ndarray, " n"],
    incidence_rad: Float[np.ndarray, " n"],
    sigma_m: Float[np.ndarray, " n"],
    blocks: Float[np.ndarray, " n"],
) -> tuple[float, float, float, float]:
    """Floor, linear, quadratic and steepness, none negative, by relative least squares."""
    terms = np.column_stack([np.ones_like(depth_m), depth_m, (depth_m - 0.4) ** 2])
    # A bin with four times the blocks counts double: neighbouring blocks err alike.
    weight = blocks**0.25 / np.maximum(sigma_m, 1e-5)
    best = (np.inf, np.zeros(3), 0.0)
    for steepness in STEEPNESSES:
        rows = terms / np.cos(incidence_rad)[:, None] ** steepness
        found, rest = nnls(rows * weight[:, None], sigma_m * weight)
        if rest < best[0]:
            best = (rest, found, float(steepness))
    floor, linear, quadratic = (float(value) for value in best[1])
    return floor, linear, quadratic, best[2]


def _edges(depths_m: Sequence[Float[np.ndarray, "_ _"]], focal_px: float) -> tuple[float, float]:
    """Baseline [m] and share of lost edge pixels."""
    rows = [edge_gaps(depth) for depth in depths_m]
    columns = [edge_gaps(depth.T) for depth in depths_m]
    missing = np.concatenate([one.missing_px for one in rows])
    parallax = np.concatenate([one.parallax for one in rows]) * focal_px
    other = np.concatenate([one.missing_px for one in columns])
    lost = float(np.median(other)) if len(other) else 0.0
    widths = []
    for side in (1.0, -1.0):
        own = side * parallax > 0
        ratio = (missing[own] - lost) / np.abs(parallax[own])
        wide = ratio * np.abs(parallax[own]) >= LEAST_PARALLAX_PX
        enough = wide.mean() > 0.5 if own.any() else False
        widths.append(float(np.median(ratio[wide])) if enough else 0.0)
    # Wide gaps on both sides of things are no shadow of one lens.
    baseline = widths[0] - widths[1] if min(widths) == 0.0 else 0.0
    # Each jump has an edge pixel on either side.
    return baseline, float(np.clip(np.mean(np.minimum(other, 2)) / 2.0, 0.0, 1.0))
