"""A shuffle in two passes, for more samples than memory holds: into parts, then within each part.

In the first pass every sample draws a number below the count of all; by it the sample goes to a
part. In the second pass the samples of a part are permuted, and the parts follow one another. Every
order of all samples is then equally likely, whatever size the parts came to (Rao 1961, Sandelius
1962). A process holds one part at a time, and the number of parts follows from the number of
samples alone.
"""

from collections.abc import Iterable
from dataclasses import fields

import numpy as np
from jaxtyping import Int

from pipeline.errors import ArtifactError
from pipeline.network.samples import Samples


def part_count(samples: int, samples_per_part: int) -> int:
    """Parts that so many samples are shuffled in."""
    return -(-samples // samples_per_part)


def draw_parts(
    count: int, samples: int, samples_per_part: int, rng: np.random.Generator
) -> Int[np.ndarray, " count"]:
    """Draw the part of some of the samples.

    All parts but the last are equally likely; the last is less likely, by what it lacks of a whole
    part. So parts are as large, and memory as much, of few samples as of many.

    Parameters
    ----------
    count
        How many samples draw here.
    samples
        How many there are in all.
    samples_per_part
        How many are wanted in a part; draws differ from it by a few times its square root.
    rng
        Of these samples.

    Returns
    -------
    Number of the part of each sample, shape (count,).
    """
    return rng.integers(0, samples, count) // samples_per_part


def positions_by_part(part: Int[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
    """Position of each sample once they lie part by part, in their order within each part."""
    return positions_in(np.argsort(part, kind="stable"))


def positions_in(order: Int[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
    """Position that each sample gets in an order, which lists samples by their number."""
    position = np.empty_like(order)
    position[order] = np.arange(len(order))
    return position


def placed(batches: Iterable[Samples], position: Int[np.ndarray, " n"]) -> Samples:
    """Samples put where they belong as they are read, so that each is in memory once.

    Parameters
    ----------
    batches
        The samples in the order of their numbers; n in all, at least one.
    position
        Where each of them is put, shape (n,).

    Returns
    -------
    The samples in the order of their positions.

    Raises
    ------
    ArtifactError
        There are more or fewer samples.
    """
    arrays: dict[str, np.ndarray] = {}
    done = 0
    for batch in batches:
        there = position[done : done + len(batch)]
        done += len(batch)
        if done > len(position):
            break
        for field in fields(Samples):
            found = getattr(batch, field.name)
            if field.name not in arrays:
                arrays[field.name] = np.empty((len(position), *found.shape[1:]), found.dtype)
            arrays[field.name][there] = found
    if done != len(position):
        raise ArtifactError(
            f"There are not the {len(position)} grasps that an index names",
            "Delete the shards of stage grasps and run 'make grasps' again",
        )
    return Samples(**arrays)


def near_equal_sizes(count: int, most: int) -> list[int]:
    """Sizes of as few pieces as hold ``count`` samples at no more than ``most`` each."""
    pieces = -(-count // most)
    return [count // pieces + (piece < count % pieces) for piece in range(pieces)]
