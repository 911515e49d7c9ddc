"""Depth images of scenes whose truth is known: a table or a bin with boxes, seen by rays."""

import json
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from pipeline.camera.frame import Frame, camera_of_picture
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import look_at
from pipeline.world.cameras import pixel_rays
from pipeline.world.raycasting import RayScene

FOCAL_PX, WIDTH_PX, HEIGHT_PX = 300.0, 320, 240
INTRINSICS = np.array(
    [[FOCAL_PX, 0.0, WIDTH_PX / 2], [0.0, FOCAL_PX, HEIGHT_PX / 2], [0.0, 0.0, 1.0]]
)


def box(extents: tuple[float, float, float], at: tuple[float, float, float]) -> Mesh:
    """A box with its centre at a place."""
    shape = trimesh.creation.box(extents=extents)
    shape.apply_translation(at)
    return Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))


def table() -> Mesh:
    return box((0.9, 0.9, 0.02), (0.0, 0.0, -0.01))


def bin_walls(inner_m: float = 0.4, height_m: float = 0.15) -> list[Mesh]:
    half, thick = inner_m / 2 + 0.01, 0.02
    return [
        box((thick, inner_m + 2 * thick, height_m), (side * half, 0.0, height_m / 2))
        for side in (-1, 1)
    ] + [
        box((inner_m + 2 * thick, thick, height_m), (0.0, side * half, height_m / 2))
        for side in (-1, 1)
    ]


def rounded_bin(inner_m: float = 0.4, height_m: float = 0.15, rounding_m: float = 0.045) -> Mesh:
    """A square bin whose floor passes into its walls with a radius, open above, floor at z = 0."""
    rings = np.append(np.linspace(0.0, np.pi / 2, 9), np.nan)
    half = inner_m / 2
    vertices = []
    for angle in rings:
        top = np.isnan(angle)
        out = half if top else half - rounding_m * (1.0 - np.sin(angle))
        up = height_m if top else rounding_m * (1.0 - np.cos(angle))
        vertices += [(x * out, y * out, up) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    faces = [(0, 1, 2), (0, 2, 3)]
    for ring in range(len(rings) - 1):
        for side in range(4):
            a, b = 4 * ring + side, 4 * ring + (side + 1) % 4
            faces += [(a, b, b + 4), (a, b + 4, a + 4)]
    return Mesh(np.array(vertices, dtype=np.float64), np.array(faces, dtype=np.int64))


def seen(
    bodies: list[Mesh],
    eye_m: tuple[float, float, float],
    noise: float,
    posed: bool,
    seed: int = 0,
) -> Frame:
    """What a camera at a place sees of bodies, looking at the origin.

    noise : standard deviation of the depth, as a share of it.
    """
    pose = look_at(np.array(eye_m), np.array([0.0, 0.0, 0.02]))
    camera = camera_of_picture("synthetic", (HEIGHT_PX, WIDTH_PX), INTRINSICS, pose)
    origin, directions = pixel_rays(camera, np.ones((HEIGHT_PX, WIDTH_PX), dtype=bool))
    hits = RayScene(bodies).cast(np.broadcast_to(origin, directions.shape), directions)
    forward = directions @ pose[:3, 2]
    depth = np.where(hits.body >= 0, hits.distance_m * forward, 0.0).reshape(HEIGHT_PX, WIDTH_PX)
    rng = np.random.default_rng(seed)
    depth = depth * (1.0 + noise * rng.normal(size=depth.shape))
    if not posed:
        camera = camera_of_picture("synthetic", (HEIGHT_PX, WIDTH_PX), INTRINSICS, np.eye(4))
    return Frame("synthetic", depth, camera, posed, np.ones(depth.shape, dtype=bool))


def written(frame: Frame, folder: Path, name: str, mask: np.ndarray | None = None) -> Path:
    """A frame as files: a 16-bit PNG in millimetres, its camera beside it, and a mask."""
    path = folder / f"{name}.depth.png"
    Image.fromarray(np.round(1e3 * frame.depth_m).astype(np.uint16)).save(path)
    k = frame.camera.intrinsics.copy()
    k[:2, 2] -= 0.5
    camera = {"intrinsics": k.tolist()}
    if frame.posed:
        camera["world_from_camera"] = frame.camera.world_from_camera.tolist()
    (folder / f"{name}.json").write_text(json.dumps(camera))
    if mask is not None:
        Image.fromarray(mask).save(folder / f"{name}.mask.png")
    return path
