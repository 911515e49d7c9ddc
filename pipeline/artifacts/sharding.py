"""Artifacts of many files: names of shards, which of them are current, and their index."""

from collections.abc import Iterable
from pathlib import Path, PurePosixPath

import numpy as np

from pipeline.artifacts.provenance import Provenance
from pipeline.artifacts.publishing import file_sha256
from pipeline.artifacts.reading import open_artifact, read_provenance
from pipeline.artifacts.tensors import to_tensor
from pipeline.artifacts.writing import ArtifactWriter
from pipeline.errors import ArtifactError
from schemas.softgrip.v1.grasps_pb2 import ShardEntry, ShardIndex

INDEX_TOPIC = "/index"


def shard_path(folder: Path, index: int, count: int) -> Path:
    """``<folder>/<nnnnn>-of-<nnnnn>.mcap``."""
    return folder / f"{index:05d}-of-{count:05d}.mcap"


def is_current(path: Path, key: str) -> bool:
    """Whether a shard exists, can be read, and carries this key."""
    if not path.is_file():
        return False
    try:
        return read_provenance(path).key == key
    except ArtifactError:
        return False  # damaged or of another version: made again


def shard_entry(path: Path, relative_to: Path, samples: int, split: str) -> ShardEntry:
    """The index entry of one shard: path below ``relative_to``, digest, samples and split."""
    name = path.relative_to(relative_to).as_posix()
    return ShardEntry(path=name, sha256=file_sha256(path), samples=samples, split=split)


def write_index(
    path: Path, provenance: Provenance, entries: list[ShardEntry], quality_histogram: np.ndarray
) -> None:
    """Publish the index last, and clear the folder of shards it does not name."""
    remove_unnamed(path, entries)
    with ArtifactWriter(path, provenance) as artifact:
        artifact.write(INDEX_TOPIC, index_message(entries, quality_histogram), log_time_ns=0)


def remove_unnamed(path: Path, entries: list[ShardEntry]) -> None:
    """Remove shards of an index's folder that it does not name."""
    named = {path.parent / entry.path for entry in entries}
    for stray in sorted(path.with_suffix("").rglob("*.mcap")):
        if stray not in named:
            stray.unlink()


def index_message(entries: list[ShardEntry], quality_histogram: np.ndarray) -> ShardIndex:
    """The index of some shards, with their samples by tenth of q where these are counted."""
    return ShardIndex(
        shards=entries,
        samples=sum(entry.samples for entry in entries),
        quality_histogram=to_tensor(quality_histogram.astype(np.int64)),
    )


def read_index(path: Path) -> ShardIndex:
    """The index of a sharded artifact."""
    with open_artifact(path) as artifact:
        return artifact.one(ShardIndex)


def listed_shards(path: Path, splits: Iterable[str] = ("train", "val", "test")) -> list[Path]:
    """The shards of some splits, in the index's order.

    Parameters
    ----------
    path
        The index.
    splits
        Names of the splits wanted.

    Returns
    -------
    Paths of the shards.

    Raises
    ------
    ArtifactError
        A wanted shard is missing, or a name in the index leads out of the folder.
    """
    wanted = set(splits)
    return [shard_of(path, entry) for entry in read_index(path).shards if entry.split in wanted]


def place_of(index: Path, entry: ShardEntry) -> Path:
    """Where the shard of an entry of an index lies, whether it is there or not.

    Parameters
    ----------
    index
        The index.
    entry
        What it says of the shard.

    Returns
    -------
    The file, within the index's folder.

    Raises
    ------
    ArtifactError
        The name leads out of that folder, or a link on its way does: what is kept of a run, sealed
        or sent elsewhere, would lack the shard.
    """
    named = PurePosixPath(entry.path)
    if named.is_absolute() or ".." in named.parts:
        raise ArtifactError(
            f"{index} names '{entry.path}', which leads out of its folder",
            "The index is damaged: make it again",
        )
    shard = index.parent / named
    if not shard.resolve().is_relative_to(index.parent.resolve()):
        raise ArtifactError(
            f"{shard} is reached by a link that leads out of {index.parent}",
            "Link the whole folder of the run instead, or move the files there",
        )
    return shard


def shard_of(index: Path, entry: ShardEntry) -> Path:
    """The shard of an entry of an index. Raises ArtifactError as `listed_shards` does."""
    shard = place_of(index, entry)
    if not shard.is_file():
        raise ArtifactError(
            f"{shard} is missing, though {index} names it",
            "Run the stage that makes it again: it makes the missing shard alone",
        )
    return shard
