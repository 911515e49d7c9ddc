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

# A rectangle is wider by this, as projection rounds; what lies within is decided by the corners.
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
    around, depth_m = _projected(
        vertices,
        invert(camera.world_from_camera),
        (float(k[0, 0]), float(k[1, 1]), float(k[0, 2]), float(k[1, 2])),
        shown.shape,
    )
    return np.asarray(
        _drawn(
            vertices,
            np.ascontiguousarray(faces),
            around,
            depth_m,
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
    shape: tuple[int, int],
) -> tuple[Int[np.ndarray, "v 4"], Float[np.ndarray, " v"]]:
    """Pixels whose centres lie next to each corner: the first column to its right, the last to its
    left, the first row below, the last above; and its depth [m].

    Of a triangle's corners the least first and the largest last pixel are those that it may cover.
    They are all pixels where a corner is not ahead.
    """
    height, width = shape
    focal_x, focal_y, centre_x, centre_y = lens
    t = camera_from_world
    around, depths = np.empty((len(vertices), 4), np.int32), np.empty(len(vertices))
    for i in range(len(vertices)):
        x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        depth = t[2, 0] * x + t[2, 1] * y + t[2, 2] * z + t[2, 3]
        depths[i] = depth
        if depth > _AHEAD_M:
            right = t[0, 0] * x + t[0, 1] * y + t[0, 2] * z + t[0, 3]
            down = t[1, 0] * x + t[1, 1] * y + t[1, 2] * z + t[1, 3]
            column = focal_x * (right / depth) + (centre_x - PIXEL_CENTRE_PX)
            row = focal_y * (down / depth) + (centre_y - PIXEL_CENTRE_PX)
            around[i, 0], around[i, 1] = _next_to(column, width)
            around[i, 2], around[i, 3] = _next_to(row, height)
        else:
            around[i, 0], around[i, 1], around[i, 2], around[i, 3] = 0, width - 1, 0, height - 1
    return around, depths


@njit(forceinline=True)
def _next_to(place: float, count: int) -> tuple[int, int]:
    """The first pixel at or after a place along an axis and the last at or before it; -1 and
    ``count`` stand for those beyond the picture."""
    within = min(max(place, -1.0), float(count))
    return int(np.ceil(within - _WIDER_PX)), int(np.floor(within + _WIDER_PX))


@njit(error_model="numpy")
def _drawn(
    vertices: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "m 3"],
    around: Int[np.ndarray, "v 4"],
    depths: Float[np.ndarray, " v"],
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
        left = min(around[i, 0], around[j, 0], around[k, 0])
        right = max(around[i, 1], around[j, 1], around[k, 1])
        if left > right:
            continue
        top = min(around[i, 2], around[j, 2], around[k, 2])
        bottom = max(around[i, 3], around[j, 3], around[k, 3])
        if top > bottom:
            continue
        left, right = max(left, 0), min(right, width - 1)
        top, bottom = max(top, 0), min(bottom, height - 1)
        depth = min(depths[i], depths[j], depths[k])
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
def _squared(x: float, y: float, z: float) -> float:
    """Squared length."""
    return x * x + y * y + z * z


@njit(forceinline=True)
def _towards(
    vertices: Float[np.ndarray, "v 3"], i: int, origin: Float[np.ndarray, " 3"]
) -> tuple[float, float, float]:
    """A corner relative to the camera's centre."""
    return vertices[i, 0] - origin[0], vertices[i, 1] - origin[1], vertices[i, 2] - origin[2]
