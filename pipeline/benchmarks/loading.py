"""Batches for training: what the loader gives a second, against raw memory maps and other formats.

The loader's first pass decodes MCAP shards in sequence; every epoch then gathers shuffled batches
from the decoded files. Peers are read as they read fastest, in sequence, and hold the same tensors,
uncompressed all.
"""

import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from jaxtyping import Int

from pipeline.artifacts.sharding import shard_entry, shard_path, write_index
from pipeline.benchmarks.clock import seconds_of
from pipeline.benchmarks.storage import BATCH, FORMATS, PROVENANCE, write_mcap
from pipeline.messages.bounded_samples import BoundedSamples
from pipeline.messages.sample_cache import cached_split
from pipeline.messages.samples import STORED_AS
from pipeline.network.loading import epoch_batches, load_batches
from pipeline.network.samples import GraspTensors, Samples

SHARDS = 4  # enough that readers work side by side
WINDOWS = 8  # of an epoch: each lies within three of the shards
REPEATS, EPOCHS = 5, 30  # enough for a median, in seconds
PEERS = ("hdf5", "zarr", "webdataset")


def figures(samples: Samples) -> dict[str, object]:
    """Training's loader against raw memory maps and against other formats: rates and ratios."""
    with tempfile.TemporaryDirectory() as scratch:
        rates = rates_mb_s(samples, Path(scratch))
    return {
        "loader_mb_s": {name: round(rate) for name, rate in rates.items()},
        "loader_vs_memory_map": round(rates["epoch"] / rates["memory_map"], 2),
        "windowed_vs_mapped": round(rates["windowed"] / rates["epoch"], 2),
        "loader_vs": {name: round(rates["epoch"] / rates[name], 2) for name in PEERS},
        "first_pass_vs": {name: round(rates["first_pass"] / rates[name], 2) for name in PEERS},
    }


def rates_mb_s(samples: Samples, folder: Path) -> dict[str, float]:
    """MB/s of the loader's first pass and epochs, of a memory map and of the peers, in one call."""
    index = write_shards(samples, folder)
    cache = folder / "cache"
    stored = sum(getattr(samples, name).astype(dtype).nbytes for name, dtype in STORED_AS.items())
    first_pass = seconds_of(lambda: cached_split(index, "train", cache), 1)
    mapped = cached_split(index, "train", cache)
    given = GraspTensors(mapped.cloud, mapped.cloud_mask, mapped.quality)
    batches = sorted_batches(len(given), window=0)
    learned = given.cloud.nbytes + given.mask.nbytes + given.quality.nbytes

    bounded = BoundedSamples(index, "train", folder / "bounded", limit_bytes=2 * stored)
    in_windows = sorted_batches(len(given), len(given) // WINDOWS)
    exhaust(load_batches(bounded, in_windows, workers=0, pinned=False))  # decoded
    beyond = BoundedSamples(index, "train", folder / "beyond", limit_bytes=int(0.9 * stored))
    beyond.check_room(len(given) // WINDOWS)
    decoding = seconds_of(
        lambda: exhaust(load_batches(beyond, in_windows, workers=0, pinned=False)), 1
    )

    maps = [np.load(path, mmap_mode="r") for path in decoded_files(cache)]
    ways = {
        "epoch": lambda: exhaust(load_batches(given, batches, workers=0, pinned=False)),
        "windowed": lambda: exhaust(load_batches(bounded, in_windows, workers=0, pinned=False)),
        "memory_map": lambda: exhaust([array[rows] for array in maps] for rows in batches),
    }
    # By turns, so that what else the machine does falls on both.
    laps = [{name: seconds_of(way, 1) for name, way in ways.items()} for _ in range(EPOCHS)]
    seconds = {name: min(lap[name] for lap in laps) for name in ways}
    rates = {name: learned / 1e6 / taken for name, taken in seconds.items()}
    rates["beyond_cache"] = learned / 1e6 / decoding
    rates["first_pass"] = stored / 1e6 / first_pass
    parts = [samples.take(slice(at, at + BATCH)) for at in range(0, len(samples), BATCH)]
    for name in PEERS:
        write, read = FORMATS[name]
        path = folder / name
        write(path, parts)
        taken = seconds_of(lambda r=read, p=path: exhaust(r(p)), REPEATS)  # type: ignore[misc]
        rates[name] = stored / 1e6 / taken
    return rates


def sorted_batches(samples: int, window: int) -> list[Int[np.ndarray, " _"]]:
    """The batches of an epoch, each in the order of the file."""
    batches = epoch_batches(samples, BATCH, np.random.default_rng(0), window)
    return [np.sort(batch) for batch in batches]


def exhaust(batches: Iterable[object]) -> None:
    """Take every batch; each is kept until the next one is there, as in training."""
    for _ in batches:
        pass


def write_shards(samples: Samples, folder: Path) -> Path:
    """The samples as an index over a few shards, as the shards stage leaves them."""
    index, entries = folder / "shards.mcap", []
    for number, rows in enumerate(np.array_split(np.arange(len(samples)), SHARDS)):
        path = shard_path(folder / "shards", number, SHARDS)
        part = samples.take(slice(int(rows[0]), int(rows[-1]) + 1))
        write_mcap(path, [part.take(slice(at, at + BATCH)) for at in range(0, len(part), BATCH)])
        entries.append(shard_entry(path, folder, len(part), "train"))
    write_index(index, PROVENANCE, entries, np.zeros(10))
    return index


def decoded_files(cache: Path) -> list[Path]:
    """The decoded fields that training reads."""
    (folder,) = cache.glob("train-*")
    return [folder / f"{name}.npy" for name in ("cloud", "cloud_mask", "quality")]
