"""Training samples decoded once: shards in sequence → memory-mapped arrays, keyed by content.

An MCAP is read from its beginning to its end and never at random. So the shards of a split are
decoded once into one plain ``.npy`` file a field, in a folder named by the shards' SHA-256; from
then on any sample costs a copy of its bytes, and what is not used is not in memory. Other shards
are another folder; folders of shards that are no more are removed.
"""

import hashlib
import os
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from filelock import FileLock

from pipeline.artifacts.publishing import file_sha256, published_folder, write_error
from pipeline.artifacts.reading import open_artifact
from pipeline.artifacts.sharding import listed_shards, read_index, shard_of
from pipeline.errors import ArtifactError
from pipeline.messages.samples import STORED_AS, read_samples
from pipeline.network.samples import Samples, join_samples
from schemas.softgrip.v1.grasps_pb2 import ShardEntry

# Rises whenever the files of a cache change: one of another version is made again.
CACHE_VERSION = 2
_KEY_LENGTH = 24


def cached_split(index: Path, split: str, cache: Path) -> Samples:
    """All samples of a split, in shard order, mapped from the cache; decoded first where needed.

    Several processes may ask at once: one decodes, the others wait.

    Parameters
    ----------
    index
        The index of a sharded artifact.
    split
        Such as ``train``.
    cache
        Folder for the decoded files.

    Returns
    -------
    The samples, mapped: what is not used is not in memory.

    Raises
    ------
    ArtifactError
        a shard is missing, damaged, or not the one that the index names; or the split is empty.
    """
    entries = _entries(index, split)
    folder = cache / f"{split}-{cache_key(entries)}"
    cache.mkdir(parents=True, exist_ok=True)
    with FileLock(cache / f"{split}.lock"):
        if not folder.is_dir():
            shards = _files(index, split, entries)
            for left in cache.glob(f".{split}*part"):  # of one killed: this one holds the lock
                shutil.rmtree(left, ignore_errors=True)
            with published_folder(folder) as scratch:
                decode_shards(shards, scratch)
                for older in cache.glob(f"{split}-*"):
                    shutil.rmtree(older)
    return mapped_samples(folder)


def read_parts(index: Path, split: str) -> Iterator[Samples]:
    """The samples of a split in shard order, a message in memory at a time.

    Parameters
    ----------
    index
        The index of a sharded artifact.
    split
        Such as ``val``.

    Yields
    ------
    Samples
        Those of the next message.

    Raises
    ------
    ArtifactError
        A shard is missing, damaged, or not the one that the index names.
    """
    yield from _parts(_files(index, split, _entries(index, split)))


def first_samples(index: Path, split: str, wanted: int) -> Samples:
    """The first samples of a split, or all where there are no more, in memory.

    Parameters
    ----------
    index
        The index of a sharded artifact.
    split
        Such as ``train``.
    wanted
        How many; at least one.

    Returns
    -------
    The samples, of no more shards than hold them.

    Raises
    ------
    ArtifactError
        A shard is missing, damaged, or not the one that the index names; or the split is empty.
    """
    parts: list[Samples] = []
    found = 0
    for part in _parts(first_shards(index, split, wanted)):
        parts.append(part.take(slice(0, wanted - found)))
        found += len(parts[-1])
        if found == wanted:
            break
    if not found:
        raise _empty_split()
    return join_samples(parts)


def first_shards(index: Path, split: str, wanted: int) -> dict[Path, ShardEntry]:
    """The shards that hold the first samples of a split, each with what the index says of it.

    Raises ArtifactError where one of them is missing; the others need not be there.
    """
    needed, found = {}, 0
    for entry in _entries(index, split):
        if found < wanted:
            needed[shard_of(index, entry)] = entry
        found += entry.samples
    return needed


def cache_key(entries: Iterable[ShardEntry]) -> str:
    """What the decoded files depend on: the content of every shard, in order."""
    digest = hashlib.sha256(str(CACHE_VERSION).encode())
    for entry in entries:
        digest.update(f"{entry.sha256} {entry.samples}\n".encode())
    return digest.hexdigest()[:_KEY_LENGTH]


def decode_shards(shards: dict[Path, ShardEntry], into: Path) -> None:
    """Read shards one after another, a message in memory at a time, into a file a field.

    Parameters
    ----------
    shards
        File → what the index says of it.
    into
        Folder that gets the files.
    """
    count = sum(entry.samples for entry in shards.values())
    arrays: dict[str, np.memmap] = {}
    filled = 0
    for part in _parts(shards):
        for name, dtype in STORED_AS.items():
            found = getattr(part, name)
            if name not in arrays:
                arrays[name] = np.lib.format.open_memmap(
                    into / f"{name}.npy", "w+", dtype=dtype, shape=(count, *found.shape[1:])
                )
                _reserve(into / f"{name}.npy")
            arrays[name][filled : filled + len(part)] = found
        filled += len(part)
    if not filled:
        raise _empty_split()
    for array in arrays.values():
        array.flush()


def _reserve(path: Path) -> None:
    """Take the disk's room for a file now: a map that meets a full disk ends the process.

    Parameters
    ----------
    path
        A file of its final length, still without blocks on the disk.

    Raises
    ------
    ArtifactError
        There is not enough.
    """
    try:
        with path.open("rb+") as file:
            os.posix_fallocate(file.fileno(), 0, path.stat().st_size)
    except OSError as error:
        raise write_error(path, error) from error


def mapped_samples(folder: Path) -> Samples:
    """The samples of a folder of decoded fields, mapped; writing to them changes no file."""
    arrays = {name: np.load(folder / f"{name}.npy", mmap_mode="c") for name in STORED_AS}
    arrays["cloud_mask"] = arrays["cloud_mask"].view(bool)
    return Samples(**arrays)


def _entries(index: Path, split: str) -> list[ShardEntry]:
    """What the index says of the shards of a split."""
    return [entry for entry in read_index(index).shards if entry.split == split]


def _files(index: Path, split: str, entries: list[ShardEntry]) -> dict[Path, ShardEntry]:
    """The shards of a split, all of them there, beside what the index says of each."""
    return dict(zip(listed_shards(index, [split]), entries, strict=True))


def _empty_split() -> ArtifactError:
    return ArtifactError("a split holds no samples", "Ask for more grasps or objects.")


def _parts(shards: dict[Path, ShardEntry]) -> Iterator[Samples]:
    for path, entry in shards.items():
        if file_sha256(path) != entry.sha256:
            raise ArtifactError(
                f"{path} is not the shard that its index names",
                "Delete it and run 'make shards' again",
            )
        with open_artifact(path) as artifact:
            yield from read_samples(artifact)
