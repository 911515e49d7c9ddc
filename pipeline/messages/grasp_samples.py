"""Labelled grasps as training samples: the part of stage grasps' shards that training reads."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pipeline.artifacts.reading import open_artifact
from pipeline.artifacts.sharding import listed_shards
from pipeline.clutter.levels import level_of
from pipeline.labelling.balancing import proposal_weights
from pipeline.labelling.grasps import GraspOrigin, LabelledGrasps
from pipeline.messages.grasps import read_grasps
from pipeline.network.samples import Samples, join_samples
from pipeline.progress import progress


def read_all_grasps(grasps: Path) -> tuple[tuple[str, ...], dict[str, Samples]]:
    """All grasps of a run as samples, in memory.

    Parameters
    ----------
    grasps
        The index of stage grasps.

    Returns
    -------
    Names of the objects, and split → its samples in scene order.
    """
    parts: dict[str, list[Samples]] = {}
    names: dict[str, int] = {}
    shards = listed_shards(grasps)
    for shard in progress(shards, len(shards), "reading grasps", "shard"):
        for split, samples in read_grasp_samples(shard, names):
            parts.setdefault(split, []).append(samples)
    return tuple(names), {split: join_samples(every) for split, every in parts.items()}


def read_grasp_samples(shard: Path, names: dict[str, int]) -> Iterator[tuple[str, Samples]]:
    """The grasps of a shard as samples, message by message.

    Parameters
    ----------
    shard
        A file of stage grasps.
    names
        Name of an object → its number; new objects are added.

    Yields
    ------
    tuple[str, Samples]
        Split of the samples, and the samples.
    """
    with open_artifact(shard) as artifact:
        for origin, found in read_grasps(artifact):
            yield origin.split, as_samples(origin, found, names)


def as_samples(origin: GraspOrigin, grasps: LabelledGrasps, names: dict[str, int]) -> Samples:
    """The part of a batch that training reads; new objects are added to ``names``."""
    index = np.array([names.setdefault(name, len(names)) for name in origin.object_names])
    count = len(grasps)
    shape_class = list(type(level_of(origin.level)[0])).index(level_of(origin.level)[0])
    return Samples(
        cloud=grasps.cloud,
        cloud_mask=grasps.cloud_mask,
        quality=grasps.quality.astype(np.float32),
        object_index=index[grasps.object_index],
        shape_class=np.full(count, shape_class),
        level=np.full(count, origin.level),
        pressure=grasps.pressure.astype(np.float32),
        proposal_weight=proposal_weights(grasps.proposal, grasps.keep_probability),
        pictures=grasps.pictures,
    )
