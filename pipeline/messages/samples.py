"""Training samples ↔ softgrip.v1.SampleBatch."""

import math
from collections.abc import Iterable, Iterator
from pathlib import Path

from pipeline.artifacts.reading import open_artifact
from pipeline.artifacts.sharding import listed_shards
from pipeline.artifacts.tensors import set_tensors, tensors_of
from pipeline.network.samples import Samples, join_samples
from schemas.softgrip.v1.samples_pb2 import SampleBatch

STORED_AS = {
    "cloud": "f2",
    "cloud_mask": "u1",
    "quality": "f4",
    "object_index": "u2",
    "shape_class": "u1",
    "level": "u1",
    "pressure": "f4",
    "proposal_weight": "f4",
    "pictures": "u1",
}
SHAPES = {
    "cloud": "n g g 3",
    "cloud_mask": "n g g",
    **dict.fromkeys(("quality", "object_index", "shape_class", "level", "pressure"), "n"),
    **dict.fromkeys(("proposal_weight", "pictures"), "n"),
}
# What the fields hold that v1 did not have from the start.
UNLESS_THERE = {"proposal_weight": math.nan, "pictures": 1}


def sample_batch(samples: Samples, object_names: tuple[str, ...]) -> SampleBatch:
    """The message of some samples."""
    message = SampleBatch(object_names=object_names)
    set_tensors(message, vars(samples), STORED_AS)
    return message


def samples_of(message: SampleBatch) -> Samples:
    """The samples of a message: views of its bytes.

    Parameters
    ----------
    message
        Of a shard of stage shards.

    Returns
    -------
    The samples, in the order of the message.

    Raises
    ------
    ContentError
        a tensor is missing, or they do not fit together.
    """
    arrays = tensors_of(message, STORED_AS, SHAPES, UNLESS_THERE)
    arrays["cloud_mask"] = arrays["cloud_mask"].view(bool)
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


def _batches(shards: Iterable[Path]) -> Iterator[Samples]:
    for shard in shards:
        with open_artifact(shard) as artifact:
            for _, message in artifact.messages(SampleBatch):
                yield samples_of(message)
