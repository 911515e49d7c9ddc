"""The triangle that each pixel shows: triangles drawn into a picture, instead of rays cast.

What the ray through a pixel's centre would hit first, found the other way round: each triangle is
drawn over the pixels in the rectangle around it, and the nearest stays. Rays need a tree of all
triangles first, which for a clutter of fine meshes takes longer than all else; this needs nothing.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.compiled_code import njit
from pipeline.geometry.transforms import invert
from pipeline.world.cameras import PIXEL_CENTRE_PX, PinholeCamera

# A rectangle is wider by this, as projection rounds; what a triangle covers is decided exactly.
_WIDER_PX = 1e-6
# A side counts as farther out by this share of the squared distance, so that rounding leaves no gap
# between neighbours: 1e-11 m for sides of a millimetre at a metre.
_WIDER_SIDES = 1e-14
# Corners nearer than this to the plane through the camera's centre are not projected [m].
_AHEAD_M = 1e-6
# A triangle is left out where it lies behind the nearest one by more than this share of the depth.
_DEEPER = 1e-9


def first_faces(
    vertices_m: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "m 3"],
    camera: PinholeCamera,
    shown: Bool[np.ndarray, "h w"],
    rays: Float[np.ndarray, "n 3"],
) -> Int[np.ndarray, " n"]:
    """The face that the ray through each chosen pixel's centre hits first, from either side.

    Neighbours that share an edge leave no gap between them. Of two faces at one distance, as where
    a ray meets their edge, the result is one of both, and always the same.

    Parameters
    ----------
    vertices_m
        Corners in WCS [m], shape (v, 3).
    faces
        Indices of each triangle's corners, shape (m, 3).
    camera
        The camera.
    shown
        The chosen pixels, shape (h, w).
    rays
        Their rays by `cameras.pixel_rays`, shape (n, 3).

    Returns
    -------
    For each chosen pixel, row by row, the index of a face; -1 where the ray meets none.
    """
    k = camera.intrinsics
    vertices = np.ascontiguousarray(vertices_m, dtype=np.float64)
    ray_of_pixel = np.full(shown.shape, -1, dtype=np.int32)
    ray_of_pixel[shown] = np.arange(len(rays), dtype=np.int32)
    place = _projected(
        vertices,
        invert(camera.world_from_camera),
        (float(k[0, 0]), float(k[1, 1]), float(k[0, 2]), float(k[1, 2])),
    )
    return np.asarray(
        _drawn(
            vertices,
            np.ascontiguousarray(faces, dtype=np.int64),
            place,
            np.array(camera.world_from_camera[:3, 3]),
            np.array(camera.world_from_camera[:3, 2]),
            np.ascontiguousarray(rays),
            ray_of_pixel,
        )
    )


@njit(error_model="numpy")
def _projected(
    vertices: Float[np.ndarray, "v 3"],
    camera_from_world: Float[np.ndarray, "4 4"],
    lens: tuple[float, float, float, float],
) -> Float[np.ndarray, "v 3"]:
    """Column and row of each corner, whole at pixels' centres, and depth [m]; the first two are
    NaN where it is not ahead."""
    focal_x, focal_y, centre_x, centre_y = lens
    t = camera_from_world
    place = np.empty((len(vertices), 3))
    for i in range(len(vertices)):
        x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        depth = t[2, 0] * x + t[2, 1] * y + t[2, 2] * z + t[2, 3]
        right = t[0, 0] * x + t[0, 1] * y + t[0, 2] * z + t[0, 3]
        down = t[1, 0] * x + t[1, 1] * y + t[1, 2] * z + t[1, 3]
        place[i, 2] = depth
        if depth > _AHEAD_M:
            place[i, 0] = focal_x * (right / depth) + (centre_x - PIXEL_CENTRE_PX)
            place[i, 1] = focal_y * (down / depth) + (centre_y - PIXEL_CENTRE_PX)
        else:
            place[i, 0] = place[i, 1] = np.nan
    return place


@njit(error_model="numpy")
def _drawn(
    vertices: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "m 3"],
    place: Float[np.ndarray, "v 3"],
    origin: Float[np.ndarray, " 3"],
    ahead: Float[np.ndarray, " 3"],
    rays: Float[np.ndarray, "n 3"],
    ray_of_pixel: Int[np.ndarray, "h w"],
) -> Int[np.ndarray, " n"]:
    """Draw every triangle over the pixels around it; the face that stays in front at each ray."""
    height, width = ray_of_pixel.shape
    nearest, found = np.full(len(rays), np.inf), np.full(len(rays), -1)
    depth_of_nearest = np.full(len(rays), np.inf)  # a little more, as it only spares work
    for face in range(len(faces)):
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        left, right = _range(place[i, 0], place[j, 0], place[k, 0], width)
        if left > right:
            continue
        top, bottom = _range(place[i, 1], place[j, 1], place[k, 1], height)
        if top > bottom:
            continue
        depth = min(place[i, 2], place[j, 2], place[k, 2])
        begun = False
        for row in range(top, bottom + 1):
            for column in range(left, right + 1):
                ray = ray_of_pixel[row, column]
                if ray < 0 or depth > depth_of_nearest[ray]:
                    continue
                if not begun:
                    begun = True
                    ax, ay, az = _towards(vertices, i, origin)
                    bx, by, bz = _towards(vertices, j, origin)
                    cx, cy, cz = _towards(vertices, k, origin)
                    # Normals of the planes through the camera and each side.
                    ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
                    vx, vy, vz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
                    wx, wy, wz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
                    volume = ax * ux + ay * uy + az * uz
                    largest = max(_squared(ax, ay, az), _squared(bx, by, bz), _squared(cx, cy, cz))
                    least = -_WIDER_SIDES * largest
                x, y, z = rays[ray, 0], rays[ray, 1], rays[ray, 2]
                of_a = x * ux + y * uy + z * uz
                of_b = x * vx + y * vy + z * vz
                of_c = x * wx + y * wy + z * wz
                within = (of_a >= least and of_b >= least and of_c >= least) or (
                    of_a <= -least and of_b <= -least and of_c <= -least
                )
                if not within:
                    continue
                # Seen almost edge on, a triangle's plane is met anywhere, but it has an end.
                along_a = x * ax + y * ay + z * az
                along_b = x * bx + y * by + z * bz
                along_c = x * cx + y * cy + z * cz
                across = of_a + of_b + of_c
                distance = volume / across if across != 0.0 else 0.0
                distance = max(distance, min(along_a, along_b, along_c))
                distance = min(distance, max(along_a, along_b, along_c))
                if 0.0 < distance < nearest[ray]:
                    nearest[ray] = distance
                    found[ray] = face
                    along = x * ahead[0] + y * ahead[1] + z * ahead[2]
                    depth_of_nearest[ray] = distance * along * (1.0 + _DEEPER)
    return found


@njit(forceinline=True)
def _range(a: float, b: float, c: float, count: int) -> tuple[int, int]:
    """First and last pixel that a triangle may cover along an axis; all where it is not ahead."""
    if not np.isfinite(a + b + c):
        return 0, count - 1
    first = np.ceil(max(min(a, b, c) - _WIDER_PX, 0.0))
    last = np.floor(min(max(a, b, c) + _WIDER_PX, count - 1.0))
    if first > last:
        return 1, 0
    return int(first), int(last)


@njit(forceinline=True)
def _squared(x: float, y: float, z: float) -> float:
    """Squared length."""
    return x * x + y * y + z * z


@njit(forceinline=True)
def _towards(
    vertices: Float[np.ndarray, "v 3"], i: int, origin: Float[np.ndarray, " 3"]
) -> tuple[float, float, float]:
    """A corner relative to the camera's centre."""
    return vertices[i, 0] - origin[0], vertices[i, 1] - origin[1], vertices[i, 2] - origin[2]
