"""Planes in measured points, the largest first, by RANSAC.

A depth camera errs in proportion to the distance or its square, so a point's distance from a plane
is taken as a share of its distance from the camera: one tolerance serves near and far.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.linear_model import RANSACRegressor

FITTED_POINTS = 6000  # of all points, at random: enough for planes that matter, and fast
TRIALS = 1000  # finds a plane of a seventh of what is left in 19 of 20 cases
FEWEST_INLIERS = 60  # fewer lie on a plane by chance


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane normal · x = offset_m; its normal points to the side of the camera.

    Attributes
    ----------
    normal
        Unit vector, shape (3,).
    offset_m
        Distance of the plane from the origin along the normal [m].
    share
        Of all measured points, how many lie on it.
    """

    normal: Float[np.ndarray, " 3"]
    offset_m: float
    share: float

    def height_m(self, points_m: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """Signed distance of points from the plane, positive on the camera's side [m]."""
        return np.asarray(points_m @ self.normal - self.offset_m)


class _PlaneModel(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Total least squares through (n, 4) rows: points and their distance from the camera."""

    def fit(self, rows: Float[np.ndarray, "n 4"], _: Any = None) -> "_PlaneModel":
        """Fit to rows, each point weighted by how exactly it is measured."""
        weight = 1.0 / rows[:, 3]
        middle = np.average(rows[:, :3], axis=0, weights=weight)
        # The normal is the direction in which the points spread least.
        spread = (rows[:, :3] - middle) * weight[:, None]
        self.normal_ = np.linalg.eigh(spread.T @ spread)[1][:, 0]
        self.offset_ = float(self.normal_ @ middle)
        return self

    def predict(self, rows: Float[np.ndarray, "n 4"]) -> Float[np.ndarray, " n"]:
        """Distance from the plane as a share of the distance from the camera."""
        return np.asarray((rows[:, :3] @ self.normal_ - self.offset_) / rows[:, 3])

    def score(self, rows: Float[np.ndarray, "n 4"], _: Any = None) -> float:
        """How well rows fit: minus their mean square distance."""
        return -float(np.mean(self.predict(rows) ** 2))


def planes_of(
    points_m: Float[np.ndarray, "n 3"],
    eyes_m: Float[np.ndarray, "n 3"],
    tolerance: float,
    smallest_share: float,
    rng: np.random.Generator,
) -> Iterator[Plane]:
    """Planes that hold at least a share of the points, the largest first.

    Parameters
    ----------
    points_m
        Measured points, in any frame.
    eyes_m
        Where the camera stood that measured each.
    tolerance
        How far from a plane a point of it may lie, as a share of its distance from the camera.
    smallest_share
        Least share of all points that a plane must hold.
    rng
        Draws the points that are fitted.
    """
    chosen = rng.permutation(len(points_m))[:FITTED_POINTS]
    distance_m = np.linalg.norm(points_m - eyes_m, axis=1)
    rows = np.column_stack([points_m, distance_m])[chosen]
    eyes = eyes_m[chosen]
    left = np.ones(len(rows), dtype=bool)
    least = max(FEWEST_INLIERS, int(smallest_share * len(rows)))
    while left.sum() >= least:
        plane = _largest(rows[left], eyes[left], tolerance, len(rows), rng)
        if plane is None or plane.share * len(rows) < least:
            return
        yield plane
        left &= ~_near(plane, rows, 2.0 * tolerance)


def _largest(
    rows: Float[np.ndarray, "n 4"],
    eyes_m: Float[np.ndarray, "n 3"],
    tolerance: float,
    total: int,
    rng: np.random.Generator,
) -> Plane | None:
    ransac = RANSACRegressor(
        _PlaneModel(),
        min_samples=3,
        residual_threshold=tolerance,
        max_trials=TRIALS,
        random_state=int(rng.integers(2**31)),
    )
    try:
        ransac.fit(rows, np.zeros(len(rows)))
    except ValueError:  # no three points had a consensus
        return None
    model = ransac.estimator_
    normal, offset = model.normal_, model.offset_
    inliers = ransac.inlier_mask_
    if float(np.median(eyes_m[inliers] @ normal)) < offset:
        normal, offset = -normal, -offset
    return Plane(normal, offset, float(inliers.sum()) / total)


def _near(plane: Plane, rows: Float[np.ndarray, "n 4"], tolerance: float) -> Bool[np.ndarray, " n"]:
    return np.asarray(np.abs(plane.height_m(rows[:, :3])) <= tolerance * rows[:, 3])
