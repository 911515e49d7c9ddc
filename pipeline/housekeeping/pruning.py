"""What of a run can be made again from the rest of it, and freed.

Kept: artifacts, shards, recordings, summaries, pages, run.toml and what lies beside it. Freed: the
unpacked copy of the shards that training reads, tables that questions were asked of, resume points
of stages that are finished, exports.
Folders that all runs share (`runs/.cache`) are never touched, nor is a run that a process works in.
"""

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock, Timeout

from pipeline.asking.cache import QUERY_CACHE
from pipeline.execution.running import read_summary
from pipeline.execution.stage import RunFolder
from pipeline.execution.staleness import built_key
from pipeline.housekeeping.listing import disk_use_bytes

UNPACKED_SAMPLES = "samples"  # in the run's state
EXPORTS = "export"


@dataclass(frozen=True)
class Freeable:
    """A folder that can be made again.

    Attributes
    ----------
    path
        The folder.
    size_bytes
        What its files hold [bytes].
    again_by
        What makes it again, in words.
    """

    path: Path
    size_bytes: int
    again_by: str


def freeable(folder: RunFolder, stages: tuple[str, ...]) -> list[Freeable]:
    """Folders of a run that can be made again.

    Parameters
    ----------
    folder
        The run.
    stages
        Names of all stages.

    Returns
    -------
    What can be freed; resume points of a stage that is not finished are not.
    """
    found = [
        *_unpacked_samples(folder),
        (folder.state(QUERY_CACHE), "make query, from the artifacts"),
        *(
            (folder.state(stage), f"not needed: {stage} is finished")
            for stage in stages
            if is_finished(folder, stage)
        ),
        *_exports(folder),
    ]
    present = ((path, disk_use_bytes(path), by) for path, by in found if path.is_dir())
    return [Freeable(path, size, by) for path, size, by in present if size > 0]


def _unpacked_samples(folder: RunFolder) -> Iterator[tuple[Path, str]]:
    """The copy that training maps into memory, where the shards that it was unpacked from are."""
    if folder.artifact("shards").is_file():
        yield folder.state(UNPACKED_SAMPLES), "make train, from the shards"


def _exports(folder: RunFolder) -> Iterator[tuple[Path, str]]:
    exports = folder.path / EXPORTS
    if exports.is_dir():
        for path in sorted(exports.iterdir()):
            yield path, f"make export FORMAT={path.name}"


def is_finished(folder: RunFolder, stage: str) -> bool:
    """Whether a stage's artifact is whole and its summary tells of this very artifact.

    A stage that is being made anew over an older artifact has resume points that are of use, but it
    has then changed its key file since: what the key file asks for is not what was built.

    Parameters
    ----------
    folder
        The run.
    stage
        Name of the stage.

    Returns
    -------
    False where the artifact is missing, damaged or about to be replaced.
    """
    built = built_key(folder, stage)
    if built is None or read_summary(folder, stage).get("key") != built.digest:
        return False
    asked = folder.state(f"{stage}.key")
    return not asked.is_file() or asked.read_text().startswith(built.to_json())


def free(folder: RunFolder, stages: tuple[str, ...]) -> list[Freeable]:
    """Delete what can be made again, unless a process works in the run.

    Parameters
    ----------
    folder
        The run.
    stages
        Names of all stages.

    Returns
    -------
    What was freed; empty where a process works in the run.
    """
    if not folder.state("").is_dir():
        return [_deleted(item) for item in freeable(folder, stages)]
    lock = FileLock(folder.state("lock"))
    try:
        lock.acquire(timeout=0)
    except Timeout:
        return []
    try:
        return [_deleted(item) for item in freeable(folder, stages)]
    finally:
        lock.release()


def in_use(folder: RunFolder) -> bool:
    """Whether a process works in a run."""
    if not folder.state("lock").is_file():
        return False
    lock = FileLock(folder.state("lock"))
    try:
        lock.acquire(timeout=0)
    except Timeout:
        return True
    lock.release()
    return False


def _deleted(item: Freeable) -> Freeable:
    shutil.rmtree(item.path)
    return item
