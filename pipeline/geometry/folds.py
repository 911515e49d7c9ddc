"""Which fold of a cross-validation each family of objects belongs to, and what a start may know."""

from collections import Counter
from collections.abc import Collection, Mapping

import numpy as np

from pipeline.errors import ConfigError
from pipeline.geometry.shape import ShapeClass


def deal_families(
    family_of: Mapping[str, str],
    classes: Mapping[str, ShapeClass],
    tested: Collection[str],
    folds: int,
    seed: int,
) -> dict[str, int]:
    """The fold of each object: whole families, tested objects of each class spread evenly.

    Parameters
    ----------
    family_of
        Family of each object.
    classes
        Class of each object.
    tested
        Objects that a fold is tested on; the others are for training alone, in other folds.
    folds
        How many folds.
    seed
        Of the order in which families are dealt.

    Returns
    -------
    Fold of each object, from 0.

    Raises
    ------
    ConfigError
        There are fewer families with tested objects than folds.
    """
    members: dict[str, list[str]] = {}
    for name in sorted(family_of):
        members.setdefault(family_of[name], []).append(name)
    counted = {family: [n for n in own if n in tested] for family, own in members.items()}
    with_tested = sum(bool(own) for own in counted.values())
    if with_tested < folds:
        raise ConfigError(
            f"{folds} folds need as many families of objects to test on, and there are "
            f"{with_tested}",
            "Add meshes, or lower FOLDS",
        )
    shuffled = np.random.default_rng(seed).permutation(sorted(members)).tolist()
    # The large ones first: what is left evens out the folds.
    ordered = sorted(shuffled, key=lambda f: (len(counted[f]), len(members[f])), reverse=True)
    fold_of: dict[str, int] = {}
    for family in ordered:
        kinds = Counter(classes[name] for name in counted[family] or members[family])
        kind = max(ShapeClass, key=lambda one: kinds[one])
        load = [
            (
                sum(fold_of[n] == k and classes[n] is kind and n in tested for n in fold_of),
                sum(fold_of[n] == k and n in tested for n in fold_of),
                sum(fold_of[n] == k for n in fold_of),
            )
            for k in range(folds)
        ]
        fold = min(range(folds), key=lambda k: load[k] if counted[family] else load[k][::-1])
        fold_of |= dict.fromkeys(members[family], fold)
    return fold_of


def check_held_out(tested: Mapping[str, str], split_of: Mapping[str, str], run: str) -> None:
    """Hold that a network learned from none of the objects that it is to be tested on.

    Parameters
    ----------
    tested
        Name and content of each object that a fold is tested on.
    split_of
        Content and split of each object of the run that trained the network.
    run
        Name of that run.

    Raises
    ------
    ConfigError
        The run trained on one of them, or does not know one: what is near it in shape may then
        have been trained on.
    """
    for name, content in sorted(tested.items()):
        if split_of.get(content) in ("val", "test"):
            continue
        why = "was trained on" if content in split_of else "is unknown"
        raise ConfigError(
            f"Run {run}, which the network of folds.start learned from, has not held out {name}: "
            f"it {why} there",
            f"Make run {run} of the same meshes with split.meshes_in_training = false",
        )
