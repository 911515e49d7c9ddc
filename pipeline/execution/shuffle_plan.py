"""Which job of the two-pass shuffle moves which samples, known before a file is opened.

All follows from the index of the grasps, the seed and the configuration: how many parts there are,
how many samples each job of the first pass sends to each part, and which shards a part becomes. So
every job can be done by any process, be skipped where its files are there, and be done again.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Int

from pipeline.artifacts.sharding import listed_shards, read_index, shard_path
from pipeline.config import RunConfig
from pipeline.execution.seeds import generator
from pipeline.network.samples import SPLITS
from pipeline.network.shuffling import draw_parts, near_equal_sizes, part_count


@dataclass(frozen=True)
class Source:
    """A shard of stage grasps.

    Attributes
    ----------
    path
        The file.
    number
        Its place among all shards of the splits.
    split
        Whose grasps it holds.
    samples
        How many.
    of_split
        How many grasps the split has.
    first_part
        Number of the split's first part.
    """

    path: Path
    number: int
    split: str
    samples: int
    of_split: int
    first_part: int


@dataclass(frozen=True)
class Part:
    """Samples of one split that are permuted together.

    Attributes
    ----------
    number
        Among the parts of all splits.
    split
        Whose samples these are.
    within_split
        Number of the part among those of its split.
    first
        Number of its first sample within the split.
    counts
        Samples that each group of sources sends here.
    shards
        Files that its samples become, in order.
    """

    number: int
    split: str
    within_split: int
    first: int
    counts: tuple[int, ...]
    shards: tuple[Path, ...]

    @property
    def samples(self) -> int:
        """How many samples it holds."""
        return sum(self.counts)


@dataclass(frozen=True)
class ShufflePlan:
    """The groups of shards that are read by one job each, and the parts they are sent to."""

    groups: tuple[tuple[Source, ...], ...]
    parts: tuple[Part, ...]


def plan_shuffle(config: RunConfig, grasps: Path, into: Path) -> ShufflePlan:
    """Plan the shuffle of a run's grasps.

    Parameters
    ----------
    config
        The run's configuration.
    grasps
        The index of stage grasps.
    into
        Folder of the shards.

    Returns
    -------
    The plan; splits without grasps are not in it.
    """
    wanted = config.shards.samples_per_part
    entries = [entry for entry in read_index(grasps).shards if entry.split in SPLITS]
    files = listed_shards(grasps, SPLITS)
    totals = {split: sum(e.samples for e in entries if e.split == split) for split in SPLITS}
    parts_of = {split: part_count(total, wanted) for split, total in totals.items()}
    first_part = {
        split: sum(parts_of[before] for before in SPLITS[:at]) for at, split in enumerate(SPLITS)
    }
    sources = [
        Source(path, number, e.split, e.samples, totals[e.split], first_part[e.split])
        for number, (path, e) in enumerate(zip(files, entries, strict=True))
        if e.samples
    ]
    groups = tuple(grouped(sources, wanted))
    parts = sum(parts_of.values())
    counts = np.array([np.bincount(drawn(group, config), minlength=parts) for group in groups])
    planned: list[Part] = []
    for split, count in parts_of.items():
        numbers = range(first_part[split], first_part[split] + count)
        sent = [tuple(counts[:, number].tolist()) for number in numbers]
        pieces = [len(near_equal_sizes(sum(s), config.shards.samples_per_shard)) for s in sent]
        files_of_split = [
            shard_path(into / split, shard, sum(pieces)) for shard in range(sum(pieces))
        ]
        for at, number in enumerate(numbers):
            before = sum(pieces[:at])
            shards = tuple(files_of_split[before : before + pieces[at]])
            first = sum(sum(s) for s in sent[:at])
            planned.append(Part(number, split, at, first, sent[at], shards))
    return ShufflePlan(groups, tuple(planned))


def grouped(sources: Iterable[Source], samples: int) -> Iterable[tuple[Source, ...]]:
    """Neighbouring sources that hold together no more than so many samples, or one with more."""
    group: list[Source] = []
    held = 0
    for source in sources:
        if group and held + source.samples > samples:
            yield tuple(group)
            group, held = [], 0
        group.append(source)
        held += source.samples
    if group:
        yield tuple(group)


def drawn(group: Sequence[Source], config: RunConfig) -> Int[np.ndarray, " n"]:
    """Number of the part that each sample of a group of sources is sent to, shape (n,)."""
    wanted = config.shards.samples_per_part
    return np.concatenate(
        [
            source.first_part
            + draw_parts(
                source.samples,
                source.of_split,
                wanted,
                generator(config.seed, "scatter", source.split, source.number),
            )
            for source in group
        ]
    )


def order_within(part: Part, seed: int) -> Int[np.ndarray, " n"]:
    """The order of a part's samples, as numbers of the samples as they came, shape (n,)."""
    # The first part is named as the whole split was when it was one: such a split keeps its order.
    names = (part.split, part.within_split) if part.within_split else (part.split,)
    return generator(seed, "shuffle", *names).permutation(part.samples)
