"""Which objects a run takes, and which split each belongs to: by family, stratified by class."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from typing import Literal

import numpy as np

from pipeline.config.objects import SplitConfig
from pipeline.geometry.shape import ShapeClass

Split = Literal["train", "val", "test"]
# A class with fewer families than splits cannot be in all of them.
_SPLITS = 3


def choose_subset(
    classes: Mapping[str, ShapeClass], limit: int, seed: int, taken: Collection[str] = ()
) -> list[str]:
    """At most `limit` names, spread as evenly over the classes as they allow.

    Deterministic in names, classes and seed, whatever the order of the mapping.

    Parameters
    ----------
    classes
        Class of each object.
    limit
        How many at most; 0: all.
    seed
        Of the draw.
    taken
        Names that were chosen before and stay, as far as they fit.

    Returns
    -------
    The names, sorted.
    """
    if limit == 0 or limit >= len(classes):
        return sorted(classes)
    stay = {name: kind for name, kind in classes.items() if name in taken}
    if len(stay) > limit:
        return choose_subset(stay, limit, seed)
    chosen, counts = list(stay), Counter(stay.values())
    queues = _shuffled_by_class(classes, seed)
    queues = {kind: [n for n in names if n not in stay] for kind, names in queues.items()}
    while len(chosen) < limit:
        kind = min((kind for kind in queues if queues[kind]), key=lambda kind: counts[kind])
        chosen.append(queues[kind].pop())
        counts[kind] += 1
    return sorted(chosen)


def choose_split(
    classes: Mapping[str, ShapeClass],
    config: SplitConfig,
    seed: int,
    family_of: Mapping[str, str],
    fixed: Mapping[str, Split],
) -> dict[str, Split]:
    """The split of each object, names sorted: whole families, each class by the same fractions.

    A class of three or more families has at least one in each split; of two, one each in train
    and test; a single one is for training. A family is of the class that most of its members
    have. Deterministic in names, families, classes and seed.

    Parameters
    ----------
    classes
        Class of each object to be split.
    config
        Fractions of the splits.
    seed
        Of the draw.
    family_of
        Family of each object, also of those that only `fixed` names.
    fixed
        Splits that are settled already, by object; a family goes where one of its members is.

    Returns
    -------
    Split of each object of `classes`.
    """
    settled = {family_of[name]: where for name, where in fixed.items() if name in family_of}
    members: dict[str, list[str]] = {}
    for name in sorted(classes):
        members.setdefault(family_of[name], []).append(name)
    families = {family: _class_of(classes[name] for name in own) for family, own in members.items()}
    for queue in _shuffled_by_class(families, seed).values():
        sizes = {family: len(members[family]) for family in queue}
        settled |= _split_of_class(sizes, settled, config)
    return {name: settled[family_of[name]] for name in sorted(classes)}


def _split_of_class(
    sizes: Mapping[str, int], settled: Mapping[str, Split], config: SplitConfig
) -> dict[str, Split]:
    """The split of one class's families, in the order they are drawn in."""
    wanted = _wanted(sum(sizes.values()), len(sizes), config)
    split = {family: settled[family] for family in sizes if family in settled}
    left = [family for family in sizes if family not in split]
    for where, want in wanted.items():
        have = sum(sizes[family] for family, own in split.items() if own == where)
        for family in list(left):
            # A family may overshoot by half of itself; training keeps one.
            if have + sizes[family] / 2 <= want and _training_keeps_one(split, left):
                split[family] = where
                left.remove(family)
                have += sizes[family]
        if have == 0 < want and left and _training_keeps_one(split, left):
            smallest = min(left, key=lambda family: sizes[family])
            split[smallest] = where
            left.remove(smallest)
    return split | dict.fromkeys(left, "train")


def _training_keeps_one(split: Mapping[str, Split], left: list[str]) -> bool:
    return len(left) > 1 or "train" in split.values()


def _wanted(count: int, families: int, config: SplitConfig) -> dict[Split, int]:
    """Objects of one class that test and val should have."""
    test = max(round(config.test_fraction * count), 1 if families > 1 else 0)
    val = max(round(config.val_fraction * count), 1 if families >= _SPLITS else 0)
    while count and test + val >= count and test + val > 0:
        # Training keeps at least one: the larger share gives way.
        test, val = (test - 1, val) if test > val else (test, val - 1)
    return {"test": test, "val": val}


def _class_of(classes: Iterable[ShapeClass]) -> ShapeClass:
    """The most frequent class; of equally frequent ones the simplest."""
    counts = Counter(classes)
    return max(ShapeClass, key=lambda kind: counts[kind])


def _shuffled_by_class(classes: Mapping[str, ShapeClass], seed: int) -> dict[ShapeClass, list[str]]:
    groups: dict[ShapeClass, list[str]] = {}
    for index, kind in enumerate(ShapeClass):
        names = sorted(name for name, own in classes.items() if own == kind)
        rng = np.random.default_rng([seed, index])
        groups[kind] = [names[k] for k in rng.permutation(len(names))]
    return groups
