"""What a run has settled about its objects and stays with when meshes are added.

Beside the run's artifacts. Splits hold as long as the run's seed and way of splitting do, names
for good, the unit that sizes told as long as any of the files is there that told it.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast, get_args

from pipeline.errors import ConfigError
from pipeline.geometry.selection import Split
from pipeline.geometry.units import METRES_PER_UNIT

SETTLED_FILE = "objects.settled.json"


@dataclass(frozen=True)
class SettledUnit:
    """What a folder's sizes told when its first files came."""

    unit: str
    seen: frozenset[str]
    """SHA-256 of all files that have been read so."""
    bounds_m: tuple[float, float]
    """Least and largest extent that were allowed: with others, the sizes are asked anew."""


@dataclass(frozen=True)
class Settled:
    """What was decided when an object first came."""

    basis: str
    """Digest of what the splits rest on: with another, all objects are split anew."""
    splits: dict[str, Split] = field(default_factory=dict)
    """SHA-256 of an object's source → its split."""
    names: dict[str, str] = field(default_factory=dict)
    """Path of an object's file in the mesh folder → its name."""
    unit: SettledUnit | None = None
    """None where no file's size has been asked for its unit."""

    def to_json(self) -> str:
        """As text, the same for the same decisions."""
        record = {"basis": self.basis, "splits": self.splits, "names": self.names}
        if self.unit:
            record["unit"] = vars(self.unit) | {"seen": sorted(self.unit.seen)}
        return json.dumps(record, indent=1, sort_keys=True, ensure_ascii=False) + "\n"

    def with_splits(self, splits: Mapping[str, Split]) -> "Settled":
        """These and further splits; one that is settled stays, though its object be gone today."""
        return replace(self, splits={**splits, **self.splits})

    def unit_of(self, contents: Iterable[str], bounds_m: tuple[float, float]) -> str | None:
        """The unit settled for a folder of these files, if any."""
        known = self.unit
        stands = known and known.bounds_m == bounds_m and not known.seen.isdisjoint(contents)
        return known.unit if known and stands else None

    def with_unit(
        self, unit: str, contents: Iterable[str], bounds_m: tuple[float, float]
    ) -> "Settled":
        """These files' unit too."""
        seen = frozenset(contents)
        if self.unit and self.unit_of(seen, bounds_m):
            seen |= self.unit.seen
        return replace(self, unit=SettledUnit(unit, seen, bounds_m))

    def with_names(self, names: Mapping[str, str]) -> "Settled":
        """These names too. A file that is gone today keeps its name until another has it."""
        taken = set(names.values())
        kept = {label: name for label, name in self.names.items() if name not in taken}
        return replace(self, names={**kept, **names})


def read_settled(path: Path, basis: str) -> Settled:
    """What is settled already; no splits where they rest on other grounds.

    Parameters
    ----------
    path
        A file in the run's state.
    basis
        Digest of what settled splits rest on: with another one they are drawn anew.

    Returns
    -------
    What is settled.

    Raises
    ------
    ConfigError
        The file is damaged.
    """
    if not path.is_file():
        return Settled(basis)
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        known = {str(digest): str(where) for digest, where in record["splits"].items()}
        names = {str(at): str(name) for at, name in record.get("names", {}).items()}
        stands = record["basis"] == basis
        unit = _unit_of(record["unit"]) if "unit" in record else None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ConfigError(
            f"{path} is damaged ({error})", "Delete it: the run's objects are then split anew"
        ) from error
    splits = {d: cast(Split, w) for d, w in known.items() if stands and w in get_args(Split)}
    return Settled(basis, splits, names, unit)


def _unit_of(record: Mapping[str, Any]) -> SettledUnit:
    """A settled unit as it was written; raises KeyError, TypeError or ValueError if it is none."""
    if record["unit"] not in METRES_PER_UNIT:
        raise ValueError(f"no unit of length: {record['unit']}")
    least, most = record["bounds_m"]
    return SettledUnit(record["unit"], frozenset(map(str, record["seen"])), (least, most))
