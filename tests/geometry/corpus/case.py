"""What a case of the corpus is: files, and what is right for them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tests.geometry.corpus.solids import Solid


@dataclass(frozen=True, eq=False)
class Case:
    """A file that somebody may bring.

    Either ``solid`` says what it holds, or ``refused`` what its refusal must say: the true reason,
    in these words.
    """

    name: str
    """Path of the file that is read."""
    data: bytes
    what: str
    """What is special about the file, in a few words."""
    solid: Solid | None = None
    refused: str = ""
    bodies: int = 1
    """Closed bodies in the file, before overlapping ones are united."""
    recorded: str = ""
    """What the object's record of repairs must say, if anything."""
    tolerance: float = 1e-6
    """Relative error of volume and area: larger where the file itself is coarser."""
    beside: Mapping[str, bytes] = field(default_factory=dict)
    """Further files, by path."""


def write(case: Case, folder: Path) -> Path:
    """The case's files in a folder; returns the path of the one that is read."""
    here = str(folder.resolve()).encode()
    for name, data in {**case.beside, case.name: case.data}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data.replace(b"{folder}", here) if name.endswith(".urdf") else data)
    return folder / case.name
