"""A scene's pictures by Embree rays, one through each pixel's centre."""

from collections.abc import Mapping

import numpy as np

from pipeline.clutter.scene import ClutterScene
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.raycasting import RayScene
from pipeline.geometry.table import table_mesh
from pipeline.sensing.cameras import PinholeCamera, pixel_rays
from pipeline.sensing.view import CameraView
from pipeline.simulation.appearance import body_colour

_TABLE_COLOUR = (0.5, 0.5, 0.48)
_LIGHT = np.array([-0.32, -0.39, 0.86])  # towards the light
_AMBIENT, _DIFFUSE = 0.35, 0.65


def ray_view(
    scene: ClutterScene,
    objects: Mapping[str, CatalogueObject],
    table_side_m: float,
    camera: PinholeCamera,
) -> CameraView:
    """Depth and segmentation by exact hits; colour by Lambert's law."""
    placed = scene.objects
    bodies = [objects[p.object_name].mesh.transformed(p.world_from_object) for p in placed]
    rays = RayScene([*bodies, table_mesh(table_side_m)])
    ids = np.array([*(p.body_id for p in placed), 0])
    shape = (camera.height_px, camera.width_px)
    origin, directions = pixel_rays(camera, np.ones(shape, dtype=bool))
    hits = rays.cast(np.broadcast_to(origin, directions.shape), directions)
    hit = hits.body >= 0
    forward = camera.world_from_camera[:3, 2]
    depth = np.where(hit, np.where(hit, hits.distance_m, 0.0) * (directions @ forward), 0.0)
    body = np.where(hit, ids[hits.body], 0)
    palette = np.array([_TABLE_COLOUR, *(body_colour(i) for i in range(1, int(ids.max()) + 1))])
    light = np.clip(np.nan_to_num(rays.normals_at(hits)) @ _LIGHT, 0.0, 1.0)
    shade = palette[body] * (_AMBIENT + _DIFFUSE * light)[:, None] * hit[:, None]
    return CameraView(
        camera,
        depth.reshape(shape).astype(np.float32),
        np.round(255 * np.clip(shade, 0, 1) ** (1 / 2.2)).reshape(*shape, 3).astype(np.uint8),
        body.reshape(shape).astype(np.uint16),
    )
