"""A cube, a ball and a glass ball on the table, and the cameras beside it."""

import numpy as np
import trimesh

from pipeline.config import ObjectsConfig, StaticCameraConfig
from pipeline.geometry.catalogue import CatalogueObject, MeasuredObject, finish_object
from pipeline.geometry.descriptor import describe
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.mesh_files import MeshSource
from pipeline.geometry.shape import nsvr, shape_class
from pipeline.world.scene import ClutterScene, PlacedObject
from pipeline.world.scene_cameras import static_cameras

CAMERAS = static_cameras(StaticCameraConfig())


def made_object(name: str, shape: trimesh.Trimesh, cache: object) -> CatalogueObject:
    mesh = Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))
    source = MeshSource(name, name, "none", mesh, "m", "declared")
    value = nsvr(mesh)
    measured = MeasuredObject(source, mesh, (), value, shape_class(value), describe(mesh))
    config = ObjectsConfig(target_extent_min_rg=4, target_extent_max_rg=4, transparent=("glass*",))
    return finish_object(measured, config, np.random.default_rng(0), cache)  # type: ignore[arg-type]


def scene_of(*placed: PlacedObject) -> ClutterScene:
    return ClutterScene("s", 1, "train", 0, placed, np.full(len(placed), np.inf), (), 0.0, ())


def at(x: float, y: float, z: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


CUBE_AND_BALL = scene_of(
    PlacedObject("cube", 1, at(-0.1, 0, 0.05)), PlacedObject("ball", 2, at(0.1, 0, 0.05))
)
