"""How fast what is aimed at passes by: where its heights have gone since it was first seen.

Heights above the table, on a grid of the world, are compared with those of an earlier picture:
the shift with the least sum of squared differences, over the time between the two, is the
velocity. Objects move on the table, so the shift is level.
"""

import numpy as np
from jaxtyping import Float
from scipy.ndimage import maximum_filter
from scipy.signal import correlate

_CELL_M = 0.002
_HALF_CELLS = 30  # 60 mm to each side of the aim are compared
_REACH_CELLS = 20  # shifts up to 40 mm
_REFRESH_CELLS = 12  # after this shift the earlier picture is replaced
# A shift is known to about a cell's half; less than this in the time between is standing still.
_STILL_M = 0.002
# What a shift must explain of the earlier heights, squared: on an even surface any fits as well.
_EXPLAINED = 0.03

Map = Float[np.ndarray, "n n"]


class Motion:
    """Velocity of what lies around the aim, picture by picture, one control period apart."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._before: Map | None = None
        self._middle_m = np.zeros(2)
        self._periods = 0
        self.velocity_m_s = np.zeros(3)

    def passed(self) -> None:
        """One control period has gone by."""
        self._periods += 1

    def see(self, points_m: Float[np.ndarray, "n 3"], aim_m: Float[np.ndarray, " 3"]) -> None:
        """The points that a picture taken now measured around the aim, in WCS."""
        if len(points_m) == 0:
            return
        if self._before is None or self._periods == 0:
            self._begin(points_m, aim_m)
            return
        after = height_map(points_m, self._middle_m, _HALF_CELLS + _REACH_CELLS)
        shift_m = _CELL_M * shift_between(self._before, after)
        size = float(np.linalg.norm(shift_m))
        time_s = self._periods * self._period_s
        self.velocity_m_s[:2] = shift_m / time_s if size > _STILL_M else 0.0
        if size > _REFRESH_CELLS * _CELL_M:
            self._begin(points_m, aim_m)

    def _begin(self, points_m: Float[np.ndarray, "n 3"], aim_m: Float[np.ndarray, " 3"]) -> None:
        self._middle_m, self._periods = aim_m[:2].copy(), 0
        self._before = height_map(points_m, self._middle_m, _HALF_CELLS)


def height_map(
    points_m: Float[np.ndarray, "n 3"], middle_m: Float[np.ndarray, " 2"], half_cells: int
) -> Map:
    """Greatest height about each cell of a square around a place; 0 where nothing was measured."""
    heights = np.zeros((2 * half_cells + 1,) * 2)
    cell = np.round((points_m[:, :2] - middle_m) / _CELL_M).astype(np.int64) + half_cells
    inside = (cell >= 0).all(axis=1) & (cell < len(heights)).all(axis=1)
    np.maximum.at(heights, tuple(cell[inside].T), points_m[inside, 2])
    return np.asarray(maximum_filter(heights, size=3))  # points are sparser than cells


def shift_between(before: Map, after: Float[np.ndarray, "m m"]) -> Float[np.ndarray, " 2"]:
    """By how many cells the heights have moved, to a fraction of one; 0 where none fits better.

    after : the same place in a larger square; what it is larger by bounds the shift.
    """
    energy = correlate(after**2, np.ones_like(before), mode="valid", method="fft")
    likeness = correlate(after, before, mode="valid", method="fft")
    misfit = energy - 2.0 * likeness
    least = np.array(np.unravel_index(np.argmin(misfit), misfit.shape))
    middle = np.array(misfit.shape) // 2
    if misfit[tuple(middle)] - misfit[tuple(least)] < _EXPLAINED * float(np.sum(before**2)):
        return np.zeros(2)
    return np.asarray(least - middle + _between_cells(misfit, least))


def _between_cells(
    misfit: Float[np.ndarray, "a a"], least: Float[np.ndarray, " 2"]
) -> Float[np.ndarray, " 2"]:
    """Where the parabola through the least value and its two neighbours is least, by axis."""
    found = np.zeros(2)
    for axis in range(2):
        if not 0 < least[axis] < misfit.shape[axis] - 1:
            continue
        aside = np.eye(2, dtype=np.int64)[axis]
        left, here, right = (misfit[tuple(least + sign * aside)] for sign in (-1, 0, 1))
        bend = left - 2.0 * here + right
        found[axis] = 0.5 * (left - right) / bend if bend > 0 else 0.0
    return found
