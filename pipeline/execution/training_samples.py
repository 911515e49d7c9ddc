"""What a training reads: the train split within its limit, what was tried, and who reads ahead."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from loguru import logger

from pipeline.config import RunConfig
from pipeline.errors import ConfigError
from pipeline.messages.attempts import read_attempts, tried_contacts
from pipeline.messages.bounded_samples import open_training
from pipeline.network.loading import SHARED_MEMORY, readers_with_room
from pipeline.network.outcomes import outcome_samples, with_outcomes
from pipeline.network.samples import GraspTensors, SampleReader, Samples


@dataclass(frozen=True)
class TrainingSet:
    """The samples of a training.

    Attributes
    ----------
    learned
        What the network learns from, tried contacts included.
    fitted
        What the baselines are fitted to: the train split, or where that does not fit its first
        samples, as many as a window; shards are shuffled.
    count
        Samples of the train split.
    """

    learned: SampleReader
    fitted: Samples
    count: int


def open_training_set(
    config: RunConfig, index: Path, cache: Path, attempts: Sequence[Path]
) -> TrainingSet:
    """Open the train split and, where ``train.attempts`` names some, what was tried.

    Parameters
    ----------
    config
        The run's configuration.
    index
        The index of stage shards.
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
        Decoded samples do not fit their limit, or attempts are asked for beside a window.
    """
    window = config.train.shuffle_window
    if attempts and window:
        raise ConfigError(
            "tried contacts are trained on only where all samples are drawn among",
            "Set train.shuffle_window = 0, or leave train.attempts out",
        )
    samples = open_training(index, cache, config.loading.cache_mib, window)
    if not isinstance(samples, Samples):
        first = samples.first(window)
        first.tensors  # noqa: B018 - refuses samples that no training can use
        return TrainingSet(samples, first, len(samples))
    learned = with_tried(samples, config, attempts) if attempts else samples.tensors
    return TrainingSet(learned, samples, len(samples))


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
