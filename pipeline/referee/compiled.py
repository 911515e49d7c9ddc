"""The pad's obstacle problem and the film under it, compiled: what `foundation` and `leak` say.

The obstacle problem by projected over-relaxation, for each rest height of the back that a bracketed
search tries; the film by conjugate gradients with an incomplete Cholesky factor. Both start from
what the last call found. Held to the plain ways by tests.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.compiled_code import njit
from pipeline.referee.disc import Disc
from pipeline.referee.foundation import Cushion, Pressed
from pipeline.referee.leak import (
    MOST_STEPS,
    SETTLED,
    Face,
    Vacuum,
    film_edges,
    film_mobility,
)
from pipeline.referee.pump import Fan

_STILL_M = 1e-8  # a sweep that moves no vertex further than this is the last
_MOST_SWEEPS = 20_000  # bounds a press that does not come to rest
_FORCE_EXACT = 1e-5  # of the force
_MOST_TRIES = 200  # bounds a search that does not end
_RESIDUAL = 1e-8  # of the right-hand side


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


def leak(
    disc: Disc,
    film_m: Float[np.ndarray, " n"],
    open_to_air: Bool[np.ndarray, " n"],
    face: Face,
    fan: Fan,
) -> Vacuum:
    """As `leak.leak`."""
    under, vacuum_pa, flow = _drawn(
        disc.starts,
        disc.neighbours,
        film_edges(disc, film_m, open_to_air),
        disc.rim_weights * film_mobility(film_m),
        disc.areas_m2,
        open_to_air,
        (face.viscous, face.inertial),
        (fan.vacuum_pa, fan.flow_m3_s, fan.exponent),
    )
    return Vacuum(under, vacuum_pa, flow)


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


@njit()
def _drawn(
    starts: Int[np.ndarray, " n+1"],
    neighbours: Int[np.ndarray, " e"],
    film: Float[np.ndarray, " e"],
    to_air: Float[np.ndarray, " n"],
    areas: Float[np.ndarray, " n"],
    open_to_air: Bool[np.ndarray, " n"],
    face: tuple[float, float],
    fan: tuple[float, float, float],
) -> tuple[Float[np.ndarray, " n"], float, float]:
    """Vacuum under the face and in the cushion, and the fan's flow."""
    n = len(areas)
    viscous, inertial = face
    vacuum = fan[0]
    under, shares = np.zeros(n), np.zeros(n)
    diagonal, right = np.empty(n), np.empty(n)
    factor, pivots = np.empty(len(film)), np.empty(n)
    flow = 0.0
    for _ in range(MOST_STEPS):
        for i in range(n):
            drop = max(vacuum - under[i], 0.0)
            right[i] = areas[i] * 2.0 / (viscous + np.sqrt(viscous**2 + 4.0 * inertial * drop))
            diagonal[i] = right[i] + to_air[i]
            for e in range(starts[i], starts[i + 1]):
                diagonal[i] += film[e]
        _factorised(starts, neighbours, film, diagonal, open_to_air, factor, pivots)
        _film_solved(starts, neighbours, film, diagonal, open_to_air, factor, pivots, right, shares)
        conductance = 0.0
        for i in range(n):
            conductance += right[i] * (1.0 - shares[i])
        before = vacuum
        vacuum = _working_point(fan[0], fan[1], fan[2], conductance)
        flow = conductance * vacuum
        moved = abs(vacuum - before)
        for i in range(n):
            now = vacuum * shares[i]
            moved = max(moved, abs(now - under[i]))
            under[i] = now
        if moved <= SETTLED * fan[0]:
            break
    return under, vacuum, flow


@njit()
def _working_point(vacuum: float, flow: float, exponent: float, conductance: float) -> float:
    """As `pump.working_point`, by halving."""
    low, high = 0.0, min(vacuum, flow / max(conductance, 1e-300))
    if vacuum * (1.0 - (conductance * high / flow) ** exponent) >= high:
        return high
    for _ in range(60):
        middle = 0.5 * (low + high)
        if vacuum * (1.0 - (conductance * middle / flow) ** exponent) > middle:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@njit()
def _factorised(
    starts: Int[np.ndarray, " n+1"],
    neighbours: Int[np.ndarray, " e"],
    film: Float[np.ndarray, " e"],
    diagonal: Float[np.ndarray, " n"],
    out: Bool[np.ndarray, " n"],
    factor: Float[np.ndarray, " e"],
    pivots: Float[np.ndarray, " n"],
) -> None:
    """Incomplete L D Lᵀ of the film's matrix, on the edges there are; neighbours are sorted."""
    for i in range(len(diagonal)):
        pivot = diagonal[i]
        if out[i]:
            pivots[i] = 1.0
            continue
        for e in range(starts[i], starts[i + 1]):
            j = neighbours[e]
            if j >= i:
                break
            if out[j]:
                factor[e] = 0.0
                continue
            value = -film[e]
            a, b = starts[i], starts[j]
            while neighbours[a] < j and neighbours[b] < j:
                if neighbours[a] == neighbours[b]:
                    value -= factor[a] * factor[b] * pivots[neighbours[a]]
                    a += 1
                    b += 1
                elif neighbours[a] < neighbours[b]:
                    a += 1
                else:
                    b += 1
            factor[e] = value / pivots[j]
            pivot -= factor[e] * value
        pivots[i] = pivot


@njit()
def _film_solved(
    starts: Int[np.ndarray, " n+1"],
    neighbours: Int[np.ndarray, " e"],
    film: Float[np.ndarray, " e"],
    diagonal: Float[np.ndarray, " n"],
    out: Bool[np.ndarray, " n"],
    factor: Float[np.ndarray, " e"],
    pivots: Float[np.ndarray, " n"],
    right: Float[np.ndarray, " n"],
    shares: Float[np.ndarray, " n"],
) -> None:
    """Conjugate gradients from where ``shares`` is; vertices that are out stay at zero."""
    n = len(diagonal)
    rest, step, image, better = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    largest = 0.0
    for i in range(n):
        shares[i] = 0.0 if out[i] else shares[i]
    _multiplied(starts, neighbours, film, diagonal, out, shares, image)
    for i in range(n):
        rest[i] = 0.0 if out[i] else right[i] - image[i]
        if not out[i]:
            largest = max(largest, right[i])
    _improved(starts, neighbours, factor, pivots, out, rest, better)
    step[:] = better
    product = np.dot(rest, better)
    for _ in range(4 * n):
        if np.abs(rest).max() <= _RESIDUAL * largest:
            break
        _multiplied(starts, neighbours, film, diagonal, out, step, image)
        length = product / np.dot(step, image)
        for i in range(n):
            shares[i] += length * step[i]
            rest[i] -= length * image[i]
        _improved(starts, neighbours, factor, pivots, out, rest, better)
        before, product = product, np.dot(rest, better)
        for i in range(n):
            step[i] = better[i] + product / before * step[i]


@njit()
def _multiplied(
    starts: Int[np.ndarray, " n+1"],
    neighbours: Int[np.ndarray, " e"],
    film: Float[np.ndarray, " e"],
    diagonal: Float[np.ndarray, " n"],
    out: Bool[np.ndarray, " n"],
    vector: Float[np.ndarray, " n"],
    image: Float[np.ndarray, " n"],
) -> None:
    for i in range(len(diagonal)):
        if out[i]:
            image[i] = 0.0
            continue
        total = diagonal[i] * vector[i]
        for e in range(starts[i], starts[i + 1]):
            total -= film[e] * vector[neighbours[e]]
        image[i] = total


@njit()
def _improved(
    starts: Int[np.ndarray, " n+1"],
    neighbours: Int[np.ndarray, " e"],
    factor: Float[np.ndarray, " e"],
    pivots: Float[np.ndarray, " n"],
    out: Bool[np.ndarray, " n"],
    rest: Float[np.ndarray, " n"],
    better: Float[np.ndarray, " n"],
) -> None:
    """(L D Lᵀ)⁻¹ of the rest."""
    n = len(pivots)
    for i in range(n):
        value = rest[i]
        if not out[i]:
            for e in range(starts[i], starts[i + 1]):
                if neighbours[e] >= i:
                    break
                value -= factor[e] * better[neighbours[e]]
        better[i] = value
    for i in range(n):
        better[i] /= pivots[i]
    for i in range(n - 1, -1, -1):
        if out[i]:
            continue
        for e in range(starts[i], starts[i + 1]):
            if neighbours[e] >= i:
                break
            better[neighbours[e]] -= factor[e] * better[i]
