"""Whether the objects that another run learns from are apart from those that a run holds out."""

from collections.abc import Mapping, Sequence

from pipeline.errors import ConfigError
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.descriptor import describe, shape_distance


def check_apart(
    held_out: Sequence[CatalogueObject],
    other: Mapping[str, tuple[CatalogueObject, str]],
    threshold: float,
    run: str,
    threshold_there: float,
) -> None:
    """Hold that no training object of another run is one of those held out, or like one of them.

    Parameters
    ----------
    held_out
        Objects of val and test.
    other
        Name → (object, split) of the other run.
    threshold
        Shapes nearer than this are near-copies [1].
    run
        Name of the other run.
    threshold_there
        That run's own threshold: where it is no smaller, what the other run holds out too is not
        compared by shape again [1].

    Raises
    ------
    ConfigError
        One is: the message names both.
    """
    learnt = [item for item, split in other.values() if split == "train"]
    left_out_there = {item.content for item, split in other.values() if split != "train"}
    trusted = left_out_there if threshold_there >= threshold else set()
    near = [
        (item, known)
        for item in held_out
        for known in learnt
        if item.content == known.content or item.family == known.family
    ]
    if compared := [item for item in held_out if item.content not in trusted]:
        described = [(known, describe(known.mesh)) for known in learnt]
        near += [
            (item, known)
            for item, own in ((item, describe(item.mesh)) for item in compared)
            for known, descriptor in described
            if shape_distance(own, descriptor) < threshold
        ]
    for item, known in near[:1]:
        raise ConfigError(
            f"Run {run}, which train.further_runs names, learns from {known.name}, and "
            f"this run holds out {item.name}, which is of its family",
            f"Hold it out in run {run} too, with the same meshes and split there",
        )
