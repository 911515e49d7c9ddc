"""The folders whose files a work item may name, and the keys that such paths travel as.

A node without a folder in common with the driver has each of them in another place. Files of the
run, and of the folder that is lent to it, lie in the run's store under these keys.
"""

from dataclasses import dataclass
from pathlib import Path

from pipeline.errors import StoreError

LENT = ".state/lent"  # in the store: files of the lent folder, while a stage needs them
_CACHE = ".cache"  # never in the store: each node has a cache of its own


@dataclass(frozen=True)
class RunRoots:
    """Where the files of a run are for this process.

    Attributes
    ----------
    run
        The run's folder.
    lent
        A folder outside of it that the stage reads, such as that of the meshes; None: there is
        none.
    cache
        What can be made again, for all runs.
    """

    run: Path
    lent: Path | None
    cache: Path

    def key_of(self, path: Path) -> str:
        """The key that a path travels as. Raises StoreError for files of other folders."""
        for root, begin in ((self.lent, LENT), (self.cache, _CACHE), (self.run, ".")):
            if root is not None and path.absolute().is_relative_to(root.absolute()):
                return (Path(begin) / path.absolute().relative_to(root.absolute())).as_posix()
        raise StoreError(
            f"{path} is no file of the run, and nodes without a common folder have it not",
            "Work on it with EXECUTOR=local",
        )

    def path_of(self, key: str) -> Path:
        """The path here of a key."""
        parts = Path(key)
        if parts.is_relative_to(_CACHE):
            return self.cache / parts.relative_to(_CACHE)
        if self.lent is not None and parts.is_relative_to(LENT):
            return self.lent / parts.relative_to(LENT)
        return self.run / parts


def is_in_store(key: str) -> bool:
    """Whether the store may hold a file of this key."""
    return not Path(key).is_relative_to(_CACHE)
