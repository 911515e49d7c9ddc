"""Whether the disk has room for what is about to be written, told before work begins."""

import shutil
from pathlib import Path

from pipeline.errors import ArtifactError

_MIB = 2**20  # bytes, as the prefix says


def require_room(folder: Path, needed_bytes: int, work: str) -> None:
    """Refuse work that the disk has no room for.

    Parameters
    ----------
    folder
        Where the files will lie; it exists.
    needed_bytes
        What they take at the most at one time [bytes].
    work
        What is about to be done, in words.

    Raises
    ------
    ArtifactError
        Less is free.
    """
    free_bytes = shutil.disk_usage(folder).free
    if free_bytes < needed_bytes:
        raise ArtifactError(
            f"{work} takes up to {-(-needed_bytes // _MIB)} MiB in {folder}, and the disk is full "
            f"but for {free_bytes // _MIB} MiB",
            "Free some space, for example by 'make prune', and run the same command again; "
            "finished shards are kept",
        )
