"""Which objects a run takes, and which split each belongs to: by object, stratified by class."""

from collections.abc import Mapping
from typing import Literal

import numpy as np

from pipeline.config.objects import SplitConfig
from pipeline.geometry.shape import ShapeClass

Split = Literal["train", "val", "test"]
# A class with fewer objects than splits cannot be in all of them.
_SPLITS = 3


def choose_subset(classes: Mapping[str, ShapeClass], limit: int, seed: int) -> list[str]:
    """At most `limit` names (0: all), sorted, spread as evenly over the classes as they allow.

    Deterministic in names, classes and seed, whatever the order of the mapping.
    """
    if limit == 0 or limit >= len(classes):
        return sorted(classes)
    queues = [names for names in _shuffled_by_class(classes, seed).values() if names]
    chosen: list[str] = []
    while len(chosen) < limit:
        for names in queues:
            if names and len(chosen) < limit:
                chosen.append(names.pop())
    return sorted(chosen)


def choose_split(
    classes: Mapping[str, ShapeClass], config: SplitConfig, seed: int
) -> dict[str, Split]:
    """The split of each object, names sorted; every class is divided by the same fractions.

    A class of three or more objects has at least one in each split; of two, one each in train
    and test; a single one is for training. Deterministic in names, classes and seed.
    """
    split: dict[str, Split] = {}
    for names in _shuffled_by_class(classes, seed).values():
        count = len(names)
        test = max(round(config.test_fraction * count), 1 if count > 1 else 0)
        val = max(round(config.val_fraction * count), 1 if count >= _SPLITS else 0)
        while count and test + val >= count and test + val > 0:
            # Training keeps at least one: the larger share gives way.
            test, val = (test - 1, val) if test > val else (test, val - 1)
        for index, name in enumerate(names):
            split[name] = "test" if index < test else "val" if index < test + val else "train"
    return dict(sorted(split.items()))


def _shuffled_by_class(classes: Mapping[str, ShapeClass], seed: int) -> dict[ShapeClass, list[str]]:
    groups: dict[ShapeClass, list[str]] = {}
    for index, kind in enumerate(ShapeClass):
        names = sorted(name for name, own in classes.items() if own == kind)
        rng = np.random.default_rng([seed, index])
        groups[kind] = [names[k] for k in rng.permutation(len(names))]
    return groups
