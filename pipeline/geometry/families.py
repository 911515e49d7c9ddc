"""Families of objects: near-copies by shape, and what a person declares to be alike.

A network that has trained on one member of a family has as good as seen the others, so a family
is never in two splits.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.errors import ConfigError, MeshError
from pipeline.geometry.descriptor import ShapeDescriptor, shape_distance
from pipeline.geometry.object_names import is_named
from pipeline.geometry.selection import Split


@dataclass(frozen=True)
class DeclaredFamily:
    """Objects that a person calls alike."""

    name: str
    patterns: tuple[str, ...]
    """Names of objects, with * and ?."""

    def has(self, name: str) -> bool:
        """Whether an object of that name is declared a member."""
        return any(is_named(name, pattern) for pattern in self.patterns)


@dataclass(frozen=True)
class Families:
    """Which family each object belongs to, and which objects would join two splits."""

    of: dict[str, str]
    """Object → family; a family is named as declared, or after its first member by name."""
    joining: dict[str, MeshError]
    """Object left out → why."""


def read_declared(path: Path) -> tuple[DeclaredFamily, ...]:
    """The families of a families.toml: ``"toy bricks" = ["073-*", "brick"]``, a line each.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    What it declares, in its order.

    Raises
    ------
    ConfigError
        It is not TOML, or a family is not a list of names.
    """
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ConfigError(f"{path} cannot be read as TOML: {error}", "Mend that line") from error
    for name, patterns in raw.items():
        if not isinstance(patterns, list) or not all(isinstance(p, str) for p in patterns):
            raise ConfigError(
                f"{path}: family '{name}' is not a list of names",
                f"Write it as \"{name}\" = ['mug', 'cup-*']",
            )
    return tuple(DeclaredFamily(name, tuple(patterns)) for name, patterns in raw.items())


def group(
    descriptors: Mapping[str, ShapeDescriptor],
    declared: Sequence[DeclaredFamily],
    threshold: float,
    fixed: Mapping[str, Split],
) -> Families:
    """Families of the objects, joined wherever two are alike or declared so.

    Parameters
    ----------
    descriptors
        Shape of each object, by name. The order decides which of several new objects is left
        out where they would join two splits together: the later one.
    declared
        What a person calls alike.
    threshold
        Two shapes nearer than this are near-copies [1].
    fixed
        Splits that are settled already, by object.

    Returns
    -------
    Family of each object, and what had to be left out.

    Raises
    ------
    ConfigError
        Objects of different settled splits are in one family now.
    """
    order = [name for name in descriptors if name in fixed]
    order += [name for name in descriptors if name not in fixed]
    kin: dict[str, set[str]] = {}  # object → its whole family, one set for all members
    joining: dict[str, MeshError] = {}
    for name in order:
        found = [other for other in kin if _alike(name, other, descriptors, declared, threshold)]
        family = {name}.union(*(kin[other] for other in found))
        held = {fixed[member]: member for member in sorted(family, reverse=True) if member in fixed}
        if len(held) > 1:
            (one, other) = sorted(held)[:2]
            told = f"{held[one]} ({one}) and {held[other]} ({other})"
            if name in fixed:
                raise ConfigError(
                    f"Objects of two splits are one family: {told}",
                    "Take the line out of families.toml, or let the run split anew: 'make clean'",
                )
            joining[name] = MeshError(
                f"{name} is of one family with {told}, and would join their splits",
                "Take it out of the folder, or let the run split anew: 'make clean'",
            )
            continue
        for member in family:
            kin[member] = family
    return Families(_named(kin, declared), joining)


def _alike(
    one: str,
    other: str,
    descriptors: Mapping[str, ShapeDescriptor],
    declared: Sequence[DeclaredFamily],
    threshold: float,
) -> bool:
    if any(family.has(one) and family.has(other) for family in declared):
        return True
    return shape_distance(descriptors[one], descriptors[other]) < threshold


def _named(kin: Mapping[str, set[str]], declared: Sequence[DeclaredFamily]) -> dict[str, str]:
    names: dict[str, str] = {}
    for name, family in sorted(kin.items()):
        called = [known.name for known in declared if any(known.has(member) for member in family)]
        names[name] = called[0] if called else min(family)
    return names
