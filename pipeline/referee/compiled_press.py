"""The pad's obstacle problem, compiled: what `foundation.press` says, ten times as fast.

Projected over-relaxation finds the face for each rest height of the back that a bracketed search
tries. It starts from what the last call found. Tests hold it to the plain way.
"""

import numpy as np
from jaxtyping import Float, Int

from pipeline.compiled_code import njit
from pipeline.referee.disc import Disc
from pipeline.referee.foundation import Cushion, Pressed

_STILL_M = 1e-8  # a sweep that moves no vertex further than this is the last
_MOST_SWEEPS = 20_000  # bounds a press that does not come to rest
_FORCE_EXACT = 1e-5  # of the force
_MOST_TRIES = 200  # bounds a search that does not end


def press(
    disc: Disc,
    cushion: Cushion,
    surface_m: Float[np.ndarray, " n"],
    force_n: float,
    near: Pressed | None = None,
) -> Pressed:
    """As `foundation.press`, to within tens of nanometres.

    Parameters
    ----------
    disc
        The pad's elements.
    cushion
        Its stiffness and tension.
    surface_m
        s, height of the surface under each vertex, shape (n,), GCS [m].
    force_n
        F > 0, with which the pad is pressed along -z [N].
    near
        The same pad pressed with a little less: a start.

    Returns
    -------
    The pad at rest on the surface.

    Raises
    ------
    ValueError
        There is no surface at all.
    """
    if not np.isfinite(surface_m).any():
        raise ValueError("a pad cannot be pressed where there is no surface")
    face, back = _pressed(
        disc.starts,
        disc.neighbours,
        cushion.tension_n_m * disc.weights,
        cushion.stiffness_pa_m * disc.areas_m2,
        surface_m,
        force_n,
        np.full(len(surface_m), surface_m.max()) if near is None else near.face_m,
        surface_m.max() if near is None else near.back_m,
    )
    pushes = _pushes(
        disc.starts,
        disc.neighbours,
        cushion.tension_n_m * disc.weights,
        cushion.stiffness_pa_m * disc.areas_m2,
        face,
        back,
    )
    return Pressed(face, back, np.where(face <= surface_m, np.maximum(pushes, 0.0), 0.0))


@njit()
def _pressed(
    starts: Int[np.ndarray, " n+1"],
    neighbours: Int[np.ndarray, " e"],
    tension: Float[np.ndarray, " e"],
    springs: Float[np.ndarray, " n"],
    surface: Float[np.ndarray, " n"],
    force: float,
    near: Float[np.ndarray, " n"],
    above: float,
) -> tuple[Float[np.ndarray, " n"], float]:
    """Face and rest height of the back that carry the force: regula falsi, Illinois.

    The search starts from the face ``near`` and the rest height ``above``, which carries less.
    """
    n = len(springs)
    diagonal = springs.copy()
    slowest = 0.0
    for i in range(n):
        for e in range(starts[i], starts[i + 1]):
            diagonal[i] += tension[e]
        slowest = max(slowest, 1.0 - springs[i] / diagonal[i])
    relaxation = 2.0 / (1.0 + np.sqrt(1.0 - slowest * slowest))
    face = np.maximum(surface, near)
    high = above
    force_high = (
        _carried(starts, neighbours, tension, springs, diagonal, relaxation, surface, face, high)
        - force
    )
    # All springs together are stiffer than those that touch: this far down at least.
    depth = max(-force_high, 1e-3 * force) / springs.sum()
    low = high - depth
    force_low = (
        _carried(starts, neighbours, tension, springs, diagonal, relaxation, surface, face, low)
        - force
    )
    while force_low < 0.0:
        high, force_high = low, force_low
        depth *= 2.0
        low = high - depth
        force_low = (
            _carried(starts, neighbours, tension, springs, diagonal, relaxation, surface, face, low)
            - force
        )
    back, side = low, 0
    for _ in range(_MOST_TRIES):
        if abs(force_low) <= _FORCE_EXACT * force:
            back = low
            break
        back = (low * force_high - high * force_low) / (force_high - force_low)
        found = (
            _carried(
                starts, neighbours, tension, springs, diagonal, relaxation, surface, face, back
            )
            - force
        )
        if abs(found) <= _FORCE_EXACT * force:
            break
        if found > 0.0:
            low, force_low = back, found
            if side == 1:
                force_high *= 0.5
            side = 1
        else:
            high, force_high = back, found
            if side == -1:
                force_low *= 0.5
            side = -1
    return face, back


@njit()
def _carried(
    starts: Int[np.ndarray, " n+1"],
    neighbours: Int[np.ndarray, " e"],
    tension: Float[np.ndarray, " e"],
    springs: Float[np.ndarray, " n"],
    diagonal: Float[np.ndarray, " n"],
    relaxation: float,
    surface: Float[np.ndarray, " n"],
    face: Float[np.ndarray, " n"],
    back: float,
) -> float:
    """Force of the springs with the back at a height; the face is relaxed in place."""
    n = len(springs)
    for _ in range(_MOST_SWEEPS):
        moved = 0.0
        for i in range(n):
            pull = springs[i] * back
            for e in range(starts[i], starts[i + 1]):
                pull += tension[e] * face[neighbours[e]]
            now = face[i] + relaxation * (pull / diagonal[i] - face[i])
            if now < surface[i]:
                now = surface[i]
            change = abs(now - face[i])
            if change > moved:
                moved = change
            face[i] = now
        if moved <= _STILL_M:
            break
    total = 0.0
    for i in range(n):
        total += springs[i] * (face[i] - back)
    return total


@njit()
def _pushes(
    starts: Int[np.ndarray, " n+1"],
    neighbours: Int[np.ndarray, " e"],
    tension: Float[np.ndarray, " e"],
    springs: Float[np.ndarray, " n"],
    face: Float[np.ndarray, " n"],
    back: float,
) -> Float[np.ndarray, " n"]:
    """What the surface must push at each vertex for the face to be at rest."""
    pushes = springs * (face - back)
    for i in range(len(springs)):
        for e in range(starts[i], starts[i + 1]):
            pushes[i] += tension[e] * (face[i] - face[neighbours[e]])
    return pushes
