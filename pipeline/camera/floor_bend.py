"""How a floor departs from its plane: bins sag, and depth cameras see flat floors as shallow bowls.

Both bend a floor by some millimetres over its length, which is as much as a flat object is high.
A surface of second order is fitted to what lies near the plane; objects in it are outweighed
(Huber's loss), and where too little floor is seen there is no bend.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pipeline.config.predict import SupportConfig

_ROUNDS = 8  # of reweighting: the weights then change by less than a hundredth
_RIDGE = 1e-3  # of a term's weight: terms that the points do not tell of stay 0


@dataclass(frozen=True, eq=False)
class FloorBend:
    """A surface of second order over the support's plane, bounded.

    Attributes
    ----------
    middle_m
        Middle of the floor in the support's x and y [m].
    scale_m
        Half the floor's length [m].
    terms_m
        Factors of 1, u, v, u^2, u v, v^2 with (u, v) = ((x, y) - middle_m) / scale_m [m].
    bounds_m
        Lowest and highest that the floor was seen to lie [m].
    """

    middle_m: Float[np.ndarray, " 2"]
    scale_m: float
    terms_m: Float[np.ndarray, " 6"]
    bounds_m: tuple[float, float]

    def height_m(self, places_m: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, " n"]:
        """Height of the floor over the plane at places in the support's x and y [m]."""
        u, v = ((places_m - self.middle_m) / self.scale_m).T
        one, x, y, xx, xy, yy = self.terms_m
        bent = one + u * (x + xx * u + xy * v) + v * (y + yy * v)
        return np.asarray(np.clip(bent, *self.bounds_m))


def fit_floor_bend(
    points_m: Float[np.ndarray, "n 3"], near_m: Float[np.ndarray, " n"], config: SupportConfig
) -> FloorBend | None:
    """Fit a floor's bend to the points within its outline.

    Parameters
    ----------
    points_m
        In the support's frame.
    near_m
        How far from a plane a point of it may lie, by its distance from the camera [m].
    config
        How much of the outline must show floor.

    Returns
    -------
    The bend; None where floor shows in too little of the outline.
    """
    on_floor = np.abs(points_m[:, 2]) <= 2.0 * near_m
    if not on_floor.any():
        return None
    cells = np.floor(points_m[:, :2] / config.piece_gap_m).astype(np.int64)
    seen = len(np.unique(cells[on_floor], axis=0)) / len(np.unique(cells, axis=0))
    if seen < config.bend_seen_share:
        return None
    floor, tolerance = points_m[on_floor], near_m[on_floor]
    lower, upper = floor[:, :2].min(axis=0), floor[:, :2].max(axis=0)
    middle, scale = (lower + upper) / 2, float((upper - lower).max()) / 2
    if scale <= 0.0:
        return None
    u, v = ((floor[:, :2] - middle) / scale).T
    rows = np.column_stack([np.ones_like(u), u, v, u * u, u * v, v * v])
    terms = np.zeros(6)
    for _ in range(_ROUNDS):
        # A quarter of the tolerance: what noise alone makes of a floor.
        off = np.abs(floor[:, 2] - rows @ terms) / (0.25 * tolerance)
        weight = 1.0 / np.maximum(off, 1.0)
        square = (rows * weight[:, None]).T @ rows
        ridge = _RIDGE * weight.sum() * np.eye(6)
        terms = np.linalg.solve(square + ridge, (rows * weight[:, None]).T @ floor[:, 2])
    fitted = rows @ terms
    return FloorBend(middle, scale, terms, (float(fitted.min()), float(fitted.max())))
