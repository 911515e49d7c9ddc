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
) -> None:
    """Hold that no training object of another run is one of those held out, or like one of them.

    An object that the other run holds out itself is not compared: that run left out what is like
    it.

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

    Raises
    ------
    ConfigError
        One is: the message names both.
    """
    split_of = {item.content: split for item, split in other.values()}
    new = [item for item in held_out if split_of.get(item.content) not in ("val", "test")]
    if not new:
        return
    learnt = [(item, describe(item.mesh)) for item, split in other.values() if split == "train"]
    for item in new:
        own = describe(item.mesh)
        for known, descriptor in learnt:
            same = item.content == known.content or item.family == known.family
            if same or shape_distance(own, descriptor) < threshold:
                raise ConfigError(
                    f"Run {run}, which train.further_runs names, learns from {known.name}, and "
                    f"this run holds out {item.name}, which is of its family",
                    f"Hold it out in run {run} too, with the same meshes and split there",
                )
