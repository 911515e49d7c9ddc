"""Units of length of mesh files: declared, configured, or told from the sizes."""

from typing import Literal

from pipeline.config.objects import ObjectsConfig
from pipeline.errors import MeshError

UnitSource = Literal["declared", "configured", "detected"]

METRES_PER_UNIT = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
# Millimetres before centimetres: most tools for design write them.
_DETECTION_ORDER = ("m", "mm", "cm")


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
    for unit in candidates:
        if config.min_extent_m <= extent * METRES_PER_UNIT[unit] <= config.max_extent_m:
            return unit, known_by
    raise MeshError(
        f"{label} has an absurd size: its longest extent of {extent:.3g} is outside "
        f"{config.min_extent_m:g} to {config.max_extent_m:g} m in {' or '.join(candidates)}",
        "Declare its unit in objects.unit, or rescale the mesh",
    )
