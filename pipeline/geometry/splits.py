"""From measured objects to families and splits, with what an earlier making settled."""

from collections.abc import Collection, Sequence

from pipeline.config.objects import SplitConfig
from pipeline.geometry.catalogue import MeasuredObject
from pipeline.geometry.families import DeclaredFamily, Families, group
from pipeline.geometry.selection import Split, choose_split
from pipeline.geometry.settled import Settled


def split_objects(
    items: Sequence[MeasuredObject],
    added: Collection[str],
    declared: Sequence[DeclaredFamily],
    config: SplitConfig,
    seed: int,
    settled: Settled,
) -> tuple[dict[str, Split], Families]:
    """The split of each object by its name, and all families.

    Parameters
    ----------
    items
        The objects of the run.
    added
        Names of those that are for training alone.
    declared
        Families that a person declared.
    config
        Fractions of the splits, and how alike a family is.
    seed
        Of the draw.
    settled
        Splits by content from an earlier making of the run.

    Returns
    -------
    Splits of all objects but those that would join two splits, which the families name; they are
    the later ones by content, so that no name and no order decides.
    """
    by_content = sorted(items, key=lambda item: item.content)
    fixed: dict[str, Split] = dict.fromkeys(added, "train")
    if config.all_in_test:
        fixed |= {item.source.name: "test" for item in items}
    for item in by_content:
        if item.source.name not in added and item.content in settled.splits:
            fixed[item.source.name] = settled.splits[item.content]
    descriptors = {item.source.name: item.descriptor for item in by_content}
    families = group(descriptors, declared, config.family_threshold, fixed)
    classes = {
        item.source.name: item.shape_class
        for item in items
        if item.source.name in families.of and item.source.name not in added
    }
    split = choose_split(classes, config, seed, families.of, fixed)
    if not config.meshes_in_training:
        split = {name: "test" if where == "train" else where for name, where in split.items()}
    return split | {name: fixed[name] for name in added}, families
