"""A ball on the table, as one depth camera half a metre above sees it."""

from dataclasses import replace

import numpy as np
import trimesh

from pipeline.config import RunConfig
from pipeline.geometry.transforms import frame_from_z, look_at
from pipeline.labelling.scene import scene_surfaces
from pipeline.world.cameras import PinholeCamera, pixel_rays
from pipeline.world.posed_bodies import TABLE
from pipeline.world.raycasting import RayScene
from pipeline.world.scene import ClutterScene, PlacedObject
from pipeline.world.view import CameraView
from tests.bodies import mesh_of

WIDTH_PX, HEIGHT_PX = 128, 96


def scene_of_a_ball(split: str, near_m: float = 0.25) -> tuple[ClutterScene, RayScene]:
    """The scene with its exact picture, and its true surfaces; a lidar measures from near_m on."""
    ball = mesh_of(trimesh.creation.icosphere(subdivisions=3, radius=0.045))
    placed = PlacedObject("ball", 1, frame_from_z(np.array([0, 0, 0.045]), np.array([0, 0, 1.0])))
    scene = ClutterScene("one", 1, split, 0, (placed,), np.full(1, np.inf), (), 0.0, ())
    surfaces = scene_surfaces(scene, {"ball": ball}, RunConfig().scenes.table_side_m)
    k = np.array([[130.0, 0, WIDTH_PX / 2], [0, 130.0, HEIGHT_PX / 2], [0, 0, 1.0]])
    pose = look_at(np.array([0.05, -0.1, 0.6]), np.zeros(3))
    camera = PinholeCamera("one", WIDTH_PX, HEIGHT_PX, k, pose, "lidar", near_m, 9.0)
    origin, rays = pixel_rays(camera, np.ones((HEIGHT_PX, WIDTH_PX), dtype=bool))
    hits = surfaces.cast(np.broadcast_to(origin, rays.shape), rays)
    depth_m = (hits.distance_m * (rays @ pose[:3, 2])).reshape(HEIGHT_PX, WIDTH_PX)
    facing = np.broadcast_to(np.array([128, 128, 1], dtype=np.uint8), (HEIGHT_PX, WIDTH_PX, 3))
    body = np.maximum(hits.body, TABLE).reshape(HEIGHT_PX, WIDTH_PX).astype(np.uint16)
    colour = np.zeros((HEIGHT_PX, WIDTH_PX, 3), dtype=np.uint8)
    view = CameraView(camera, depth_m, colour, body, facing)
    return replace(scene, views=(view,)), surfaces
