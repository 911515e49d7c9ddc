"""Foreign meshes taken in: each becomes an object of the catalogue, or gives its reason not to.

What our own geometry trips over in a mesh is a reason to leave that mesh out, and no other.
"""

import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from pipeline.config.objects import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.catalogue import (
    CatalogueObject,
    MeasuredObject,
    finish_object,
    measure_object,
)
from pipeline.geometry.mesh_files import MeshSource
from pipeline.geometry.object_names import readable_name
from pipeline.geometry.parametric import PARAMETRIC_OBJECTS, parametric_source
from pipeline.geometry.urdf_files import load_object_file, read_with, standalone

Result = TypeVar("Result")


@dataclass(frozen=True)
class Source:
    """Where an object comes from.

    Attributes
    ----------
    path
        A mesh file or a URDF; None: it is an embedded object.
    label
        The file's path in its folder, or the object's name.
    read_with
        Further files that it is read with, named where another machine is to have them too.
    """

    path: Path | None
    label: str
    read_with: tuple[Path, ...] = ()

    @property
    def files(self) -> tuple[Path, ...]:
        """All files that it is read from."""
        return (self.path, *self.read_with) if self.path else ()


# How numerical code fails on numbers that nobody thought of. Not among them are a full disk, and
# what is wrong in our code whatever the mesh: a name or a type.
UNFORESEEN = (ArithmeticError, AssertionError, LookupError, RuntimeError, ValueError)


def all_sources(
    paths: Sequence[Path], folder: Path | None, embedded_beside: bool
) -> tuple[list[Source], frozenset[str]]:
    """Every source, and the names of the embedded ones that meshes are trained beside.

    Parameters
    ----------
    paths
        Mesh files of the folder.
    folder
        The mesh folder; without one the embedded objects are the sources.
    embedded_beside
        Whether the embedded objects stand beside the meshes.

    Returns
    -------
    The sources and the names.

    Raises
    ------
    MeshError
        A mesh has the name of an embedded object that would stand beside it.
    """
    embedded: list[Source] = [Source(None, name) for name in sorted(PARAMETRIC_OBJECTS)]
    if folder is None:
        return embedded, frozenset()
    meshes: list[Source] = [
        Source(path, path.relative_to(folder).as_posix())
        for path in standalone(list(paths), folder)
    ]
    if not embedded_beside:
        return meshes, frozenset()
    for source in meshes:
        if readable_name(source.label) in PARAMETRIC_OBJECTS:
            raise MeshError(
                f"{source.path} has the name of an embedded object",
                "Rename the file, or set objects.embedded_in_training = false",
            )
    return meshes + embedded, frozenset(PARAMETRIC_OBJECTS)


def with_all_files(
    sources: Sequence[Source], folder: Path | None, config: ObjectsConfig
) -> list[Source]:
    """The sources with the names of all files that they are read from."""
    return [
        replace(source, read_with=read_with(source.path, folder, config))
        if source.path and folder
        else source
        for source in sources
    ]


def files_of(sources: Sequence[Source]) -> list[Path]:
    """The files that sources name, each once."""
    return list(dict.fromkeys(path for source in sources for path in source.files))


def measured_or_why_not(
    source: Source, config: ObjectsConfig, folder: Path | None
) -> MeasuredObject | MeshError:
    """One source loaded, repaired and measured, or why it cannot be.

    Parameters
    ----------
    source
        What to load.
    config
        How meshes are taken in.
    folder
        The mesh folder; None where there is none.

    Returns
    -------
    The object at its own size, or the reason.
    """

    def loaded() -> MeshSource:
        if source.path is None or folder is None:
            return parametric_source(source.label)
        return load_object_file(source.path, folder, source.label, config)

    return made_or_why_not(source.label, lambda: measure_object(loaded(), config))


def finished_or_why_not(
    drawn: tuple[MeasuredObject, np.random.Generator, float | None],
    config: ObjectsConfig,
    cache: Path,
) -> CatalogueObject | MeshError:
    """One object rescaled and cut into convex parts, or why it cannot be.

    Parameters
    ----------
    drawn
        The object at its own size, what its further size is drawn with, and its mass, where it is
        known [kg].
    config
        Sizes and convex parts.
    cache
        Folder where convex parts are kept.

    Returns
    -------
    The object, or the reason.
    """
    measured, rng, mass_kg = drawn
    make = partial(finish_object, measured, config, rng, cache, mass_kg)
    return made_or_why_not(measured.origin, make)


def made_or_why_not(label: str, make: Callable[[], Result]) -> Result | MeshError:
    """What is made of a mesh, or why it is left out.

    Parameters
    ----------
    label
        The mesh's file.
    make
        Makes something of it.

    Returns
    -------
    What ``make`` returns, or the reason: the refusal that it raised, or where it failed.
    """
    try:
        return make()
    except MeshError as error:
        return error
    except UNFORESEEN as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return MeshError(
            f"{label} is more than softgrip can work on: {type(error).__name__} in "
            f"{Path(where.filename).name}, {where.name}: {str(error) or 'no words'}",
            "Mend the mesh, and report it: what is wrong with it should have a name",
        )
