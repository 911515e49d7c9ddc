"""A scene's pictures by SAPIEN's rasteriser."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import sapien

from pipeline.clutter.scene import ClutterScene
from pipeline.config.scenes import ScenesConfig
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.sensing.cameras import PinholeCamera
from pipeline.sensing.view import CameraView
from pipeline.simulation.appearance import body_colour, mesh_visual
from pipeline.simulation.engine import body_id_of, body_name, new_world, sapien_pose

_NEAR_M, _FAR_M = 0.05, 10.0
# SAPIEN's camera looks along +x with y left and z up; CCS looks along +z with x right, y down.
_CAMERA_FROM_SAPIEN = np.array(
    [[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)


class SapienRenderer:
    """SAPIEN's rasteriser on a GPU or on lavapipe.

    One world is kept for all scenes: a driver compiles its shaders once a camera, which takes
    seconds on a CPU, and a mesh is uploaded once for as long as its object stays on the table.
    Raises MachineError where no Vulkan driver can render.
    """

    name = "sapien"

    def __init__(self, config: ScenesConfig, cameras: tuple[PinholeCamera, ...]) -> None:
        self._world = new_world(config, render=True)
        self._cameras = [(camera, _add_camera(self._world, camera)) for camera in cameras]
        self._shown: dict[tuple[str, int], sapien.Entity] = {}

    def rendered(self, scene: ClutterScene, objects: Mapping[str, CatalogueObject]) -> ClutterScene:
        """The same scene with its views, one a camera."""
        self._show(scene, objects)
        self._world.update_render()
        ids = {entity.per_scene_id: body_id_of(entity) for entity in self._world.entities}
        lookup = np.zeros(max(ids) + 1, dtype=np.uint16)
        for entity_id, body_id in ids.items():
            lookup[entity_id] = body_id
        views = tuple(_view(camera, component, lookup) for camera, component in self._cameras)
        return replace(scene, views=views)

    def _show(self, scene: ClutterScene, objects: Mapping[str, CatalogueObject]) -> None:
        """Put the scene's objects where they are and take all others away."""
        wanted = {(p.object_name, p.body_id): p.world_from_object for p in scene.objects}
        for key in self._shown.keys() - wanted.keys():
            self._world.remove_entity(self._shown.pop(key))
        for key, world_from_object in wanted.items():
            if key not in self._shown:
                name, body_id = key
                entity = sapien.Entity()
                entity.name = body_name(body_id)
                entity.add_component(mesh_visual(objects[name].mesh, body_colour(body_id)))
                self._world.add_entity(entity)
                self._shown[key] = entity
            self._shown[key].pose = sapien_pose(world_from_object)


def rendered_table(config: ScenesConfig, camera: PinholeCamera) -> CameraView:
    """The empty table: the least picture there is, to try a driver with."""
    empty = ClutterScene("empty", 1, "train", 0, (), np.empty(0), (), 0.0, ())
    return SapienRenderer(config, (camera,)).rendered(empty, {}).views[0]


def _add_camera(world: sapien.Scene, camera: PinholeCamera) -> sapien.render.RenderCameraComponent:
    component = sapien.render.RenderCameraComponent(camera.width_px, camera.height_px)
    k = camera.intrinsics
    component.set_perspective_parameters(
        _NEAR_M, _FAR_M, k[0, 0], k[1, 1], k[0, 2], k[1, 2], k[0, 1]
    )
    entity = sapien.Entity()
    entity.name = camera.name
    entity.add_component(component)
    entity.pose = sapien_pose(camera.world_from_camera @ _CAMERA_FROM_SAPIEN)
    world.add_entity(entity)
    return component


def _view(
    camera: PinholeCamera, component: sapien.render.RenderCameraComponent, lookup: np.ndarray
) -> CameraView:
    component.take_picture()
    position = component.get_picture("Position")
    depth = np.where(position[..., 3] < 1.0, -position[..., 2], 0.0).astype(np.float32)
    colour = component.get_picture("Color")[..., :3]
    segmentation = lookup[
        np.minimum(component.get_picture("Segmentation")[..., 1], len(lookup) - 1)
    ]
    return CameraView(
        camera,
        np.maximum(depth, 0.0),
        np.clip(np.round(255 * colour), 0, 255).astype(np.uint8),
        segmentation,
    )
