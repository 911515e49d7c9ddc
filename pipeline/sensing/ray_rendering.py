"""A scene's pictures by Embree rays, one through each pixel's centre."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from pipeline.config.scenes import ScenesConfig
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import invert, rotate_vectors
from pipeline.physics.appearance import body_colour, crease_normals
from pipeline.world.cameras import PinholeCamera, pixel_rays
from pipeline.world.posed_bodies import TABLE, bodies_at_rest, surfaces_at_rest
from pipeline.world.raycasting import RayHits, RayScene
from pipeline.world.scene import PlacedObject
from pipeline.world.view import CameraView, normal_map

_TABLE_COLOUR = (0.5, 0.5, 0.48)  # a grey that no object has
_LIGHT = np.array([-0.32, -0.39, 0.86])  # towards the light
_AMBIENT, _DIFFUSE = 0.35, 0.65  # shares of light from everywhere and from the lamp


class RayRenderer:
    """Renders with Embree rays: needs no driver; depth as SAPIEN's, colours simpler."""

    name = "embree"

    def __init__(self, config: ScenesConfig) -> None:
        self._table_side_m = config.table_side_m

    def views(
        self,
        placed: Sequence[PlacedObject],
        objects: Mapping[str, CatalogueObject],
        cameras: Sequence[PinholeCamera],
    ) -> tuple[CameraView, ...]:
        """One exact view a camera."""
        meshes = {p.object_name: objects[p.object_name].mesh for p in placed}
        bodies = bodies_at_rest(placed, meshes, self._table_side_m)
        surfaces = surfaces_at_rest(bodies)
        return tuple(_view(surfaces, bodies, camera) for camera in cameras)


def _view(surfaces: RayScene, bodies: Mapping[int, Mesh], camera: PinholeCamera) -> CameraView:
    """Depth and segmentation by exact hits; colour by Lambert's law.

    Parameters
    ----------
    surfaces
        What rays are cast at.
    bodies
        The same by body id, in WCS.
    camera
        Where the picture is taken from.

    Returns
    -------
    The exact picture.
    """
    shape = (camera.height_px, camera.width_px)
    origin, directions = pixel_rays(camera, np.ones(shape, dtype=bool))
    hits = surfaces.cast(np.broadcast_to(origin, directions.shape), directions)
    hit = hits.body >= 0
    distance = np.where(hit, hits.distance_m, 0.0)
    depth = distance * (directions @ camera.world_from_camera[:3, 2])
    body = np.maximum(hits.body, TABLE)
    normals = _shading_normals(surfaces, bodies, hits, origin + distance[:, None] * directions)
    palette = np.array([_TABLE_COLOUR, *(body_colour(i) for i in range(1, max(bodies) + 1))])
    light = np.clip(normals @ _LIGHT, 0.0, 1.0)
    shade = palette[body] * (_AMBIENT + _DIFFUSE * light)[:, None] * hit[:, None]
    in_camera = rotate_vectors(invert(camera.world_from_camera), normals)
    return CameraView(
        camera=camera,
        depth_m=depth.reshape(shape).astype(np.float32),
        colour=np.round(255 * np.clip(shade, 0, 1) ** (1 / 2.2))
        .reshape(*shape, 3)
        .astype(np.uint8),
        segmentation=body.reshape(shape).astype(np.uint16),
        normals=normal_map(in_camera.reshape(*shape, 3)),
    )


def _shading_normals(
    surfaces: RayScene,
    bodies: Mapping[int, Mesh],
    hits: RayHits,
    points_m: Float[np.ndarray, "n 3"],
) -> Float[np.ndarray, "n 3"]:
    """Unit normals in WCS, smooth but for creases, as the rasteriser has them; 0 where no hit."""
    normals = np.zeros((len(hits.body), 3))
    weights = surfaces.barycentric_at(hits, points_m)
    for body_id, mesh in bodies.items():
        rows = np.flatnonzero(hits.body == body_id)
        corners = crease_normals(mesh)[hits.triangle[rows]]
        mixed = np.einsum("nk,nkj->nj", weights[rows], corners)
        normals[rows] = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return normals
