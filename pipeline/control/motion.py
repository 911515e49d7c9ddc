"""Velocity of the object aimed at, from the shift of its heights between pictures.

Heights above the table, on a grid of the world, are compared with those of an earlier picture
where both pictures show the place. The shift with the least mean squared difference, divided by
the time between the two, is the velocity. Objects move on the table, so the shift is horizontal.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Integer
from scipy.ndimage import maximum_filter
from scipy.signal import correlate

from pipeline.config.policy import MotionConfig


class Motion:
    """Velocity of the object around the aim; pictures are one or more control periods apart."""

    def __init__(self, period_s: float, seen_m: float, config: MotionConfig) -> None:
        """Start without any picture.

        Parameters
        ----------
        period_s
            Time between two control steps [s].
        seen_m
            Horizontal distance from the aim within which a picture shows everything [m].
        config
            Cells and thresholds.
        """
        self._period_s = period_s
        self._config = config
        self._cell_m = config.cell_m
        self._seen_cells = int(seen_m / config.cell_m)
        self._before: HeightMap | None = None
        self._middle_m = np.zeros(2)
        self._periods = 0
        self.velocity_m_s = np.zeros(3)

    def count_period(self) -> None:
        """Count one control period."""
        self._periods += 1

    def see(self, points_m: Float[np.ndarray, "n 3"], aim_m: Float[np.ndarray, " 3"]) -> None:
        """Update the velocity from the points, in WCS [m], of a picture taken around the aim."""
        if len(points_m) == 0:
            return
        if self._before is None or self._periods == 0:
            self._begin(points_m, aim_m)
            return
        after = self._map(points_m, aim_m, self._seen_cells + self._config.reach_cells)
        shift_m = self._cell_m * shift_between(self._before, after, self._config)
        size = float(np.linalg.norm(shift_m))
        time_s = self._periods * self._period_s
        self.velocity_m_s[:2] = shift_m / time_s if size > self._config.still_m else 0.0
        if size > self._config.refresh_cells * self._cell_m:
            self._begin(points_m, aim_m)

    def _begin(self, points_m: Float[np.ndarray, "n 3"], aim_m: Float[np.ndarray, " 3"]) -> None:
        self._middle_m, self._periods = aim_m[:2].copy(), 0
        self._before = self._map(points_m, aim_m, self._seen_cells)

    def _map(
        self, points_m: Float[np.ndarray, "n 3"], aim_m: Float[np.ndarray, " 3"], half_cells: int
    ) -> "HeightMap":
        aside = (aim_m[:2] - self._middle_m) / self._cell_m
        return height_map(
            (points_m - [*self._middle_m, 0.0]) / [self._cell_m, self._cell_m, 1.0],
            aside,
            self._seen_cells,
            half_cells,
        )


@dataclass(frozen=True, eq=False)
class HeightMap:
    """Heights on the cells of a square.

    Attributes
    ----------
    height_m
        Greatest height in each cell [m], shape (n, n); 0 where nothing stands.
    seen
        1 in cells that a picture covers, else 0, shape (n, n).
    """

    height_m: Float[np.ndarray, "n n"]
    seen: Float[np.ndarray, "n n"]


def height_map(
    points: Float[np.ndarray, "n 3"],
    looked_at: Float[np.ndarray, " 2"],
    radius_cells: int,
    half_cells: int,
) -> HeightMap:
    """Greatest height in each cell and its neighbours, within the disc that the picture covers.

    Parameters
    ----------
    points
        x, y in cells from the middle of the square, z in metres, shape (n, 3).
    looked_at
        Centre of the disc in cells from the middle of the square, shape (2,).
    radius_cells
        Radius of the disc in cells.
    half_cells
        Cells on each side of the middle one.

    Returns
    -------
    The map, of 2 ``half_cells`` + 1 cells a side.
    """
    heights = np.zeros((2 * half_cells + 1,) * 2)
    cell = np.round(points[:, :2]).astype(np.int64) + half_cells
    inside = (cell >= 0).all(axis=1) & (cell < len(heights)).all(axis=1)
    np.maximum.at(heights, tuple(cell[inside].T), points[inside, 2])
    heights = maximum_filter(heights, size=3)  # points are sparser than cells
    at = np.arange(-half_cells, half_cells + 1)
    aside = np.hypot(at[:, None] - looked_at[0], at[None, :] - looked_at[1])
    seen = (aside <= radius_cells).astype(np.float64)
    return HeightMap(heights * seen, seen)


def shift_between(
    before: HeightMap, after: HeightMap, config: MotionConfig
) -> Float[np.ndarray, " 2"]:
    """Shift of the heights from one map to the next, in cells.

    Parameters
    ----------
    before
        The earlier map.
    after
        The same place in a larger square; half the difference in size bounds the shift.
    config
        Least overlap of the two maps, and how much a shift must explain.

    Returns
    -------
    Shift along x and y in cells, with fraction, shape (2,); 0 where no shift fits clearly better.
    """

    def correlated(a: Float[np.ndarray, "m m"], b: Float[np.ndarray, "n n"]) -> np.ndarray:
        return np.asarray(correlate(a, b, mode="valid", method="fft"))

    both = correlated(after.seen, before.seen)
    squares = (
        correlated(after.seen, before.height_m**2)
        - 2.0 * correlated(after.height_m, before.height_m)
        + correlated(after.height_m**2, before.seen)
    )
    enough = both >= config.overlap_min * before.seen.sum()
    misfit = np.where(enough, squares / np.maximum(both, 1.0), np.inf)
    least = np.array(np.unravel_index(np.argmin(misfit), misfit.shape))
    middle = np.array(misfit.shape) // 2
    explained = misfit[tuple(middle)] - misfit[tuple(least)]
    if not explained >= config.explained_min * np.sum(before.height_m**2) / before.seen.sum():
        return np.zeros(2)
    return np.asarray(least - middle + _between_cells(misfit, least))


def _between_cells(
    misfit: Float[np.ndarray, "a a"], least: Integer[np.ndarray, " 2"]
) -> Float[np.ndarray, " 2"]:
    """Where the parabola through the least value and its two neighbours is least, by axis."""
    found = np.zeros(2)
    for axis in range(2):
        if not 0 < least[axis] < misfit.shape[axis] - 1:
            continue
        aside = np.eye(2, dtype=np.int64)[axis]
        left, here, right = (misfit[tuple(least + sign * aside)] for sign in (-1, 0, 1))
        bend = left - 2.0 * here + right
        found[axis] = 0.5 * (left - right) / bend if 0 < bend < np.inf else 0.0
    return found
