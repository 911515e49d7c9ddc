"""Units of length of mesh files: declared, configured, or told from the sizes.

One size may fit several units: what a folder's files are in is decided for all of them together.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from pipeline.config.objects import ObjectsConfig
from pipeline.errors import MeshError

UnitSource = Literal["declared", "configured", "detected"]

METRES_PER_UNIT = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
# Millimetres before centimetres: most tools for design write them.
_DETECTION_ORDER = ("m", "mm", "cm")


@dataclass(frozen=True)
class FolderUnit:
    """The unit that sizes tell of a folder's files, none of which declares one."""

    unit: str
    """What the files that fit it are in."""
    also_fit: tuple[str, ...] = ()
    """Other units that the same files fit as well."""
    apart: dict[str, str] = field(default_factory=dict)
    """Path of each file whose size does not fit → the unit that it is read in."""

    def of(self, label: str) -> str:
        """The unit of one file."""
        return self.apart.get(label, self.unit)

    def figures(self) -> dict[str, Any]:
        """For the stage's summary."""
        return {"unit": self.unit, "also_fit": list(self.also_fit), "apart": self.apart}

    def remarks(self) -> list[str]:
        """What a person should be told of it."""
        said = [
            f"{label} does not fit the other meshes, which are in {self.unit} by their sizes: it "
            f"is read in {own}. Convert it, or set objects.unit"
            for label, own in sorted(self.apart.items())
        ]
        if self.also_fit:
            others = " or ".join(self.also_fit)
            said.append(
                f"The meshes are read in {self.unit}; by their sizes they may be in {others}. "
                "If so, set objects.unit"
            )
        return said


def folder_unit(
    extents: Mapping[str, float], config: ObjectsConfig, settled: str | None
) -> FolderUnit:
    """The unit of a folder's files that declare none, by all their sizes together.

    Parameters
    ----------
    extents
        Longest extent of each file in its own unit, by path; each fits one unit at least.
    config
        Bounds on sizes.
    settled
        What was decided before, and stays.

    Returns
    -------
    The unit that most of the files fit, the first of m, mm and cm among equals. Those that do not
    fit it have the first that they fit.
    """
    fits = {label: _fitting(extent, _DETECTION_ORDER, config) for label, extent in extents.items()}
    unit = settled or max(
        _DETECTION_ORDER, key=lambda unit: sum(unit in fitting for fitting in fits.values())
    )
    inside = [fitting for fitting in fits.values() if unit in fitting]
    others = [other for other in _DETECTION_ORDER if other != unit]
    also = [other for other in others if inside and all(other in fitting for fitting in inside)]
    apart = {at: (fitting or [unit])[0] for at, fitting in fits.items() if unit not in fitting}
    return FolderUnit(unit, tuple(also), apart)


def length_unit(
    label: str, extent: float, declared: str | None, config: ObjectsConfig
) -> tuple[str, UnitSource]:
    """The file's length unit and how it is known.

    What the file declares holds; else what the configuration says; else the first of m, mm, cm
    that puts the longest extent between the configured bounds. Raises MeshError where the size
    lies outside them.
    """
    candidates: tuple[str, ...]
    known_by: UnitSource
    if declared is not None:
        candidates, known_by = (declared,), "declared"
    elif config.unit != "auto":
        candidates, known_by = (config.unit,), "configured"
    else:
        candidates, known_by = _DETECTION_ORDER, "detected"
    if fitting := _fitting(extent, candidates, config):
        return fitting[0], known_by
    raise MeshError(
        f"{label} has an absurd size: its longest extent of {extent:.3g} is outside "
        f"{config.min_extent_m:g} to {config.max_extent_m:g} m in {' or '.join(candidates)}",
        "Declare its unit in objects.unit, or rescale the mesh",
    )


def _fitting(extent: float, units: tuple[str, ...], config: ObjectsConfig) -> list[str]:
    """Those of the units in which an extent is between the configured bounds."""
    least, most = config.min_extent_m, config.max_extent_m
    return [unit for unit in units if least <= extent * METRES_PER_UNIT[unit] <= most]
