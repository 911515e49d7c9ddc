"""From samples to batches: the order of an epoch, each process's part, and reading.

Samples lie decoded in memory-mapped arrays (``messages.sample_cache``), so a batch of any samples
costs a copy of their bytes. An epoch is one permutation of *all* samples, across shards, that
follows from (seed, epoch) alone; it is cut into batches, and each batch into as many parts as there
are processes. Which process or loader worker reads a sample therefore changes nothing, a batch's
number is all that a resumed epoch needs, and no sample is lost or doubled.
"""

import math
import time
from collections.abc import Iterable, Iterator
from typing import TypeVar

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from pipeline.errors import ConfigError
from pipeline.network.samples import GraspTensors

T = TypeVar("T")
RawBatch = tuple[Int[Tensor, " b"], Float[Tensor, "b h w 3"], Bool[Tensor, "b h w"], Tensor]


def batch_count(samples: int, batch_size: int) -> int:
    """Batches of an epoch: as few as hold all samples at no more than ``batch_size`` each."""
    return math.ceil(samples / batch_size)


def epoch_batches(
    samples: int, batch_size: int, rng: np.random.Generator
) -> list[Int[np.ndarray, " _"]]:
    """Indices of each batch of an epoch: a permutation cut into parts of nearly equal size."""
    return np.array_split(rng.permutation(samples), batch_count(samples, batch_size))


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

    def __init__(self, samples: GraspTensors, batches: list[Int[np.ndarray, " _"]]) -> None:
        # Plain arrays over the same memory: indexing a np.memmap itself costs more.
        self._cloud, self._mask = np.asarray(samples.cloud), np.asarray(samples.mask)
        self._quality = np.asarray(samples.quality, dtype=np.float32)
        self._batches = batches

    def __len__(self) -> int:
        return len(self._batches)

    def __getitem__(self, number: int) -> RawBatch:
        indices = self._batches[number]
        return (
            torch.from_numpy(indices),
            torch.from_numpy(self._cloud[indices]),
            torch.from_numpy(self._mask[indices]),
            torch.from_numpy(self._quality[indices]),
        )


def load_batches(
    samples: GraspTensors, batches: list[Int[np.ndarray, " _"]], workers: int, pinned: bool
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
    )


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
