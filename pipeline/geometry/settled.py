"""What a run has settled about its objects and stays with when meshes are added: their splits.

Beside the run's artifacts; it holds as long as the run's seed and way of splitting do.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast, get_args

from pipeline.errors import ConfigError
from pipeline.geometry.selection import Split

SETTLED_FILE = "objects.settled.json"


@dataclass(frozen=True)
class Settled:
    """What was decided when an object first came, by its content."""

    basis: str
    """Digest of what the decisions rest on: with another, all is settled anew."""
    splits: dict[str, Split] = field(default_factory=dict)
    """SHA-256 of an object's source → its split."""

    def to_json(self) -> str:
        """As text, the same for the same decisions."""
        record = {"basis": self.basis, "splits": self.splits}
        return json.dumps(record, indent=1, sort_keys=True, ensure_ascii=False) + "\n"

    def with_splits(self, splits: Mapping[str, Split]) -> "Settled":
        """These and further splits; one that is settled stays, though its object be gone today."""
        return Settled(self.basis, {**splits, **self.splits})


def read_settled(path: Path, basis: str) -> Settled:
    """What is settled already; nothing where there is no such file or it rests on other grounds.

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
        stands = record["basis"] == basis
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ConfigError(
            f"{path} is damaged ({error})", "Delete it: the run's objects are then split anew"
        ) from error
    if not stands:
        return Settled(basis)
    return Settled(basis, {d: cast(Split, w) for d, w in known.items() if w in get_args(Split)})
