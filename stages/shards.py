"""Stage 4, shards: labelled grasps → shuffled train, val and test shards, split by object."""

from collections import Counter
from pathlib import Path

import numpy as np

from pipeline.artifacts import ArtifactWriter, open_artifact
from pipeline.artifacts.sharding import (
    is_current,
    listed_shards,
    shard_entry,
    shard_path,
    write_index,
)
from pipeline.clutter.levels import level_of
from pipeline.errors import ArtifactError
from pipeline.execution import StageContext, Summary, generator, progress, stage_command
from pipeline.labelling.balancing import proposal_weights, quality_histogram
from pipeline.labelling.grasps import GraspOrigin, LabelledGrasps
from pipeline.messages.grasps import read_grasps
from pipeline.messages.samples import write_samples
from pipeline.network.samples import SPLITS, Samples, join_samples
from pipeline.recording.shards import draw_shards
from schemas.softgrip.v1.grasps_pb2 import ShardEntry
from stages.graph import SHARDS, inputs_of


def build(stage: StageContext) -> Summary:
    """Shuffle the labelled grasps across scenes and write them as training shards."""
    names, by_split = gather(stage.upstream("grasps"))
    entries: list[ShardEntry] = []
    for split in SPLITS:
        samples = by_split.get(split)
        if samples is None:
            raise ArtifactError(
                f"There is no grasp of the {split} split in {stage.upstream('grasps')}",
                f"Give scenes.clutters_per_level.{split} at least one clutter",
            )
        order = generator(stage.config.seed, "shuffle", split).permutation(len(samples))
        entries += write_split(stage, split, samples.take(order), names)
    every = join_samples([by_split[split] for split in SPLITS])
    histogram = quality_histogram(every.quality.astype(np.float64))
    write_index(stage.output, stage.provenance(), entries, histogram)
    return summary(entries, by_split, names)


def gather(grasps: Path) -> tuple[tuple[str, ...], dict[str, Samples]]:
    """All grasps as samples: the objects' names, and split → samples in scene order."""
    parts: dict[str, list[Samples]] = {}
    names: dict[str, int] = {}
    shards = listed_shards(grasps)
    for shard in progress(shards, len(shards), "shards: reading grasps", "shard"):
        with open_artifact(shard) as artifact:
            for origin, found in read_grasps(artifact):
                parts.setdefault(origin.split, []).append(as_samples(origin, found, names))
    return tuple(names), {split: join_samples(every) for split, every in parts.items()}


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


def write_split(
    stage: StageContext, split: str, samples: Samples, names: tuple[str, ...]
) -> list[ShardEntry]:
    """The shards of one split; those already there are kept."""
    config = stage.config.shards
    count = -(-len(samples) // config.samples_per_shard)
    folder = stage.shards / split
    entries = []
    for index in progress(range(count), count, f"shards: writing {split}", "shard"):
        first = index * config.samples_per_shard
        part = samples.take(slice(first, first + config.samples_per_shard))
        path = shard_path(folder, index, count)
        if not is_current(path, stage.key.digest):
            write_shard(stage, path, part, names, first)
        entries.append(shard_entry(path, stage.output.parent, len(part), split))
    return entries


def write_shard(
    stage: StageContext, path: Path, samples: Samples, names: tuple[str, ...], first: int
) -> None:
    """One shard: some hundreds of samples a message, log time is the sample's index."""
    config = stage.config.shards
    with ArtifactWriter(path, stage.provenance(), config.compression) as artifact:
        write_samples(artifact, samples, names, config.samples_per_message, first)


def summary(
    entries: list[ShardEntry], by_split: dict[str, Samples], names: tuple[str, ...]
) -> Summary:
    """The stage's headline figures."""
    return {
        "samples": {split: len(samples) for split, samples in by_split.items()},
        "shards": dict(Counter(entry.split for entry in entries)),
        "objects": len(names),
        "quality_histogram": {
            split: quality_histogram(samples.quality.astype(np.float64)).tolist()
            for split, samples in by_split.items()
        },
        "seen_cells": {
            split: round(float(samples.cloud_mask.mean()), 4) for split, samples in by_split.items()
        },
    }


if __name__ == "__main__":
    stage_command(SHARDS, build, inputs_of, draw=draw_shards)
