"""The two passes of the shuffle as jobs, each of bounded memory, in whichever process.

A job keeps what is whole from before an interruption, so it can be done again at any time. What it
reads and writes it finds by path.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Int

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact
from pipeline.artifacts.sharding import is_current, shard_entry
from pipeline.asking.cache import publish_rows
from pipeline.asking.label_rows import sample_part
from pipeline.config import RunConfig
from pipeline.execution.shuffle_plan import Part, Source, drawn, order_within
from pipeline.labelling.balancing import TENTHS, quality_histogram
from pipeline.messages.grasp_samples import read_grasp_samples
from pipeline.messages.samples import object_names_in, read_numbered, read_samples, write_samples
from pipeline.network.samples import Samples
from pipeline.network.shuffling import near_equal_sizes, placed, positions_by_part, positions_in
from pipeline.stopwatch import Stopwatch
from schemas.softgrip.v1.grasps_pb2 import ShardEntry


@dataclass(frozen=True)
class ScatterJob:
    """One work item of the first pass: some shards of grasps, and part → file that it gets."""

    sources: tuple[Source, ...]
    files: dict[int, Path]
    config: RunConfig
    provenance: Provenance


@dataclass(frozen=True)
class GatherJob:
    """One work item of the second pass: the files of a part in order, and what they become."""

    part: Part
    files: tuple[Path, ...]
    names: tuple[str, ...]
    config: RunConfig
    provenance: Provenance
    below: Path  # what shards are named by in the index is below this folder
    rows: Path  # gets the rows of its samples, as `make query` and the stage's check ask them


@dataclass(frozen=True)
class Gathered:
    """A finished part: its shards, and counts of its samples."""

    entries: list[ShardEntry]
    quality: Int[np.ndarray, " 10"]  # samples by tenth of q
    seen: int  # cells that hold a point
    cells: int
    empty: int  # clouds in which none does
    rows_s: float  # processor time of writing its rows


def scatter_group(job: ScatterJob) -> tuple[str, ...]:
    """Write the samples of a group to a file a part, or keep the files; names of their objects."""
    key = job.provenance.key
    if all(is_current(path, key) for path in job.files.values()):
        return object_names_in(next(iter(job.files.values()))) if job.files else ()
    part, names = drawn(job.sources, job.config), dict[str, int]()
    samples = placed(read_sources(job.sources, names), positions_by_part(part))
    ends = np.cumsum(np.bincount(part, minlength=max(job.files) + 1))
    for number, path in job.files.items():
        mine = samples.take(slice(int(ends[number - 1]) if number else 0, int(ends[number])))
        if not is_current(path, key):
            with ArtifactWriter(path, job.provenance) as artifact:
                write_samples(artifact, mine, tuple(names), job.config.shards.samples_per_message)
    return tuple(names)


def read_sources(sources: Sequence[Source], names: dict[str, int]) -> Iterator[Samples]:
    """The samples of some shards of grasps; new objects are added to ``names``."""
    for source in sources:
        for _, samples in read_grasp_samples(source.path, names):
            yield samples


def gather(job: GatherJob) -> Gathered:
    """Permute a part into its shards, or keep them; then its scattered files are removed."""
    config, part, key = job.config.shards, job.part, job.provenance.key
    if all(is_current(path, key) for path in part.shards):
        found = counted(job, (batch for path in part.shards for batch in read_shard(path)))
    else:
        samples = placed(read_scattered(job), positions_in(order_within(part, job.config.seed)))
        for path, start, size in pieces_of(job):
            if not is_current(path, key):
                mine, first = samples.take(slice(start, start + size)), part.first + start
                with ArtifactWriter(path, job.provenance, config.compression) as artifact:
                    write_samples(artifact, mine, job.names, config.samples_per_message, first)
        found = counted(job, [samples])
    for path in job.files:
        path.unlink(missing_ok=True)
    return found


def pieces_of(job: GatherJob) -> list[tuple[Path, int, int]]:
    """Shard, number of its first sample within the part, and samples, for each shard of a part."""
    sizes = near_equal_sizes(job.part.samples, job.config.shards.samples_per_shard)
    starts = np.cumsum([0, *sizes[:-1]]).tolist()
    return list(zip(job.part.shards, starts, sizes, strict=True))


def counted(job: GatherJob, batches: Iterable[Samples]) -> Gathered:
    """A part's entries in the index, and counts of its samples; their rows are written."""
    quality, seen, cells, empty = np.zeros(TENTHS, dtype=np.int64), 0, 0, 0
    rows, first, split, writing = [], job.part.first, job.part.split, Stopwatch()
    for batch in batches:
        quality += quality_histogram(batch.quality.astype(np.float64))
        seen += int(np.count_nonzero(batch.cloud_mask))
        cells += batch.cloud_mask.size
        empty += int(np.count_nonzero(~batch.cloud_mask.reshape(len(batch), -1).any(axis=1)))
        with writing.running():
            rows.append(sample_part(batch, job.names, split, first))
        first += len(batch)
    with writing.running():
        publish_rows(job.rows, "samples", rows)
    entries = [shard_entry(path, job.below, size, split) for path, _, size in pieces_of(job)]
    return Gathered(entries, quality, seen, cells, empty, writing.seconds)


def read_shard(path: Path) -> Iterator[Samples]:
    """The samples of a finished shard."""
    with open_artifact(path) as artifact:
        yield from read_samples(artifact)


def read_scattered(job: GatherJob) -> Iterator[Samples]:
    """The samples of a part in the order they were scattered in."""
    number_of = {name: number for number, name in enumerate(job.names)}
    for path in job.files:
        with open_artifact(path) as artifact:
            yield from read_numbered(artifact, number_of)
