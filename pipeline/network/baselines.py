"""Simple baselines that a network has to beat: the mean quality, and a hand-made seal ratio."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import isotonic_regression

from pipeline.network.figures import mean_absolute_error, weighted_error

# Below so many cells a plane is not fitted: the ratio is 0.
_FEWEST_CELLS = 3
PART = 1024  # clouds whose points are held in double precision at once: a split may be mapped


def mean_predictor_mae(
    train_quality: Float[np.ndarray, " m"], test_quality: Float[np.ndarray, " n"]
) -> float:
    """Mean |q̂ − q| of predicting the training samples' mean for every test sample."""
    constant = np.full(test_quality.shape, train_quality.mean(dtype=np.float64))
    return mean_absolute_error(constant, test_quality)


def weighted_mean_predictor_mae(
    train_quality: Float[np.ndarray, " m"],
    train_weight: Float[np.ndarray, " m"],
    test_quality: Float[np.ndarray, " n"],
    test_weight: Float[np.ndarray, " n"],
) -> float | None:
    """Mean |q̂ − q| of predicting the training samples' weighted mean, weighted itself.

    Parameters
    ----------
    train_quality
        q of the training samples, shape (m,).
    train_weight
        Their weights, shape (m,).
    test_quality
        q of the test samples, shape (n,).
    test_weight
        Their weights, shape (n,).

    Returns
    -------
    The error; None where weights are unknown (NaN) or all zero.
    """
    weight = train_weight.astype(np.float64)
    if not weight.sum() > 0:
        return None
    constant = np.full(test_quality.shape, np.average(train_quality, weights=weight))
    return weighted_error(constant, test_quality, test_weight)


def seal_ratio(
    cloud: Float[np.ndarray, "n h w 3"],
    mask: Bool[np.ndarray, "n h w"],
    seal_radius: float,
    tolerance: float,
) -> Float[np.ndarray, " n"]:
    """Share of the cells under Reg.V that are seen and lie near the plane through them.

    A hand-made replacement for the contact share of Eq. (2), from the cloud alone. The plane is
    fitted twice: to all seen cells of Reg.V, then to those within ``tolerance`` of their median
    residual, so that an edge within Reg.V does not tilt it.

    Parameters
    ----------
    cloud
        Points in GCS in units of r_G, shape (n, h, w, 3).
    mask
        Cells that hold a measured point, shape (n, h, w).
    seal_radius
        r_v in units of r_G.
    tolerance
        Distance from the plane that still counts as near, in units of r_G.

    Returns
    -------
    Ratio in [0, 1], shape (n,); 0 where too few cells are seen to fit a plane.
    """
    # Unseen cells count against the seal: take the cells of Reg.V from the grid, whose spacing
    # is that of the seen points.
    cells = _cells_within(cloud, mask, seal_radius)
    parts = _parts(len(mask))
    ratios = [_seal_ratio_of(cloud[p], mask[p], seal_radius, tolerance, cells) for p in parts]
    return np.concatenate([np.zeros(0), *ratios])


def _parts(n: int) -> list[slice]:
    """Neighbouring samples, ``PART`` at a time."""
    return [slice(start, start + PART) for start in range(0, n, PART)]


def _seal_ratio_of(
    cloud: Float[np.ndarray, "n h w 3"],
    mask: Bool[np.ndarray, "n h w"],
    seal_radius: float,
    tolerance: float,
    cells: int,
) -> Float[np.ndarray, " n"]:
    """`seal_ratio` of some clouds, of a grid with so many cells within Reg.V."""
    points = np.where(mask[..., None], cloud, 0).astype(np.float64)
    seen_radius = np.hypot(points[..., 0], points[..., 1])
    inside = mask & (seen_radius <= seal_radius)
    ratios = np.zeros(len(mask))
    for index in range(len(mask)):
        patch = points[index][inside[index]]
        if len(patch) < _FEWEST_CELLS or cells == 0:
            continue
        residual = _plane_residual(patch, patch)
        near = np.abs(residual - np.median(residual)) <= tolerance
        if near.sum() >= _FEWEST_CELLS:
            residual = _plane_residual(patch[near], patch)
            near = np.abs(residual) <= tolerance
        ratios[index] = min(near.sum() / cells, 1.0)
    return ratios


@dataclass(frozen=True)
class MonotoneRegressor:
    """A rising step function from a feature to quality, straight between its knots."""

    feature: Float[np.ndarray, " knots"]
    quality: Float[np.ndarray, " knots"]

    def predict(self, feature: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Quality at each feature; constant beyond the outermost knots."""
        quality: Float[np.ndarray, " n"] = np.interp(feature, self.feature, self.quality)
        return quality

    def without_repeats(self) -> "MonotoneRegressor":
        """The same function without knots inside its flat steps."""
        inside = np.zeros(len(self.quality), dtype=bool)
        same = self.quality[1:] == self.quality[:-1]
        inside[1:-1] = same[:-1] & same[1:]
        return MonotoneRegressor(self.feature[~inside], self.quality[~inside])


def fit_monotone(
    feature: Float[np.ndarray, " n"], quality: Float[np.ndarray, " n"]
) -> MonotoneRegressor:
    """Isotonic regression of quality on one feature, least squares."""
    knots, group = np.unique(feature, return_inverse=True)
    counts = np.bincount(group).astype(np.float64)
    means = np.bincount(group, weights=quality.astype(np.float64)) / counts
    rising = isotonic_regression(means, weights=counts, increasing=True)
    return MonotoneRegressor(feature=knots, quality=np.asarray(rising.x))


def _cells_within(
    cloud: Float[np.ndarray, "n h w 3"], mask: Bool[np.ndarray, "n h w"], radius: float
) -> int:
    """Cells of the grid whose centre lies within ``radius`` of the axis."""
    h, w = mask.shape[1:]
    x_by_column = _spacing(cloud[..., 0], mask, axis=2)
    y_by_row = _spacing(cloud[..., 1], mask, axis=1)
    x = x_by_column * (np.arange(w) - (w - 1) / 2)
    y = y_by_row * (np.arange(h) - (h - 1) / 2)
    return int((np.hypot(x[None, :], y[:, None]) <= radius).sum())


def _spacing(
    coordinate: Float[np.ndarray, "n h w"], mask: Bool[np.ndarray, "n h w"], axis: int
) -> float:
    """Step of a coordinate from cell to cell: least squares through the grid's middle."""
    size = mask.shape[axis]
    steps = np.arange(size) - (size - 1) / 2
    shape = (1, size, 1) if axis == 1 else (1, 1, size)
    along = squares = 0.0
    for part in _parts(len(mask)):
        step = np.broadcast_to(steps.reshape(shape), mask[part].shape)[mask[part]]
        along += float(step @ coordinate[part][mask[part]].astype(np.float64))
        squares += float(step @ step)
    return along / max(squares, 1.0)


def _plane_residual(
    fitted: Float[np.ndarray, "m 3"], points: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, " n"]:
    """Height of ``points`` over the least-squares plane z = a x + b y + c of ``fitted``."""
    design = np.column_stack((fitted[:, :2], np.ones(len(fitted))))
    plane = np.linalg.lstsq(design, fitted[:, 2], rcond=None)[0]
    residual: Float[np.ndarray, " n"] = points[:, 2] - points[:, :2] @ plane[:2] - plane[2]
    return residual
