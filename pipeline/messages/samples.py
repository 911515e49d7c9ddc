"""Training samples ↔ softgrip.v1.SampleBatch and CloudBatch."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Integer

from pipeline.artifacts.reading import Artifact, open_artifact
from pipeline.artifacts.sharding import listed_shards
from pipeline.artifacts.tensors import set_tensors, tensors_of
from pipeline.artifacts.writing import ArtifactWriter
from pipeline.messages.clouds import (
    INLINE_STORED_AS,
    cloud_batch,
    clouds_beside,
    with_clouds,
    write_apart,
)
from pipeline.network.samples import Samples, join_samples
from schemas.softgrip.v1.clouds_pb2 import CloudBatch
from schemas.softgrip.v1.samples_pb2 import SampleBatch

TOPIC = "/samples"
ROWS_STORED_AS = {
    "quality": "f4",
    "object_index": "u2",
    "shape_class": "u1",
    "level": "u1",
    "pressure": "f4",
    "proposal_weight": "f4",
    "pictures": "u1",
}
SHAPES = dict.fromkeys(ROWS_STORED_AS, "n")
# What a sample's fields are once they are read, clouds included.
STORED_AS = {**INLINE_STORED_AS, **ROWS_STORED_AS}
# What the fields hold that v1 did not have from the start.
UNLESS_THERE = {"proposal_weight": math.nan, "pictures": 1}


def write_samples(
    artifact: ArtifactWriter,
    samples: Samples,
    object_names: tuple[str, ...],
    size: int,
    first: int = 0,
) -> None:
    """Write samples, and apart from them their clouds.

    Clouds lie in steps where that loses nothing, as it does where stage grasps rounded them.

    Parameters
    ----------
    artifact
        The shard.
    samples
        All its samples.
    object_names
        What their ``object_index`` points into.
    size
        Most samples in a message.
    first
        Number of the first sample in its split.
    """
    starts = range(0, len(samples), size)
    parts = [samples.take(slice(start, start + size)) for start in starts]
    rows = (sample_batch(part, object_names) for part in parts)
    clouds = (cloud_batch(part.cloud, part.cloud_mask, rounded=False) for part in parts)
    times = [first + start for start in starts]
    write_apart(artifact, TOPIC, zip(times, rows, strict=True), zip(times, clouds, strict=True))


def read_samples(artifact: Artifact) -> Iterator[Samples]:
    """The samples of a shard of any version, message by message."""
    for message, batch in with_clouds(artifact, SampleBatch):
        yield samples_of(message, batch)


def read_numbered(artifact: Artifact, number_of: Mapping[str, int]) -> Iterator[Samples]:
    """The samples of a shard, with objects numbered as the caller numbers them.

    Parameters
    ----------
    artifact
        The shard.
    number_of
        Name of an object → its number; of all objects of the shard.

    Yields
    ------
    Samples
        The samples, message by message.
    """
    for message, batch in with_clouds(artifact, SampleBatch):
        samples = samples_of(message, batch)
        number = np.array([number_of[name] for name in message.object_names])
        yield replace(samples, object_index=number[samples.object_index])


def object_names_in(path: Path) -> tuple[str, ...]:
    """The names that ``object_index`` of a shard's samples points into."""
    with open_artifact(path) as artifact:
        for _, message in artifact.messages(SampleBatch):
            return tuple(message.object_names)
    return ()


def sample_batch(samples: Samples, object_names: tuple[str, ...]) -> SampleBatch:
    """The message of some samples, their clouds left out."""
    message = SampleBatch(object_names=object_names)
    set_tensors(message, vars(samples), ROWS_STORED_AS)
    return message


def samples_of(message: SampleBatch, clouds: CloudBatch | None = None) -> Samples:
    """The samples of a message: views of its bytes wherever possible.

    Parameters
    ----------
    message
        Of a shard of stage shards.
    clouds
        The message of their clouds; without it clouds that lie apart have no cells.

    Returns
    -------
    The samples, in the order of the message.

    Raises
    ------
    ContentError
        a tensor is missing, or they do not fit together.
    """
    arrays = tensors_of(message, ROWS_STORED_AS, SHAPES, UNLESS_THERE)
    rows = len(arrays["quality"])
    arrays["cloud"], arrays["cloud_mask"] = clouds_beside(message, clouds, rows)
    return Samples(**arrays)


def read_split(index: Path, split: str) -> Samples:
    """All samples of a split, in shard order.

    Parameters
    ----------
    index
        The index of a sharded artifact.
    split
        Such as ``train``.

    Returns
    -------
    The samples, in memory.
    """
    return join_samples(list(_batches(listed_shards(index, [split]))))


def read_rows(index: Path, split: str) -> Samples:
    """All samples of a split without their clouds, in shard order.

    Parameters
    ----------
    index
        The index of a sharded artifact.
    split
        Such as ``test``.

    Returns
    -------
    The samples, in memory; their clouds have no cells.
    """
    parts = []
    for shard in listed_shards(index, [split]):
        with open_artifact(shard) as artifact:
            for _, message in artifact.messages(SampleBatch):
                part = samples_of(message)  # an older file has clouds in it
                cloud, mask = part.cloud[:, :0, :0].copy(), part.cloud_mask[:, :0, :0].copy()
                parts.append(replace(part, cloud=cloud, cloud_mask=mask))
    return join_samples(parts)


def read_chosen(index: Path, split: str, numbers: Integer[np.ndarray, " k"]) -> Samples:
    """Some samples of a split; of the others no more than a message is in memory at a time.

    Parameters
    ----------
    index
        The index of a sharded artifact.
    split
        Such as ``test``.
    numbers
        Which, counted in shard order, shape (k,); at least one.

    Returns
    -------
    The samples, in the order of the numbers.
    """
    order = np.argsort(numbers, kind="stable")
    wanted, parts, start = numbers[order], [], 0
    for part in _batches(listed_shards(index, [split])):
        within = wanted[(wanted >= start) & (wanted < start + len(part))] - start
        if len(within):
            parts.append(part.take(within))
        start += len(part)
    return join_samples(parts).take(np.argsort(order, kind="stable"))


def _batches(shards: Iterable[Path]) -> Iterator[Samples]:
    for shard in shards:
        with open_artifact(shard) as artifact:
            yield from read_samples(artifact)
