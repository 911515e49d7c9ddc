"""Further shapes for training: objects stretched along their axes, none like a held-out one."""

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np

from pipeline.config.objects import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.catalogue import CatalogueObject, stretched_copy
from pipeline.geometry.descriptor import ShapeDescriptor, describe, shape_distance
from pipeline.geometry.plan import Plan


def stretched_for_training(
    items: Sequence[CatalogueObject],
    plan: Plan,
    config: ObjectsConfig,
    rng_of: Callable[[str], np.random.Generator],
    threshold: float,
) -> tuple[list[CatalogueObject], dict[str, str]]:
    """The training objects' stretched copies that are unlike every held-out object.

    Parameters
    ----------
    items
        The catalogue's objects; those that the plan does not know are for training.
    plan
        Which of them are for training, and which are held out.
    config
        How many copies, and how far they are stretched.
    rng_of
        The random stream of one copy, by its object's content and its number.
    threshold
        Shapes nearer than this are near-copies [1].

    Returns
    -------
    The copies, in the order of their objects; and of those left out, by name, the held-out object
    that they are like.

    Raises
    ------
    MeshError
        A copy would have the name of an object.
    """
    training = [item for item in items if plan.split.get(item.name, "train") == "train"]
    copies = stretched_copies(training, plan.measured, config, rng_of)
    held_out = {name: item.descriptor for name, item in plan.held_out.items()}
    near = near_held_out(copies, held_out, threshold)
    return [item for item in copies if item.name not in near], near


def stretched_copies(
    items: Sequence[CatalogueObject],
    taken: Collection[str],
    config: ObjectsConfig,
    rng_of: Callable[[str], np.random.Generator],
) -> list[CatalogueObject]:
    """As many further shapes of each object as are asked for, each of its object's family.

    Parameters
    ----------
    items
        The objects to stretch.
    taken
        Names that no copy may have.
    config
        How many copies, and how far they are stretched.
    rng_of
        The random stream of one copy, by its object's content and its number.

    Returns
    -------
    The copies, in the order of their objects.

    Raises
    ------
    MeshError
        A copy would have the name of an object.
    """
    copies = [
        stretched_copy(
            item,
            f"{item.name}-stretched-{k}",
            config,
            rng_of(f"{item.content}-stretched-{k}"),
        )
        for item in items
        for k in range(1, config.stretched_copies + 1)
    ]
    for item in copies:
        if item.name in taken:
            raise MeshError(
                f"A mesh is named {item.name}, as a stretched copy would be", "Rename its file"
            )
    return copies


def near_held_out(
    copies: Sequence[CatalogueObject], held_out: Mapping[str, ShapeDescriptor], threshold: float
) -> dict[str, str]:
    """Copies that are near-copies of a held-out object, each with that object's name."""
    near: dict[str, str] = {}
    for item in copies:
        own = describe(item.mesh)
        like = [n for n, other in held_out.items() if shape_distance(own, other) < threshold]
        if like:
            near[item.name] = min(like)
    return near
