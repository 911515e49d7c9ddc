"""What a training reads: the train split within its limit, what was tried, and who reads ahead."""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from loguru import logger

from pipeline.artifacts.sharding import read_index
from pipeline.config import RunConfig
from pipeline.errors import ConfigError
from pipeline.messages.attempts import read_attempts, tried_contacts
from pipeline.messages.bounded_samples import MIB, BoundedSamples, open_training
from pipeline.messages.sample_cache import cached_split
from pipeline.network.joined_samples import JoinedSamples
from pipeline.network.loading import SHARED_MEMORY, readers_with_room
from pipeline.network.outcomes import outcome_samples, with_outcomes
from pipeline.network.samples import GraspTensors, SampleReader, Samples

FURTHER = "further"  # begins the names of the folders of further runs' decoded samples


@dataclass(frozen=True)
class TrainingSet:
    """The samples of a training.

    Attributes
    ----------
    learned
        What the network learns from, further runs' samples and tried contacts included.
    fitted
        What the baselines are fitted to: the run's own train split, or where that does not fit its
        first samples, as many as a window; shards are shuffled.
    count
        Samples of the train splits.
    """

    learned: SampleReader
    fitted: Samples
    count: int


def open_training_set(
    config: RunConfig, indices: Sequence[Path], cache: Path, attempts: Sequence[Path]
) -> TrainingSet:
    """Open the train split, those of further runs, and what was tried (``train.attempts``).

    Parameters
    ----------
    config
        The run's configuration.
    indices
        The index of stage shards, of this run first.
    cache
        Folder of decoded samples.
    attempts
        Files of attempts.

    Returns
    -------
    The samples.

    Raises
    ------
    ConfigError
        Decoded samples do not fit their limit.
    ArtifactError
        A shard is missing or damaged, or the runs' clouds have other grids.
    """
    window, limit_mib = config.train.shuffle_window, config.loading.cache_mib
    caches = [cache / f"{FURTHER}-{number}" for number in range(1, len(indices))]
    for left in set(cache.glob(f"{FURTHER}-*")) - set(caches):
        shutil.rmtree(left, ignore_errors=True)  # another rank may remove it too
    if caches:
        check_room_for_all(indices, cache, limit_mib)
    samples = open_training(indices[0], cache, limit_mib, window)
    if not isinstance(samples, Samples):
        first = samples.first(window)
        first.tensors  # noqa: B018 - refuses samples that no training can use
        return TrainingSet(samples, first, len(samples))
    learned = with_tried(samples, config, attempts) if attempts else samples.tensors
    if not caches:
        return TrainingSet(learned, samples, len(samples))
    further = [
        cached_split(index, "train", own).tensors
        for index, own in zip(indices[1:], caches, strict=True)
    ]
    count = len(samples) + sum(map(len, further))
    return TrainingSet(JoinedSamples([learned, *further]), samples, count)


def check_room_for_all(indices: Sequence[Path], cache: Path, limit_mib: int) -> None:
    """Refuse a limit that all runs' training samples and the held-out ones do not fit into.

    Parameters
    ----------
    indices
        The index of stage shards, of this run first, whose held-out samples are decoded too.
    cache
        Folder of decoded samples.
    limit_mib
        ``loading.cache_mib``.

    Raises
    ------
    ConfigError
        They do not fit.
    """
    opened = [BoundedSamples(index, "train", cache, limit_mib * MIB) for index in indices]
    held_out = sum(one.samples for one in read_index(indices[0]).shards if one.split != "train")
    needed = sum(len(one) * one.sample_bytes for one in opened) + held_out * opened[0].sample_bytes
    if needed > limit_mib * MIB:
        raise ConfigError(
            f"samples of {len(indices)} runs take {-(-needed // MIB)} MiB decoded, and "
            f"loading.cache_mib is {limit_mib}",
            "Raise it, or name fewer runs in train.further_runs",
        )


def with_tried(samples: Samples, config: RunConfig, attempts: Sequence[Path]) -> GraspTensors:
    """The train split, and behind it what logged attempts lifted and what not."""
    wanted = config.train
    tried = tried_contacts(read_attempts(list(attempts)))
    outcomes = outcome_samples(tried, samples.quality, wanted.attempt_good_quality)
    logger.info(
        "train: {} tried contacts, of which {} lifted, {} times each beside {} samples",
        len(outcomes),
        int(tried.lifted.sum()),
        wanted.attempt_repeats,
        len(samples),
    )
    return with_outcomes(samples.tensors, outcomes, wanted.attempt_repeats)


def readers_ahead(wanted: int, batch_size: int, samples: Samples) -> int:
    """Processes that may read batches ahead: those wanted, or none, which is told.

    Parameters
    ----------
    wanted
        How many.
    batch_size
        Samples of a batch.
    samples
        Some of its kind.

    Returns
    -------
    How many may.
    """
    batch_bytes = batch_size * (samples.cloud[0].nbytes + samples.cloud_mask[0].nbytes)
    readers = readers_with_room(wanted, batch_bytes)
    if readers < wanted:
        logger.warning(
            "train: {} is too small for processes that read ahead, so this one reads itself and "
            "may wait for it. Enlarge it, for example by docker run --shm-size=1g",
            SHARED_MEMORY,
        )
    return readers
