"""One picture of a real scene: depth, its camera, and what is allowed in it."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from pipeline.errors import PictureError
from pipeline.geometry.transforms import invert, transform_points
from pipeline.world.cameras import PinholeCamera, project_local

SPLAT_PX_A_POINT = 1.3  # pixels a point of a cloud at the mean distance should cover
LARGEST_PX = 1024  # no depth camera has more pixels a side
SQUARE_PIXEL = 1.25  # focal lengths differ less: pictures are not stretched by more
# A lens' centre lies within a tenth of the picture's middle; a crop moves it elsewhere, but not by
# one and the same factor in both directions.
_CENTRE_TOLERANCE, _OTHER_SCALE = 0.1, 1.4


@dataclass(frozen=True, eq=False)
class Frame:
    """A depth image with all that is known beside it.

    Attributes
    ----------
    name
        What the frame is called in the output.
    depth_m
        (h, w) along the camera's z, 0 where nothing was measured.
    camera
        Its intrinsics, and its pose in the frame's world.
    posed
        Whether the pose is known; else the world is CCS itself.
    allowed
        (h, w) where grasps may be.
    colour
        (h, w, 3) picture for the eye, None where there is none.
    instances
        (h, w) labels, 0 for the background, None where there are none.
    """

    name: str
    depth_m: Float[np.ndarray, "h w"]
    camera: PinholeCamera
    posed: bool
    allowed: Bool[np.ndarray, "h w"]
    colour: UInt8[np.ndarray, "h w 3"] | None = None
    instances: Int[np.ndarray, "h w"] | None = None

    def moved(self, new_from_world: Float[np.ndarray, "4 4"]) -> "Frame":
        """The same frame with its camera's pose in another world."""
        pose = new_from_world @ self.camera.world_from_camera
        return replace(self, camera=replace(self.camera, world_from_camera=pose))


def camera_of_picture(
    name: str,
    shape: tuple[int, int],
    intrinsics: Float[np.ndarray, "3 3"],
    world_from_camera: Float[np.ndarray, "4 4"],
) -> PinholeCamera:
    """A camera that took a picture of a shape (height, width).

    Parameters
    ----------
    name
        What the camera is called.
    shape
        Height and width of the picture [px].
    intrinsics
        Camera matrix in pixels, pixel centres at +0.5, shape (3, 3).
    world_from_camera
        Pose of CCS, shape (4, 4).

    Returns
    -------
    The camera, without noise and without bounds of its range.

    Raises
    ------
    PictureError
        The intrinsics cannot be those of such a picture.
    """
    height, width = shape
    cx, cy = intrinsics[0, 2], intrinsics[1, 2]
    if not (0 < cx < width and 0 < cy < height):
        raise PictureError(
            f"{name}: the intrinsics' centre ({cx:.0f}, {cy:.0f}) px lies outside the depth image "
            f"of {width} by {height} pixels",
            "Give the intrinsics of this picture's size: scale them with it",
        )
    other = _size_meant(cx, cy, width, height)
    if other is not None:
        raise PictureError(
            f"{name}: the intrinsics' centre ({cx:.0f}, {cy:.0f}) px is that of a picture of "
            f"{other[0]} by {other[1]} pixels, and the depth image has {width} by {height}",
            "Give the intrinsics of this picture's size: scale them with it",
        )
    if max(intrinsics[0, 0], intrinsics[1, 1]) > SQUARE_PIXEL * min(
        intrinsics[0, 0], intrinsics[1, 1]
    ):
        raise PictureError(
            f"{name}: the focal lengths {intrinsics[0, 0]:.0f} and {intrinsics[1, 1]:.0f} px "
            "differ, and pixels of depth cameras are square",
            "Give the intrinsics of this picture: where it was stretched, they stretch with it",
        )
    angle_rad = 2 * np.arctan(width / 2 / intrinsics[0, 0])
    if not np.radians(10) < angle_rad < np.radians(150):
        raise PictureError(
            f"{name}: the intrinsics give a picture {np.degrees(angle_rad):.0f} degrees wide, and "
            "depth cameras show 10 to 150",
            "Give the focal length in pixels of this picture's size",
        )
    return PinholeCamera(
        name=name,
        width_px=width,
        height_px=height,
        intrinsics=intrinsics,
        world_from_camera=world_from_camera,
        sensor="ideal",
        near_m=0.0,
        far_m=np.inf,
    )


def _size_meant(cx: float, cy: float, width: int, height: int) -> tuple[int, int] | None:
    """Width and height of the picture that a centre is the middle of, where that is another."""
    wide, high = 2 * cx, 2 * cy
    scale = wide / width
    alike = abs(scale * height / high - 1) < _CENTRE_TOLERANCE
    scaled = alike and not 1 / _OTHER_SCALE < scale < _OTHER_SCALE
    turned = (
        abs(wide / height - 1) < _CENTRE_TOLERANCE
        and abs(high / width - 1) < _CENTRE_TOLERANCE
        and abs(width / height - 1) > 2 * _CENTRE_TOLERANCE
    )
    return (round(wide), round(high)) if scaled or turned else None


def frame_of_cloud(
    name: str,
    points_m: Float[np.ndarray, "n 3"],
    world_from_camera: Float[np.ndarray, "4 4"] | None,
) -> Frame:
    """A point cloud as the depth image that a pinhole camera would have taken of it.

    Parameters
    ----------
    name
        What the frame is called.
    points_m
        Points in CCS: x right, y down, z forward.
    world_from_camera
        Pose of CCS, None where it is not known.

    Returns
    -------
    A frame whose pixels hold the nearest of their points.

    Raises
    ------
    PictureError
        Most points lie behind the camera.
    """
    ahead = points_m[points_m[:, 2] > 0]
    if len(ahead) < len(points_m) / 2:
        raise PictureError(
            f"{name}: {len(points_m) - len(ahead)} of {len(points_m)} points lie behind the camera",
            "Give the cloud in the camera's frame, z forward, or the camera's pose in its frame",
        )
    slope = ahead[:, :2] / ahead[:, 2:]
    lower, upper = np.percentile(slope, [0.5, 99.5], axis=0)
    inside = ((slope >= lower) & (slope <= upper)).all(axis=1)
    ahead = ahead[inside]
    span = np.maximum(upper - lower, 1e-6)
    # As many pixels as points, so that a surface has no holes and no pixel stands for many.
    focal_px = float(np.sqrt(len(ahead) / SPLAT_PX_A_POINT / (span[0] * span[1])))
    focal_px = min(focal_px, LARGEST_PX / float(span.max()))
    width, height = (max(16, int(np.ceil(focal_px * extent))) for extent in span)
    intrinsics = np.array(
        [[focal_px, 0, -lower[0] * focal_px], [0, focal_px, -lower[1] * focal_px], [0, 0, 1.0]]
    )
    pixel = np.floor(project_local(intrinsics, ahead)).astype(np.int64)
    column = np.clip(pixel[:, 0], 0, width - 1)
    row = np.clip(pixel[:, 1], 0, height - 1)
    depth_m = np.full((height, width), np.inf)
    np.minimum.at(depth_m, (row, column), ahead[:, 2])
    depth_m[~np.isfinite(depth_m)] = 0.0
    pose = np.eye(4) if world_from_camera is None else world_from_camera
    camera = PinholeCamera(name, width, height, intrinsics, pose, "ideal", 0.0, np.inf)
    return Frame(
        name=name,
        depth_m=depth_m,
        camera=camera,
        posed=world_from_camera is not None,
        allowed=np.ones(depth_m.shape, dtype=bool),
    )


def in_camera(frame: Frame, points_m: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Points of the frame's world in CCS."""
    return transform_points(invert(frame.camera.world_from_camera), points_m)
