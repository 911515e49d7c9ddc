"""The embedded object set: closed parametric objects of every class, made without a download."""

import inspect
from collections.abc import Callable
from types import ModuleType

import numpy as np

from pipeline.geometry.mesh import Mesh
from pipeline.geometry.mesh_files import MeshSource
from pipeline.geometry.parametric import blocks, containers, frames, slabs
from pipeline.geometry.parametric.solids import Solid

FAMILIES = (blocks, containers, frames, slabs)
# Long edges are split so that a face is never much larger than the pad's cells.
_EDGE_M = 0.006


def _builders(family: ModuleType) -> dict[str, Callable[[], Solid]]:
    """The family's public builders of its own, by name."""
    return {
        name: builder
        for name, builder in inspect.getmembers(family, inspect.isfunction)
        if builder.__module__ == family.__name__ and not name.startswith("_")
    }


PARAMETRIC_OBJECTS: dict[str, Callable[[], Solid]] = {
    name: builder for family in FAMILIES for name, builder in _builders(family).items()
}


def build(name: str) -> Mesh:
    """The object's closed mesh in metres, z up."""
    solid = PARAMETRIC_OBJECTS[name]().refine_to_length(_EDGE_M)
    mesh = solid.to_mesh64()
    return Mesh(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts).astype(np.int64))


def parametric_source(name: str) -> MeshSource:
    """The object as a source beside mesh files."""
    return MeshSource(name, "parametric", "parametric", build(name), "m", "declared")
