"""The analytic label on the measured cloud: the baseline that a network has to beat.

The pad is draped on the cells that a camera measured, as Algorithm 1 drapes it on the true surface,
and the label is computed from there. Noise of the camera keeps the pad off the surface. Therefore
cells are smoothed, a vertex may be farther from its cell and still count as touching, and a rising
function maps the result to true labels. All three are chosen on training samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage

from pipeline.config.grasps import GripperConfig
from pipeline.gripper import label_batch, pad_of
from pipeline.network.baselines import MonotoneRegressor, fit_monotone
from pipeline.network.figures import mean_absolute_error

# What the choice is made among: contact tolerances in units of r_G (0 to 8 mm at 25 mm; 0.004 is
# the label's own), and standard deviations of the smoothing in cells. On scans the best is none and
# 0.9; on the embedded solids, which are smoother, wide ones do as well.
TOLERANCES = (0.0, 0.004, 0.01, 0.03, 0.08, 0.16, 0.32)
SMOOTHINGS = (0.0, 0.5, 0.7, 0.9, 1.1, 1.4)
PART = 2048  # clouds at a time: bounds the memory of their heights


@dataclass(frozen=True)
class AnalyticBaseline:
    """The label on a measured cloud, with the same `predict` as a network.

    Attributes
    ----------
    gripper
        Pad and physics; the contact tolerance is replaced by ``tolerance``.
    tolerance
        Largest distance from its cell at which a vertex still touches, in units of r_G.
    smoothing
        Standard deviation of the Gaussian over measured cells, in cells.
    scale
        From the label on the cloud to q.
    """

    gripper: GripperConfig
    tolerance: float
    smoothing: float
    scale: MonotoneRegressor

    def predict(
        self, cloud: Float[np.ndarray, "n g g 3"], mask: Bool[np.ndarray, "n g g"]
    ) -> Float[np.ndarray, " n"]:
        """Quality in [0, 1] of clouds.

        Parameters
        ----------
        cloud
            Points in GCS in units of r_G, shape (n, g, g, 3).
        mask
            Cells that hold a measured point, shape (n, g, g).

        Returns
        -------
        q-hat, shape (n,).
        """
        raw = measured_quality(cloud, mask, self.gripper, self.tolerance, self.smoothing)
        return self.scale.predict(raw)


def fit_analytic(
    cloud: Float[np.ndarray, "n g g 3"],
    mask: Bool[np.ndarray, "n g g"],
    quality: Float[np.ndarray, " n"],
    gripper: GripperConfig,
    tolerances: Sequence[float] = TOLERANCES,
    smoothings: Sequence[float] = SMOOTHINGS,
) -> AnalyticBaseline:
    """Choose tolerance, smoothing and scale by the error on training samples.

    Parameters
    ----------
    cloud
        Points in GCS in units of r_G, shape (n, g, g, 3).
    mask
        Cells that hold a measured point, shape (n, g, g).
    quality
        True q of each sample, shape (n,).
    gripper
        Pad and physics of the labels.
    tolerances
        Contact tolerances to choose among, in units of r_G.
    smoothings
        Standard deviations to choose among, in cells.

    Returns
    -------
    The baseline of the lowest mean |q̂ − q|.
    """
    best: tuple[float, AnalyticBaseline] | None = None
    for tolerance, smoothing in product(tolerances, smoothings):
        raw = measured_quality(cloud, mask, gripper, tolerance, smoothing)
        scale = fit_monotone(raw, quality)
        error = mean_absolute_error(scale.predict(raw), quality)
        if best is None or error < best[0]:
            best = error, AnalyticBaseline(gripper, tolerance, smoothing, scale)
    if best is None:
        raise ValueError("no tolerance or smoothing to choose among")
    return best[1]


def measured_quality(
    cloud: Float[np.ndarray, "n g g 3"],
    mask: Bool[np.ndarray, "n g g"],
    gripper: GripperConfig,
    tolerance: float,
    smoothing: float,
) -> Float[np.ndarray, " n"]:
    """q of S-1.12 with the pad draped on measured cells instead of the true surface.

    A cloud does not show which object a cell belongs to: every measured cell counts as the
    target's.

    Parameters
    ----------
    cloud
        Points in GCS in units of r_G, shape (n, g, g, 3).
    mask
        Cells that hold a measured point, shape (n, g, g).
    gripper
        Pad and physics.
    tolerance
        Largest distance from its cell at which a vertex still touches, in units of r_G.
    smoothing
        Standard deviation of the Gaussian over measured cells, in cells.

    Returns
    -------
    q, shape (n,).
    """
    radius_m = gripper.pad.radius_m
    config = gripper.model_copy(
        update={"pad": gripper.pad.model_copy(update={"contact_tolerance_rg": tolerance})}
    )
    pad = pad_of(config.pad)
    at = pad.vertices_xy_m / radius_m
    quality = np.empty(len(cloud))
    for start in range(0, len(cloud), PART):
        rows = slice(start, start + PART)
        heights = vertex_heights(cloud[rows], mask[rows], at, smoothing) * radius_m
        labels = label_batch(pad, config, heights, np.isfinite(heights))
        quality[rows] = labels.q
    return quality


def vertex_heights(
    cloud: Float[np.ndarray, "n g g 3"],
    mask: Bool[np.ndarray, "n g g"],
    at: Float[np.ndarray, "vertices 2"],
    smoothing: float,
) -> Float[np.ndarray, "n vertices"]:
    """Height of the measured surface at places of the grid, NaN where nothing was measured.

    Heights are interpolated between the four cells around a place; unmeasured cells are left out.

    Parameters
    ----------
    cloud
        Points in units of r_G, shape (n, g, g, 3); y grows with the row, x with the column.
    mask
        Cells that hold a measured point, shape (n, g, g).
    at
        Places in the grid's plane, in units of r_G, shape (vertices, 2).
    smoothing
        Standard deviation of the Gaussian over measured cells, in cells; 0: none.

    Returns
    -------
    Heights in units of r_G, shape (n, vertices).
    """
    weight = mask.astype(np.float64)
    height = np.where(mask, cloud[..., 2], 0.0).astype(np.float64)
    if smoothing > 0:
        sigma = (0.0, smoothing, smoothing)
        spread = ndimage.gaussian_filter(weight, sigma, mode="constant")
        total = ndimage.gaussian_filter(height, sigma, mode="constant")
        height = np.where(mask, total / np.maximum(spread, 1e-12), 0.0)
    cells = mask.shape[1]
    side = _cell_side(cloud, mask)
    position = at / side + (cells - 1) / 2
    low = np.floor(position).astype(np.int64)
    part = position - low
    sums = np.zeros((len(cloud), len(at)))
    weights = np.zeros_like(sums)
    for right, down in product((0, 1), (0, 1)):
        column, row = low[:, 0] + right, low[:, 1] + down
        within = (column >= 0) & (column < cells) & (row >= 0) & (row < cells)
        share = np.where(right, part[:, 0], 1 - part[:, 0]) * np.where(
            down, part[:, 1], 1 - part[:, 1]
        )
        column, row = np.clip(column, 0, cells - 1), np.clip(row, 0, cells - 1)
        counted = weight[:, row, column] * np.where(within, share, 0.0)
        sums += counted * height[:, row, column]
        weights += counted
    # Where less than half of what is around a place was measured, nothing is known of it.
    return np.where(weights >= 0.5, sums / np.maximum(weights, 1e-12), np.nan)


def _cell_side(cloud: Float[np.ndarray, "n g g 3"], mask: Bool[np.ndarray, "n g g"]) -> float:
    """Side of a cell in units of r_G, read off the points: x grows by it from column to column."""
    steps = np.arange(mask.shape[2]) - (mask.shape[2] - 1) / 2
    step = np.broadcast_to(steps, mask.shape)[mask]
    x = cloud[..., 0][mask].astype(np.float64)
    return float(step @ x / max(float(step @ step), 1e-12)) or 1.0
