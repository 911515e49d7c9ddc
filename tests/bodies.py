"""Catalogue objects of known shape, for tests."""

from pathlib import Path

import numpy as np
import trimesh

from pipeline.config import ObjectsConfig
from pipeline.geometry.catalogue import CatalogueObject, MeasuredObject, finish_object
from pipeline.geometry.descriptor import describe
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.mesh_files import MeshSource
from pipeline.geometry.shape import nsvr, shape_class


def mesh_of(shape: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(shape.vertices, np.float64), np.asarray(shape.faces, np.int64))


def catalogue_object(
    name: str, shape: trimesh.Trimesh, cache: Path, density_kg_m3: float = 300.0
) -> CatalogueObject:
    """The shape at its own size, through the pipeline's own steps."""
    mesh = mesh_of(shape)
    source = MeshSource(name, name, "none", mesh, "m", "declared")
    value = nsvr(mesh)
    extent = float(mesh.extents_m.max())
    multiple = extent / ObjectsConfig().r_g_m
    config = ObjectsConfig(
        target_extent_min_rg=multiple,
        target_extent_max_rg=multiple,
        density_kg_m3=density_kg_m3,
        density_spread=1.0,
    )
    measured = MeasuredObject(source, mesh, (), value, shape_class(value), describe(mesh))
    return finish_object(measured, config, np.random.default_rng(0), cache)


def pose_at(x_m: float, y_m: float, z_m: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = x_m, y_m, z_m
    return pose
