"""The film of air under the pad, compiled: what `leak.leak` says, ten times as fast.

It is solved by conjugate gradients with an incomplete Cholesky factor, and each step starts from
what the last one found. Tests hold it to the plain way.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.compiled_code import njit
from pipeline.referee.disc import Disc
from pipeline.referee.leak import (
    MOST_STEPS,
    SETTLED,
    Face,
    Vacuum,
    film_edges,
    film_mobility,
)
from pipeline.referee.pump import Fan

_RESIDUAL = 1e-8  # of the right-hand side


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
    """Conjugate gradients, starting at ``shares``; vertices that are out stay at zero."""
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
