"""From samples to batches: the order of an epoch, each process's part, and reading.

Samples lie decoded in memory-mapped arrays (``messages.sample_cache``), so a batch of any samples
costs a copy of their bytes. An epoch is one permutation of *all* samples, across shards, that
follows from (seed, epoch) alone; it is cut into batches, and each batch into as many parts as there
are processes. Which process or loader worker reads a sample therefore changes nothing, a batch's
number is all that a resumed epoch needs, and no sample is lost or doubled.

Where not all decoded samples fit (``messages.bounded_samples``), the permutation is of blocks of
neighbouring samples, and within each block. Shards are shuffled themselves, so a block is already a
random part of all.
"""

import math
import shutil
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from pipeline.errors import ConfigError
from pipeline.network.mapped_parts import MappedPart, mapped_part
from pipeline.network.samples import GraspTensors, Rows, SampleReader

T = TypeVar("T")
StartMethod = Literal["fork", "spawn", "forkserver"]
SHARED_MEMORY = Path("/dev/shm")
BATCHES_AHEAD = 2  # of each reader, as PyTorch's loader has it
RawBatch = tuple[Int[Tensor, " b"], Float[Tensor, "b h w 3"], Bool[Tensor, "b h w"], Tensor]


def batch_count(samples: int, batch_size: int) -> int:
    """Batches of an epoch: as few as hold all samples at no more than ``batch_size`` each."""
    return math.ceil(samples / batch_size)


def epoch_batches(
    samples: int, batch_size: int, rng: np.random.Generator, window: int = 0
) -> list[Int[np.ndarray, " _"]]:
    """Indices of each batch of an epoch: its order cut into parts of nearly equal size."""
    order = epoch_order(samples, window, rng)
    return np.array_split(order, batch_count(samples, batch_size))


def epoch_order(samples: int, window: int, rng: np.random.Generator) -> Int[np.ndarray, " samples"]:
    """The order of an epoch's samples.

    Parameters
    ----------
    samples
        How many there are.
    window
        Most neighbouring samples that are permuted together; 0: all.
    rng
        Of the epoch.

    Returns
    -------
    Numbers of the samples. Blocks begin at a drawn sample, so those of another epoch are others.
    """
    if not window or window >= samples:
        return rng.permutation(samples)
    in_turn = (rng.integers(samples) + np.arange(samples)) % samples
    blocks = np.array_split(in_turn, -(-samples // window))
    drawn = rng.permutation(len(blocks))
    return np.concatenate([rng.permutation(blocks[block]) for block in drawn])


def part_of_rank(
    batches: list[Int[np.ndarray, " _"]], rank: int, ranks: int
) -> list[Int[np.ndarray, " _"]]:
    """The samples that one of several processes reads of each batch, in the order of the file.

    Parameters
    ----------
    batches
        Indices of the samples of each batch.
    rank
        Number of the process.
    ranks
        Number of processes.

    Returns
    -------
    Sorted indices for each batch.

    Raises
    ------
    ConfigError
        A batch has fewer samples than there are processes.
    """
    smallest = min(len(batch) for batch in batches)
    if smallest < ranks:
        raise ConfigError(
            f"batches of {smallest} samples cannot be divided among {ranks} processes",
            "Start fewer processes, or raise train.batch_size.",
        )
    return [np.sort(np.array_split(batch, ranks)[rank]) for batch in batches]


class SampleBatches(Dataset[RawBatch]):
    """Item k: indices, clouds, masks and qualities of the samples ``batches[k]``."""

    def __init__(self, samples: SampleReader, batches: list[Int[np.ndarray, " _"]]) -> None:
        self._samples = MappedRows(samples) if isinstance(samples, GraspTensors) else samples
        self._batches = batches

    def __len__(self) -> int:
        return len(self._batches)

    def __getitem__(self, number: int) -> RawBatch:
        indices = self._batches[number]
        cloud, mask, quality = self._samples.rows(indices)
        return (
            torch.from_numpy(indices),
            torch.from_numpy(cloud),
            torch.from_numpy(mask),
            torch.from_numpy(np.asarray(quality, dtype=np.float32)),
        )


class MappedRows:
    """Samples of mapped files; another process maps the files itself."""

    def __init__(self, samples: GraspTensors) -> None:
        self._arrays: tuple[np.ndarray, ...] = (samples.cloud, samples.mask, samples.quality)
        self._map()

    def rows(self, numbers: Int[np.ndarray, " b"]) -> Rows:
        """Copies of some samples, in the order of their numbers."""
        return Rows(*(array[numbers] for array in self._plain))

    def _map(self) -> None:
        # Plain arrays over the same memory: indexing a np.memmap itself costs more.
        self._plain = tuple(np.asarray(array) for array in self._arrays)

    def __getstate__(self) -> list[MappedPart | np.ndarray]:
        return [mapped_part(array) or array for array in self._arrays]

    def __setstate__(self, state: list[MappedPart | np.ndarray]) -> None:
        self._arrays = tuple(p.opened() if isinstance(p, MappedPart) else p for p in state)
        self._map()


def load_batches(
    samples: SampleReader,
    batches: list[Int[np.ndarray, " _"]],
    workers: int,
    pinned: bool,
    start_method: StartMethod | None = None,
) -> Iterator[RawBatch]:
    """Read the batches in order, in this process or ahead of it in others.

    Parameters
    ----------
    samples
        The samples.
    batches
        Indices of the samples of each batch.
    workers
        Processes that read ahead; 0: this one reads.
    pinned
        Whether batches are put in memory that a GPU copies from fastest.
    start_method
        How processes are started; None: as Python does on this system.

    Yields
    ------
    RawBatch
        Indices, clouds, masks and qualities of each batch.
    """
    items = SampleBatches(samples, batches)
    if not workers and not pinned:
        yield from map(items.__getitem__, range(len(items)))
        return
    yield from DataLoader(
        items,
        batch_size=None,  # a batch is an item: it is gathered at once, not sample by sample
        num_workers=workers,
        pin_memory=pinned,
        generator=torch.Generator(),  # the global one stays as it is
        multiprocessing_context=start_method if workers else None,
    )


def readers_with_room(workers: int, batch_bytes: int) -> int:
    """Processes that may read ahead: none where the system's shared memory cannot hold batches.

    They hand batches over in it, and one that finds it full is ended by the system without a word.

    Parameters
    ----------
    workers
        Processes that are wanted.
    batch_bytes
        Of a batch as it is read [bytes].

    Returns
    -------
    As many as wanted, or 0.
    """
    needed = workers * (BATCHES_AHEAD + 1) * batch_bytes
    return workers if shutil.disk_usage(SHARED_MEMORY).free >= needed else 0


class WaitClock:
    """Seconds that a loop waits for its items, and seconds that it works on them."""

    def __init__(self) -> None:
        self.waiting_s = 0.0
        self.working_s = 0.0

    def watch(self, items: Iterable[T]) -> Iterator[T]:
        """Yield the items, adding up the time before and after each."""
        iterator = iter(items)
        asked = time.perf_counter()
        for item in iterator:
            given = time.perf_counter()
            self.waiting_s += given - asked
            yield item
            asked = time.perf_counter()
            self.working_s += asked - given

    def share_of(self, seconds: float) -> float | None:
        """``seconds`` over all time, waiting and working; None before the first item."""
        total = self.waiting_s + self.working_s
        return seconds / total if total else None
