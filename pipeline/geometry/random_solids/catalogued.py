"""Random solids as objects of the catalogue."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.config.objects import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.catalogue import EMBEDDED, CatalogueObject, prepare_object
from pipeline.geometry.descriptor import describe, shape_distance
from pipeline.geometry.intake import made_or_why_not
from pipeline.geometry.mesh_files import MeshSource
from pipeline.geometry.plan import Plan
from pipeline.geometry.random_solids import random_solid


def solid_names(config: ObjectsConfig, taken: Collection[str]) -> list[str]:
    """Names of a run's random solids: with more of them, the first stay what they are.

    Parameters
    ----------
    config
        How many are wanted, and the number of the first.
    taken
        Names of meshes, which no solid may have.

    Returns
    -------
    The names.

    Raises
    ------
    MeshError
        A mesh has one of them.
    """
    numbers = range(config.first_solid, config.first_solid + config.random_solids)
    names = [f"random-solid-{number:04d}" for number in numbers]
    for name in names:
        if name in taken:
            raise MeshError(f"A mesh is named {name}, as a random solid would be", "Rename it")
    return names


def solid_or_why_not(
    drawn: tuple[str, np.random.Generator], config: ObjectsConfig, cache: Path
) -> CatalogueObject | MeshError:
    """A random solid at its final size, or why it is none.

    Parameters
    ----------
    drawn
        Its name, and the stream that draws its shape, its size and its density.
    config
        Sizes and convex parts.
    cache
        Folder where convex parts are kept.

    Returns
    -------
    The object, or the reason.
    """
    name, rng = drawn

    def make() -> CatalogueObject:
        mesh = random_solid(rng, config.solid_kinds, config.grained_share)
        source = MeshSource(name, EMBEDDED, EMBEDDED, mesh, "m", "declared")
        return prepare_object(source, config, rng, cache)

    return made_or_why_not(name, make)


def solids_for_training(
    solids: Sequence[CatalogueObject], plan: Plan, threshold: float
) -> tuple[list[CatalogueObject], dict[str, str]]:
    """The solids that are unlike every held-out object, each with its family.

    Parameters
    ----------
    solids
        Random solids.
    plan
        The run's objects, their splits and families.
    threshold
        Shapes nearer than this are near-copies [1].

    Returns
    -------
    The solids for training: of the family of the training object that one is most like, if it is a
    near-copy, else of a family of its own. And of those left out, by name, the held-out object that
    they are like.
    """
    kept: list[CatalogueObject] = []
    near: dict[str, str] = {}
    for solid in solids:
        own = describe(solid.mesh)
        apart = {item.source.name: shape_distance(own, item.descriptor) for item in plan.taken}
        like = sorted((name for name in apart if apart[name] < threshold), key=apart.__getitem__)
        held_out = [name for name in like if plan.split[name] != "train"]
        if held_out:
            near[solid.name] = held_out[0]
        else:
            family = plan.families.of[like[0]] if like else solid.name
            kept.append(replace(solid, family=family))
    return kept, near
