"""What a depth camera measures of moving bodies: a ray through each pixel, then the sensor's noise.

It gives the same exact depth as `ray_rendering`, but no colour, and the bodies may have new poses
at every picture. It is the camera of the closed loop, where a picture must take milliseconds.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Integer

from pipeline.compiled_code import njit
from pipeline.geometry.transforms import invert, transform_points
from pipeline.sensing.depth_noise import disturb
from pipeline.world.cameras import PinholeCamera, picture_rays, project_local
from pipeline.world.raycasting import Surfaces
from pipeline.world.view import CameraView, normal_map


def measure_depth(
    camera: PinholeCamera,
    scene: Surfaces,
    opaque: Surfaces | None,
    rng: np.random.Generator | None,
) -> tuple[Float[np.ndarray, "h w"], Integer[np.ndarray, "h w"]]:
    """Take a depth picture, and tell which body each pixel shows.

    Parameters
    ----------
    camera
        Where the picture is taken from.
    scene
        Surfaces of all bodies.
    opaque
        Surfaces of the opaque bodies only; None where no body is transparent.
    rng
        Draws the sensor's noise; None for an exact picture.

    Returns
    -------
    Depth along the camera's z [m], 0 where nothing is measured; and the id of the body at each
    pixel, 0 for the table or nothing; both of shape (h, w).
    """
    view = _exact(camera, scene)
    if opaque is not None:
        view = replace(view, behind_m=_exact(camera, opaque).depth_m)
    return view.depth_m if rng is None else disturb(view, rng), view.segmentation


def window_around(
    camera: PinholeCamera, point_m: Float[np.ndarray, " 3"], radius_m: float
) -> PinholeCamera:
    """Cut the camera's picture to the part that shows a sphere.

    Parameters
    ----------
    camera
        Camera of the whole picture.
    point_m
        Centre of the sphere in WCS [m], shape (3,).
    radius_m
        Radius of the sphere [m].

    Returns
    -------
    Camera of that part: a square around the sphere's picture, cut at the borders of the whole
    picture, with at least one pixel.
    """
    k = camera.intrinsics
    x, y, z = transform_points(invert(camera.world_from_camera), point_m)
    near = max(z - radius_m, 1e-3)
    half = radius_m * k[0, 0] / near
    u, v = project_local(k, np.array([x, y, max(z, 1e-3)])).tolist()
    left, right = _span(u, half, camera.width_px)
    top, bottom = _span(v, half, camera.height_px)
    intrinsics = k.copy()
    intrinsics[:2, 2] -= [left, top]
    return replace(camera, width_px=right - left, height_px=bottom - top, intrinsics=intrinsics)


def _span(middle: float, half: float, size: int) -> tuple[int, int]:
    first = int(np.clip(np.floor(middle - half), 0, size - 1))
    last = int(np.clip(np.ceil(middle + half), first + 1, size))
    return first, last


def _exact(camera: PinholeCamera, scene: Surfaces) -> CameraView:
    pose = camera.world_from_camera
    shape = (camera.height_px, camera.width_px)
    directions = picture_rays(camera)
    hits = scene.cast(np.broadcast_to(pose[:3, 3], directions.shape), directions)
    depth, normals = _seen(directions, hits.distance_m, scene.normals_at(hits), pose)
    return CameraView(
        camera=camera,
        depth_m=depth.reshape(shape),
        colour=np.zeros((*shape, 3), np.uint8),
        segmentation=np.maximum(hits.body, 0).reshape(shape).astype(np.uint16),
        normals=normal_map(normals.reshape(*shape, 3)),
    )


@njit()
def _seen(
    rays: Float[np.ndarray, "n 3"],
    distance: Float[np.ndarray, " n"],
    world_normals: Float[np.ndarray, "n 3"],
    pose: Float[np.ndarray, "4 4"],
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    """Depth along the camera's z, 0 where nothing is hit, and normals in CCS towards the camera.

    The back of an open surface counts as seen, as a real sensor measures it too.
    """
    depth = np.zeros(len(rays), dtype=np.float32)
    normals = np.zeros((len(rays), 3))
    for i in range(len(rays)):
        if not distance[i] < np.inf:
            continue
        along = facing = 0.0
        for axis in range(3):
            along += rays[i, axis] * pose[axis, 2]
            facing += rays[i, axis] * world_normals[i, axis]
        depth[i] = distance[i] * along
        sign = -1.0 if facing > 0.0 else 1.0
        for axis in range(3):
            normals[i, axis] = sign * (
                pose[0, axis] * world_normals[i, 0]
                + pose[1, axis] * world_normals[i, 1]
                + pose[2, axis] * world_normals[i, 2]
            )
    return depth, normals
