"""A scene's pictures by SAPIEN's rasteriser."""

from collections.abc import Mapping

import numpy as np
import sapien

from pipeline.clutter.scene import ClutterScene
from pipeline.config.scenes import ScenesConfig
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.sensing.cameras import PinholeCamera
from pipeline.sensing.view import CameraView
from pipeline.simulation.appearance import body_colour
from pipeline.simulation.engine import add_body, body_id_of, new_world, sapien_pose

_NEAR_M, _FAR_M = 0.05, 10.0
# SAPIEN's camera looks along +x with y left and z up; CCS looks along +z with x right, y down.
_CAMERA_FROM_SAPIEN = np.array(
    [[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)


def sapien_views(
    scene: ClutterScene,
    objects: Mapping[str, CatalogueObject],
    config: ScenesConfig,
    cameras: tuple[PinholeCamera, ...],
) -> tuple[CameraView, ...]:
    """One view a camera; the world is built for them and let go."""
    world = new_world(config, render=True)
    for placed in scene.objects:
        add_body(
            world,
            objects[placed.object_name],
            placed.world_from_object,
            placed.body_id,
            body_colour(placed.body_id),
            config,
        )
    world.update_render()
    ids = {entity.per_scene_id: body_id_of(entity) for entity in world.entities}
    lookup = np.zeros(max(ids) + 1, dtype=np.uint16)
    for entity_id, body_id in ids.items():
        lookup[entity_id] = body_id
    return tuple(_view(world, camera, lookup) for camera in cameras)


def _view(world: sapien.Scene, camera: PinholeCamera, lookup: np.ndarray) -> CameraView:
    component = sapien.render.RenderCameraComponent(camera.width_px, camera.height_px)
    k = camera.intrinsics
    component.set_perspective_parameters(
        _NEAR_M, _FAR_M, k[0, 0], k[1, 1], k[0, 2], k[1, 2], k[0, 1]
    )
    entity = sapien.Entity()
    entity.add_component(component)
    entity.pose = sapien_pose(camera.world_from_camera @ _CAMERA_FROM_SAPIEN)
    world.add_entity(entity)
    world.update_render()
    component.take_picture()
    position = component.get_picture("Position")
    depth = np.where(position[..., 3] < 1.0, -position[..., 2], 0.0).astype(np.float32)
    colour = component.get_picture("Color")[..., :3]
    segmentation = lookup[
        np.minimum(component.get_picture("Segmentation")[..., 1], len(lookup) - 1)
    ]
    world.remove_entity(entity)
    return CameraView(
        camera,
        np.maximum(depth, 0.0),
        np.clip(np.round(255 * colour), 0, 255).astype(np.uint8),
        segmentation,
    )
