"""Pinhole cameras: CCS is x right, y down, z forward; a pixel's centre lies at +0.5."""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.compiled_code import njit
from pipeline.config.cameras import DepthCameraConfig, DepthSensor
from pipeline.geometry.transforms import invert, look_at, rotate_vectors, transform_points
from pipeline.read_only import read_only

# Column and row of the first pixel's centre. OpenCV, ROS and the datasets call it 0, so their
# principal points are smaller by this.
PIXEL_CENTRE_PX = 0.5
_TARGET_M = np.array([0.0, 0.0, 0.02])  # a little above the middle of the table


@dataclass(frozen=True, eq=False)
class PinholeCamera:
    """A camera C with its pose P_C (S-1.13).

    Attributes
    ----------
    name
        Name of the viewpoint.
    width_px
        Width of its pictures.
    height_px
        Height of its pictures.
    intrinsics
        Camera matrix in pixels, shape (3, 3).
    world_from_camera
        Pose of CCS in WCS, shape (4, 4).
    sensor
        Kind of depth sensor, which decides its noise.
    near_m
        Smallest depth that it measures [m].
    far_m
        Largest depth that it measures [m].
    """

    name: str
    width_px: int
    height_px: int
    intrinsics: Float[np.ndarray, "3 3"]
    world_from_camera: Float[np.ndarray, "4 4"]
    sensor: DepthSensor
    near_m: float
    far_m: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "intrinsics", read_only(self.intrinsics))
        object.__setattr__(self, "world_from_camera", read_only(self.world_from_camera))


def camera_at(
    name: str,
    config: DepthCameraConfig,
    target_m: Float[np.ndarray, " 3"],
    distance_m: float,
    elevation_rad: float,
    azimuth_rad: float,
) -> PinholeCamera:
    """Place a camera so that it looks at a point.

    Parameters
    ----------
    name
        Name of the viewpoint.
    config
        Resolution, field of view and depth range.
    target_m
        The point in WCS [m], shape (3,).
    distance_m
        Distance of the camera from the point [m].
    elevation_rad
        Angle of the camera above the horizontal, seen from the point [rad].
    azimuth_rad
        Angle of the camera about the vertical, from x of WCS [rad].

    Returns
    -------
    The camera with its pose.
    """
    focal_px = config.height_px / 2 / math.tan(config.vertical_fov_rad / 2)
    intrinsics = np.array(
        [
            [focal_px, 0.0, config.width_px / 2],
            [0.0, focal_px, config.height_px / 2],
            [0.0, 0.0, 1.0],
        ]
    )
    towards = np.array(
        [
            math.cos(elevation_rad) * math.cos(azimuth_rad),
            math.cos(elevation_rad) * math.sin(azimuth_rad),
            math.sin(elevation_rad),
        ]
    )
    return PinholeCamera(
        name=name,
        width_px=config.width_px,
        height_px=config.height_px,
        intrinsics=intrinsics,
        world_from_camera=look_at(target_m + distance_m * towards, target_m),
        sensor=config.sensor,
        near_m=config.near_m,
        far_m=config.far_m,
    )


def pixel_slopes(
    intrinsics: Float[np.ndarray, "3 3"], shape: tuple[int, int]
) -> tuple[Float[np.ndarray, " w"], Float[np.ndarray, " h"]]:
    """x of the pixel centres of each column, and y of those of each row, at depth 1 in CCS.

    All points and rays of pixels are computed from these.

    Parameters
    ----------
    intrinsics
        Camera matrix in pixels, shape (3, 3).
    shape
        Height and width of the picture [px].

    Returns
    -------
    x/z of each column, shape (w,), and y/z of each row, shape (h,).
    """
    k = intrinsics
    return (
        (np.arange(shape[1]) + PIXEL_CENTRE_PX - k[0, 2]) / k[0, 0],
        (np.arange(shape[0]) + PIXEL_CENTRE_PX - k[1, 2]) / k[1, 1],
    )


def project_local(
    intrinsics: Float[np.ndarray, "3 3"], points_in_camera_m: Float[np.ndarray, "*n 3"]
) -> Float[np.ndarray, "*n 2"]:
    """Project points of CCS to column and row in pixels; pixel centres lie at +0.5.

    Parameters
    ----------
    intrinsics
        Camera matrix in pixels, shape (3, 3).
    points_in_camera_m
        Points in CCS, shape (..., 3) [m].

    Returns
    -------
    Column and row, shape (..., 2); NaN for points with z <= 0.
    """
    z = points_in_camera_m[..., 2:]
    ahead = np.where(z > 0.0, z, np.nan)
    focal_px, centre_px = intrinsics[[0, 1], [0, 1]], intrinsics[:2, 2]
    return np.asarray(focal_px * points_in_camera_m[..., :2] / ahead + centre_px)


def project(
    camera: PinholeCamera, points_m: Float[np.ndarray, "*n 3"]
) -> tuple[Float[np.ndarray, "*n 2"], Float[np.ndarray, "*n"]]:
    """Project points of WCS into a camera's picture.

    Parameters
    ----------
    camera
        The camera.
    points_m
        Points in WCS, shape (..., 3) [m].

    Returns
    -------
    Column and row as `project_local`, shape (..., 2), and depth along the camera's z, shape (...)
    [m].
    """
    local = transform_points(invert(camera.world_from_camera), points_m)
    return project_local(camera.intrinsics, local), local[..., 2]


def in_picture(camera: PinholeCamera, pixels: Float[np.ndarray, "*n 2"]) -> Bool[np.ndarray, "*n"]:
    """Whether columns and rows of `project` lie within the picture; False where they are NaN."""
    return np.asarray(
        ((pixels >= 0.0) & (pixels < [camera.width_px, camera.height_px])).all(axis=-1)
    )


def pixel_rays(
    camera: PinholeCamera, mask: Bool[np.ndarray, "h w"]
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "n 3"]]:
    """The camera's centre and the unit ray through each chosen pixel, in WCS, row by row."""
    rows, columns = np.nonzero(mask)
    x, y = pixel_slopes(camera.intrinsics, mask.shape)
    rays = np.stack([x[columns], y[rows], np.ones(len(rows))], axis=1)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return camera.world_from_camera[:3, 3], rotate_vectors(camera.world_from_camera, rays)


def picture_rays(camera: PinholeCamera) -> Float[np.ndarray, "n 3"]:
    """Unit rays through all pixels of a picture, as `pixel_rays` gives them, compiled.

    The closed loop takes a picture at every step, and this function needs 2.4 ms at 640 x 480 where
    `pixel_rays` needs 27 ms. The last bits of the results differ, so labels use `pixel_rays` only:
    published labels then stay the same.

    Parameters
    ----------
    camera
        The camera.

    Returns
    -------
    Unit rays in WCS, row by row, shape (n, 3).
    """
    shape = (camera.height_px, camera.width_px)
    x, y = pixel_slopes(camera.intrinsics, shape)
    return np.asarray(_picture_rays(x, y, camera.world_from_camera))


@njit()
def _picture_rays(
    x: Float[np.ndarray, " w"], y: Float[np.ndarray, " h"], pose: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "n 3"]:
    rays = np.empty((len(y) * len(x), 3))
    for row in range(len(y)):
        for column in range(len(x)):
            length = np.sqrt(x[column] * x[column] + y[row] * y[row] + 1.0)
            for axis in range(3):
                rays[row * len(x) + column, axis] = (
                    pose[axis, 0] * x[column] + pose[axis, 1] * y[row] + pose[axis, 2]
                ) / length
    return rays


def points_of_depth(
    depth_m: Float[np.ndarray, "h w"],
    camera: PinholeCamera,
    every: int,
    above_m: float = -np.inf,
) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, " n"], Int[np.ndarray, " n"]]:
    """Unproject a depth image into points of WCS, row by row.

    Parameters
    ----------
    depth_m
        Depth along the camera's z [m], shape (h, w). Pixels that are not finite or not above zero
        were not measured and give no point.
    camera
        The camera that took the image.
    every
        Step between the rows and between the columns that are used.
    above_m
        Height in WCS [m]; only points above it are kept.

    Returns
    -------
    Points, shape (n, 3) [m], and the row and column of each, shapes (n,).
    """
    x, y = pixel_slopes(camera.intrinsics, depth_m.shape)
    depth = np.ascontiguousarray(depth_m, dtype=np.float64)
    points, rows, columns = _unprojected(depth, x, y, camera.world_from_camera, every, above_m)
    return points, rows, columns


@njit()
def _unprojected(
    depth: Float[np.ndarray, "h w"],
    x: Float[np.ndarray, " w"],
    y: Float[np.ndarray, " h"],
    pose: Float[np.ndarray, "4 4"],
    every: int,
    above: float,
) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, " n"], Int[np.ndarray, " n"]]:
    most = -(-depth.shape[0] // every) * -(-depth.shape[1] // every)
    points = np.empty((most, 3))
    rows, columns = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    count = 0
    for row in range(0, depth.shape[0], every):
        for column in range(0, depth.shape[1], every):
            z = depth[row, column]
            if not (z > 0.0 and z < np.inf):
                continue
            u, v = x[column], y[row]
            height = z * (pose[2, 0] * u + pose[2, 1] * v + pose[2, 2]) + pose[2, 3]
            if height > above:
                for axis in range(2):
                    points[count, axis] = (
                        z * (pose[axis, 0] * u + pose[axis, 1] * v + pose[axis, 2]) + pose[axis, 3]
                    )
                points[count, 2] = height
                rows[count], columns[count] = row, column
                count += 1
    return points[:count], rows[:count], columns[:count]


def thinned(camera: PinholeCamera, every: int) -> PinholeCamera:
    """The camera of a picture of which only some rows and columns were kept, the first included.

    The centre of a kept pixel is at +0.5 in the small picture too and has the same ray.

    Parameters
    ----------
    camera
        Camera of the whole picture.
    every
        Step between kept rows and columns.

    Returns
    -------
    Camera of the small picture.
    """
    intrinsics = camera.intrinsics.copy()
    intrinsics[:2, :2] /= every
    intrinsics[:2, 2] = (intrinsics[:2, 2] - PIXEL_CENTRE_PX) / every + PIXEL_CENTRE_PX
    return replace(
        camera,
        width_px=-(-camera.width_px // every),
        height_px=-(-camera.height_px // every),
        intrinsics=intrinsics,
    )


def shown_whole(
    camera: PinholeCamera, points_m: Float[np.ndarray, "n 3"], radius_m: float
) -> Bool[np.ndarray, " n"]:
    """Whether a sphere around each point lies completely within what the camera measures.

    That is the pyramid of its field of view, from ``near_m`` to ``far_m``. A sphere lies in it
    where its centre is at least the radius inside each of the six faces.

    Parameters
    ----------
    camera
        The camera.
    points_m
        Centres of the spheres in WCS [m], shape (n, 3).
    radius_m
        Radius of the spheres [m].

    Returns
    -------
    Shape (n,).
    """
    k = camera.intrinsics
    left, top = k[0, 2] / k[0, 0], k[1, 2] / k[1, 1]
    right = (camera.width_px - k[0, 2]) / k[0, 0]
    bottom = (camera.height_px - k[1, 2]) / k[1, 1]
    inward = np.array([[1.0, 0, left], [-1.0, 0, right], [0, 1.0, top], [0, -1.0, bottom]])
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    in_camera = transform_points(invert(camera.world_from_camera), points_m)
    in_sight = (in_camera @ inward.T >= radius_m).all(axis=1)
    depth_m = in_camera[:, 2]
    in_range = (depth_m - radius_m >= camera.near_m) & (depth_m + radius_m <= camera.far_m)
    return np.asarray(in_sight & in_range)
