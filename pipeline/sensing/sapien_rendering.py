"""A scene's pictures by SAPIEN's rasteriser."""

from collections.abc import Mapping, Sequence

import numpy as np
import sapien
from jaxtyping import UInt16

from pipeline.config.scenes import ScenesConfig
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.physics.appearance import body_colour, mesh_visual
from pipeline.physics.engine import body_id_of, body_name, new_world, sapien_pose
from pipeline.world.cameras import PinholeCamera
from pipeline.world.scene import PlacedObject
from pipeline.world.view import CameraView, normal_map

_NEAR_M, _FAR_M = 0.05, 10.0  # clipping planes, beyond all that a scene holds
# SAPIEN's camera looks along +x with y left and z up; CCS looks along +z with x right, y down.
_CAMERA_FROM_SAPIEN = np.array(
    [[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)


# The rasteriser's normals have y up and z towards the camera.
_CCS_FROM_OPENGL = np.array([1.0, -1.0, -1.0], dtype=np.float32)

_Optics = tuple[int, int, tuple[float, ...]]


class SapienRenderer:
    """SAPIEN's rasteriser, on a GPU or on lavapipe.

    All scenes share one world: the driver compiles its shaders once for each kind of camera, which
    takes seconds on a CPU, and the mesh of an object stays uploaded while the object stays in view.
    Building it raises MachineError where no Vulkan driver can render.
    """

    name = "sapien"

    def __init__(self, config: ScenesConfig) -> None:
        self._world = new_world(config, render=True)
        self._cameras: dict[_Optics, sapien.Entity] = {}
        self._shown: dict[tuple[str, int], sapien.Entity] = {}

    def views(
        self,
        placed: Sequence[PlacedObject],
        objects: Mapping[str, CatalogueObject],
        cameras: Sequence[PinholeCamera],
    ) -> tuple[CameraView, ...]:
        """One exact view a camera."""
        self._show(placed, objects)
        ids = {entity.per_scene_id: body_id_of(entity) for entity in self._world.entities}
        lookup = np.zeros(max(ids) + 1, dtype=np.uint16)
        for entity_id, body_id in ids.items():
            lookup[entity_id] = body_id
        return tuple(self._view(camera, lookup) for camera in cameras)

    def _show(self, placed: Sequence[PlacedObject], objects: Mapping[str, CatalogueObject]) -> None:
        """Put the objects where they are and take all others away."""
        wanted = {(p.object_name, p.body_id): p.world_from_object for p in placed}
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

    def _view(self, camera: PinholeCamera, lookup: UInt16[np.ndarray, " n"]) -> CameraView:
        optics = (camera.width_px, camera.height_px, tuple(camera.intrinsics.ravel().tolist()))
        if optics not in self._cameras:
            self._cameras[optics] = _add_camera(self._world, camera)
        entity = self._cameras[optics]
        entity.pose = sapien_pose(camera.world_from_camera @ _CAMERA_FROM_SAPIEN)
        self._world.update_render()
        component = entity.find_component_by_type(sapien.render.RenderCameraComponent)
        component.take_picture()
        position = component.get_picture("Position")
        seen = position[..., 3] < 1.0
        body = component.get_picture("Segmentation")[..., 1]
        colour = component.get_picture("Color")[..., :3]
        normals = component.get_picture("Normal")[..., :3] * _CCS_FROM_OPENGL
        return CameraView(
            camera=camera,
            depth_m=np.where(seen, np.maximum(-position[..., 2], 0.0), 0.0).astype(np.float32),
            colour=(255 * np.clip(colour, 0, 1) + 0.5).astype(np.uint8),
            segmentation=np.where(seen, lookup[np.minimum(body, len(lookup) - 1)], 0),
            normals=normal_map(normals * seen[..., None]),
        )


def render_table(config: ScenesConfig, camera: PinholeCamera) -> CameraView:
    """Render the empty table: the smallest picture that shows whether a driver works."""
    return SapienRenderer(config).views((), {}, (camera,))[0]


def _add_camera(world: sapien.Scene, camera: PinholeCamera) -> sapien.Entity:
    component = sapien.render.RenderCameraComponent(camera.width_px, camera.height_px)
    k = camera.intrinsics
    component.set_perspective_parameters(
        _NEAR_M, _FAR_M, k[0, 0], k[1, 1], k[0, 2], k[1, 2], k[0, 1]
    )
    entity = sapien.Entity()
    entity.name = "camera"
    entity.add_component(component)
    world.add_entity(entity)
    return entity
