"""One object in several files: surfaces that are the same but for a motion and a unit.

However they are cut into triangles. Descriptors and sizes choose the pairs, registration decides.
Mirror images are the same only where turning makes them so, and shapes of another size are other
objects, unless the sizes differ by a factor between units of length.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from pipeline.geometry.catalogue import MeasuredObject
from pipeline.geometry.descriptor import shape_distance
from pipeline.geometry.registration import Shape, distance_laid_on, shape_of
from pipeline.geometry.shape import outer_surface, volume
from pipeline.geometry.units import METRES_PER_UNIT

# Of 47 scans simplified to a quarter of their faces, all but a chain keep cbrt(V) to 1.2 % and
# their descriptor to 0.03. Registration, at true sizes, judges what comes through.
_SIZE_TOLERANCE = 0.015
_DESCRIPTOR_TOLERANCE = 0.03
# A cavity that takes more of the volume makes another object of the same outer surface.
_FILLED_TOLERANCE = 0.01
_METRES = np.array(list(METRES_PER_UNIT.values()))
_LOG_FACTORS = np.log(np.unique(_METRES[:, None] / _METRES))


def find_copies(
    items: Sequence[MeasuredObject], stood: Collection[str], most_rms: float
) -> dict[str, tuple[str, ...]]:
    """Which files hold the surface of another file.

    Parameters
    ----------
    items
        Measured objects, in any order.
    stood
        Paths of files that stood for an object in an earlier making of the run.
    most_rms
        Surfaces are the same where, laid on each other, the root mean square of their distances
        is at most this share of sqrt(A) [1].

    Returns
    -------
    Path of each file that stands for an object of several → the other files' paths, sorted. The
    one that stands is one that stood before, else one that needed no repair, of those the one with
    the most faces, and of equals the first by path.
    """
    ranked = [_Candidate(item) for item in sorted(items, key=lambda item: _rank(item, stood))]
    log_sizes = np.log([candidate.item.descriptor.length for candidate in ranked])
    nsvr = np.array([candidate.item.nsvr for candidate in ranked])
    filled = np.array([candidate.filled for candidate in ranked])
    standing: list[int] = []
    copies: dict[str, list[str]] = {}
    for index, one in enumerate(ranked):
        others = np.array(standing, dtype=np.int64)
        factors = _unit_factors(log_sizes[others] - log_sizes[index])
        alike = np.abs(nsvr[others] - nsvr[index]) <= _DESCRIPTOR_TOLERANCE * nsvr[index]
        alike &= np.isfinite(factors) & (
            np.abs(filled[others] - filled[index]) <= _FILLED_TOLERANCE
        )
        for other, factor in zip(others[alike], factors[alike], strict=True):
            if _is_copy(one, ranked[other], float(factor), most_rms):
                copies.setdefault(ranked[other].label, []).append(one.label)
                break
        else:
            standing.append(index)
    return {label: tuple(sorted(of)) for label, of in copies.items()}


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A measured object, and the shape that is laid on others, made when it is first asked for."""

    item: MeasuredObject

    @property
    def label(self) -> str:
        return self.item.source.label

    @property
    def filled(self) -> float:
        """Share of the volume within the outer surface that is no cavity [1]."""
        return volume(self.item.mesh) / self.item.descriptor.length**3

    @cached_property
    def shape(self) -> Shape:
        return shape_of(outer_surface(self.item.mesh))


def _rank(item: MeasuredObject, stood: Collection[str]) -> tuple[bool, bool, int, str]:
    label = item.source.label
    return label not in stood, bool(item.repairs), -len(item.mesh.faces), label


def _unit_factors(log_ratios: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """The factor between units that each ratio of sizes is; NaN where it is none."""
    nearest = np.abs(log_ratios[:, None] - _LOG_FACTORS).argmin(axis=1)
    off = np.abs(log_ratios - _LOG_FACTORS[nearest])
    return np.where(off <= _SIZE_TOLERANCE, np.exp(_LOG_FACTORS[nearest]), np.nan)


def _is_copy(one: _Candidate, other: _Candidate, factor: float, most_rms: float) -> bool:
    """Whether the first's surface, times the factor, is the second's."""
    if one.item.content == other.item.content:
        return True
    if shape_distance(one.item.descriptor, other.item.descriptor) > _DESCRIPTOR_TOLERANCE:
        return False
    return distance_laid_on(one.shape, other.shape, factor, most_rms) <= most_rms
