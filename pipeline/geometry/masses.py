"""What objects weigh: as a file says by name, else at a density drawn around the configured one."""

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from pipeline.config.objects import ObjectsConfig
from pipeline.errors import ConfigError
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.object_names import is_named
from pipeline.geometry.shape import volume


def read_masses(path: Path) -> dict[str, float]:
    """The masses of a masses.toml: ``"002_master_chef_can" = 0.414``, an object a line, in kg.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    Name, with * and ?, → mass of the object as large as its file says [kg].

    Raises
    ------
    ConfigError
        It is not TOML, or a mass is not a number over 0.
    """
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ConfigError(f"{path} cannot be read as TOML: {error}", "Mend that line") from error
    for name, mass in raw.items():
        known = isinstance(mass, int | float) and not isinstance(mass, bool)
        if not (known and 0 < mass < math.inf):
            raise ConfigError(
                f"{path}: the mass of '{name}' is no number over 0",
                f'Write kilograms: "{name}" = 0.25',
            )
    return {name: float(mass) for name, mass in raw.items()}


def mass_of(name: str, masses: Mapping[str, float]) -> float | None:
    """The mass that the first pattern which fits a name gives [kg]; None where none fits."""
    return next((mass for pattern, mass in masses.items() if is_named(name, pattern)), None)


def density_of(
    own: Mesh, mass_kg: float | None, config: ObjectsConfig, rng: np.random.Generator
) -> float:
    """Mean density of an object, which it keeps when it is rescaled.

    Parameters
    ----------
    own
        The closed mesh at its own size.
    mass_kg
        What the object weighs at that size; None where that is not known [kg].
    config
        Density and its spread, where the mass is not known.
    rng
        Draws within the spread, logarithms uniform.

    Returns
    -------
    In kg/m3.
    """
    if mass_kg is not None:
        return mass_kg / volume(own)
    return float(config.density_kg_m3 * config.density_spread ** rng.uniform(-1.0, 1.0))
