"""Training samples of more shards than the disk has room for when decoded: some of them at a time.

Where all fit the limit, they are decoded and mapped as one (``sample_cache``). Else a shard that is
asked for is decoded into a folder of its own, one ``.npy`` file a field, and where the folders
would be more than the limit, those that were used longest ago go. The order in which samples are
asked for does not depend on what is there, so neither does a training.
"""

import os
import shutil
import time
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock
from jaxtyping import Int

from pipeline.artifacts.publishing import published_folder, scratch_beside
from pipeline.artifacts.reading import open_artifact
from pipeline.artifacts.sharding import listed_shards, read_index
from pipeline.errors import ArtifactError, ConfigError
from pipeline.messages.sample_cache import cache_key, cached_split, decode_shards
from pipeline.messages.samples import STORED_AS, read_samples
from pipeline.network.samples import Rows, Samples, join_samples
from schemas.softgrip.v1.grasps_pb2 import ShardEntry

DECODED = "decoded"  # folder of the decoded shards, within the cache
_NAME_LENGTH = 24  # of a digest: enough to tell shards apart
_LEARNED = ("cloud", "cloud_mask", "quality")
MIB = 2**20  # bytes, as the prefix says
# A block of an epoch's order that wraps around begins and ends within a shard, at two places.
_SHARDS_CUT = 3


@dataclass(frozen=True)
class DecodedShard:
    """A shard and where its samples lie once they are decoded.

    Attributes
    ----------
    path
        The shard.
    sha256
        Its content, as the index names it.
    samples
        How many.
    folder
        The decoded files.
    """

    path: Path
    sha256: str
    samples: int
    folder: Path


class BoundedSamples:
    """The samples of a split, read by number; decoded shards take no more disk than their limit.

    Another process gets it by paths: neither samples nor maps travel with it.
    """

    def __init__(self, index: Path, split: str, cache: Path, limit_bytes: int) -> None:
        entries = [entry for entry in read_index(index).shards if entry.split == split]
        if not sum(entry.samples for entry in entries):
            raise ArtifactError("a split holds no samples", "Ask for more grasps or objects.")
        self._shards = [
            DecodedShard(path, e.sha256, e.samples, cache / DECODED / e.sha256[:_NAME_LENGTH])
            for path, e in zip(listed_shards(index, [split]), entries, strict=True)
        ]
        self._starts = np.cumsum([0, *(shard.samples for shard in self._shards)])
        self._index, self._split, self._cache = index, split, cache
        self._digest = cache_key(entries)
        self.limit_bytes = limit_bytes
        self._maps: OrderedDict[int, Rows] = OrderedDict()
        self._whole: Rows | None = None
        self.sample_bytes = sample_bytes(self._shards[0].path)

    def __len__(self) -> int:
        return int(self._starts[-1])

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_maps": OrderedDict(), "_whole": None}

    @property
    def fits(self) -> bool:
        """Whether all decoded shards fit the limit."""
        return len(self) * self.sample_bytes <= self.limit_bytes

    def sha256(self) -> str:
        """Digest of the content of all shards, as hex."""
        return self._digest

    def check_room(self, window: int) -> None:
        """Refuse a limit that the shards of one window do not fit into.

        Parameters
        ----------
        window
            Samples among which an epoch's order is drawn; 0: all.

        Raises
        ------
        ConfigError
            They do not fit.
        """
        largest = max(shard.samples for shard in self._shards)
        wanted = min(len(self), (window or len(self)) + _SHARDS_CUT * largest)
        if wanted * self.sample_bytes > self.limit_bytes:
            raise ConfigError(
                f"{wanted} training samples are drawn from at once and take "
                f"{-(-wanted * self.sample_bytes // MIB)} MiB decoded; "
                f"{max(self.limit_bytes, 0) // MIB} MiB of loading.cache_mib are left for them",
                "Raise loading.cache_mib, or set train.shuffle_window (now "
                f"{window or 'all'}) lower; shards.samples_per_shard lower helps too",
            )

    def rows(self, numbers: Int[np.ndarray, " b"]) -> Rows:
        """Clouds, masks and qualities of some samples.

        Parameters
        ----------
        numbers
            Which, shape (b,); at least one.

        Returns
        -------
        Copies, in the order of the numbers.

        Raises
        ------
        ArtifactError
            A shard is missing, damaged, or not the one that the index names.
        """
        if self.fits:
            self._whole = self._whole or self._mapped_whole()
            return Rows(*(array[numbers] for array in self._whole))
        if np.any(numbers[1:] < numbers[:-1]):
            order = np.argsort(numbers, kind="stable")
            back = np.argsort(order, kind="stable")
            return Rows(*(array[back] for array in self.rows(numbers[order])))
        found: list[np.ndarray] = []
        ends = np.searchsorted(numbers, self._starts)
        for shard in np.flatnonzero(np.diff(ends)).tolist():
            mine, maps = slice(ends[shard], ends[shard + 1]), self._mapped(shard)
            within = numbers[mine] - self._starts[shard]
            if not found:
                found = [np.empty((len(numbers), *a.shape[1:]), a.dtype) for a in maps]
            for array, source in zip(found, maps, strict=True):
                # Clipped, though all lie within: NumPy then copies once, without a buffer.
                np.take(source, within, axis=0, out=array[mine], mode="clip")
        return Rows(*found)

    def first(self, wanted: int) -> Samples:
        """The first samples with all their fields, in memory: as many, or all."""
        parts: list[Samples] = []
        for shard in self._shards:
            with open_artifact(shard.path) as artifact:
                for samples in read_samples(artifact):
                    parts.append(samples)
                    if (more := sum(map(len, parts)) - wanted) >= 0:
                        return join_samples(parts).take(slice(0, wanted if more else None))
        return join_samples(parts)

    def _mapped_whole(self) -> Rows:
        """The maps of all samples, decoded first where needed."""
        shutil.rmtree(self._cache / DECODED, ignore_errors=True)
        all_of_it = cached_split(self._index, self._split, self._cache)
        return plain(all_of_it.cloud, all_of_it.cloud_mask, all_of_it.quality)

    def _mapped(self, number: int) -> Rows:
        """The maps of a shard, decoded first where needed; what was used longest ago goes."""
        if number in self._maps:
            self._maps.move_to_end(number)
            return self._maps[number]
        shard = self._shards[number]
        while True:
            try:
                maps = opened(shard.folder)
                now_ns = time.time_ns()  # finer than what the system itself would note
                os.utime(shard.folder, ns=(now_ns, now_ns))
                break
            except FileNotFoundError:  # not there, or freed by another process just now
                self._decode(number)
        self._maps[number] = maps
        self._forget()
        return maps

    def _forget(self) -> None:
        """Close the maps that are more than the limit: their files may be gone already."""
        sizes = [self._shards[number].samples * self.sample_bytes for number in self._maps]
        while len(self._maps) > 1 and sum(sizes) > self.limit_bytes:
            self._maps.popitem(last=False)
            sizes.pop(0)

    def _decode(self, number: int) -> None:
        """Decode a shard, and free what was used longest ago; one process at a time."""
        shard = self._shards[number]
        shard.folder.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(shard.folder.parent / "lock"):
            if shard.folder.is_dir():
                return
            for whole in self._cache.glob(f"{self._split}-*"):
                shutil.rmtree(whole)
            self._free(self.limit_bytes - shard.samples * self.sample_bytes)
            entry = ShardEntry(sha256=shard.sha256, samples=shard.samples)
            with published_folder(shard.folder) as scratch:
                decode_shards({shard.path: entry}, scratch)

    def _free(self, most_bytes: int) -> None:
        """Remove decoded shards, those used longest ago first, until the rest is no larger."""
        folders = sorted(
            (f for f in self._shards[0].folder.parent.iterdir() if f.is_dir()),
            key=lambda folder: folder.stat().st_mtime_ns,
        )
        sizes = [sum(file.stat().st_size for file in folder.iterdir()) for folder in folders]
        while folders and sum(sizes) > most_bytes:
            gone = scratch_beside(folders[0])
            oldest = folders.pop(0)
            oldest.rename(gone)  # at once, so that nobody opens half of it
            shutil.rmtree(gone)
            sizes.pop(0)
            for number in [n for n in self._maps if self._shards[n].folder == oldest]:
                del self._maps[number]  # a map would keep the disk's room


def opened(folder: Path) -> Rows:
    """The fields that are learned from, of a decoded shard, mapped. May raise FileNotFoundError."""
    cloud, mask, quality = (np.load(folder / f"{name}.npy", mmap_mode="r") for name in _LEARNED)
    return plain(cloud, mask.view(bool), quality)


def plain(*mapped: np.ndarray) -> Rows:
    """Plain arrays over the same memory: indexing a np.memmap itself costs more."""
    return Rows(*map(np.asarray, mapped))


def sample_bytes(shard: Path) -> int:
    """What a sample of a shard takes on the disk when decoded [bytes]."""
    with open_artifact(shard) as artifact:
        samples = next(read_samples(artifact))
    kinds = STORED_AS.items()
    return sum(np.dtype(kind).itemsize * getattr(samples, n)[0].size for n, kind in kinds)


def open_training(
    index: Path, cache: Path, limit_mib: int, window: int
) -> Samples | BoundedSamples:
    """Open the train split within a limit for all decoded samples, held-out ones included.

    Parameters
    ----------
    index
        The index of stage shards.
    cache
        Folder for the decoded files.
    limit_mib
        What they may take [MiB].
    window
        Samples among which an epoch's order is drawn; 0: all.

    Returns
    -------
    All samples, mapped, where the order is drawn among all; else such as are decoded when needed.

    Raises
    ------
    ConfigError
        The limit is too small for the window.
    """
    held_out = sum(entry.samples for entry in read_index(index).shards if entry.split != "train")
    bounded = BoundedSamples(index, "train", cache, limit_mib * MIB)
    bounded.limit_bytes -= held_out * bounded.sample_bytes
    bounded.check_room(window)
    if not window:
        shutil.rmtree(cache / DECODED, ignore_errors=True)
        return cached_split(index, "train", cache)
    return bounded
