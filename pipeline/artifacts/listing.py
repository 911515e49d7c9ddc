"""Files that a person names one by one or by the folders that they lie in."""

from collections.abc import Iterable
from pathlib import Path

from pipeline.errors import ArtifactError


def artifacts_in(named: Iterable[Path]) -> list[Path]:
    """The artifacts that paths name: MCAP files, and all in folders, in their order.

    Parameters
    ----------
    named
        Files and folders.

    Returns
    -------
    Files.

    Raises
    ------
    ArtifactError
        A path is not there, or a folder holds no MCAP file.
    """
    found: list[Path] = []
    for path in named:
        inside = sorted(path.glob("*.mcap")) if path.is_dir() else [path]
        if not inside or not all(one.is_file() for one in inside):
            raise ArtifactError(
                f"{path} holds no MCAP file" if path.is_dir() else f"{path} is not there",
                "Name files that make robot or make eval wrote, or folders of them",
            )
        found += inside
    return found
