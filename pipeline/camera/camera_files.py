"""Intrinsics and poses from files, in the layouts that drivers and datasets write.

The project's pixel centres lie at +0.5 (`pipeline.world.cameras`); OpenCV, ROS, RealSense and
the datasets put them at whole numbers. What is read here is shifted by half a pixel.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jaxtyping import Float

from pipeline.errors import PictureError
from pipeline.world.cameras import PIXEL_CENTRE_PX

LAYOUTS = (
    "a 3x3 matrix under 'intrinsics', 'camera_matrix', 'K', 'k', 'cam_K' or 'intrinsic_matrix', "
    "or fx, fy, cx, cy"
)
RIGID_TOLERANCE = 1e-3  # poses in files are often rounded to four digits
# Where pixels of a lens with distortion differ by more than this from those of a pinhole, the
# picture is not one of a pinhole. Less is under the size of a cell of a sub cloud.
DISTORTED_PX = 1.0
FISHEYE_MODELS = ("equidistant", "fisheye", "kannala_brandt4")


@dataclass(frozen=True, eq=False)
class CameraFile:
    """What a file says of a camera.

    Attributes
    ----------
    intrinsics
        Pixels, pixel centres at +0.5, shape (3, 3).
    size_px
        Width and height, None where the file does not say.
    world_from_camera
        Pose of CCS in the file's world, shape (4, 4); None where the file does not say.
    depth_scale_m
        Metres a unit of the depth image; None where the file does not say.
    """

    intrinsics: Float[np.ndarray, "3 3"]
    size_px: tuple[int, int] | None = None
    world_from_camera: Float[np.ndarray, "4 4"] | None = None
    depth_scale_m: float | None = None


def read_camera_file(path: Path) -> CameraFile:
    """Read JSON or YAML in any of the layouts of `camera_of`.

    Parameters
    ----------
    path
        JSON, where its name ends so, else YAML.

    Returns
    -------
    What the file says.

    Raises
    ------
    PictureError
        The file cannot be read, or lacks intrinsics.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise PictureError(f"{path} cannot be read: {error}", "Check the path") from error
    try:
        # OpenCV writes a first line and tags that no YAML parser takes.
        plain = text.replace("!!opencv-matrix", "").replace("%YAML:1.0", "")
        content = json.loads(text) if path.suffix == ".json" else yaml.safe_load(plain)
    except (ValueError, yaml.YAMLError, RecursionError) as error:
        raise PictureError(
            f"{path} is no valid {'JSON' if path.suffix == '.json' else 'YAML'}: "
            f"{' '.join(str(error).split())}",
            "Mend the file",
        ) from error
    return camera_of(content, str(path))


def camera_of(content: Any, source: str) -> CameraFile:
    """A camera from what a file holds.

    Known layouts: this project's (``intrinsics``, ``depth_scale_m``, ``world_from_camera``), ROS
    CameraInfo and camera_calibration (``K``/``k``/``camera_matrix``, ``D``), RealSense (``fx``,
    ``fy``, ``ppx``, ``ppy``), BOP (``cam_K``, ``depth_scale`` to millimetres), Open3D
    (``intrinsic_matrix`` by columns), OpenCV (``camera_matrix``) and a bare 3x3 matrix.

    Parameters
    ----------
    content
        Parsed JSON or YAML.
    source
        The file's name, for errors.

    Returns
    -------
    Intrinsics with the project's pixel centres, and what else is said.

    Raises
    ------
    PictureError
        There are no intrinsics, a number is no number, the lens is distorted, or the pose is
        not rigid.
    """
    if isinstance(content, list):
        content = {"intrinsics": content}
    if not isinstance(content, Mapping):
        raise PictureError(f"{source} holds no camera", f"Give {LAYOUTS}")
    k = _intrinsics(content, source)
    size = _size(content, source)
    _check_distortion(content, k, size, source)
    shifted = k.copy()
    shifted[:2, 2] += PIXEL_CENTRE_PX
    return CameraFile(shifted, size, _pose(content, source), _scale(content, source))


def _intrinsics(content: Mapping[str, Any], source: str) -> Float[np.ndarray, "3 3"]:
    for name in ("intrinsics", "camera_matrix", "K", "k", "cam_K", "intrinsic_matrix"):
        value = content.get(name)
        if value is None:
            continue
        if isinstance(value, Mapping) and "data" not in value:
            return _intrinsics(value, source)  # an object of named numbers or another layout
        numbers = _numbers(value["data"] if isinstance(value, Mapping) else value, name, source)
        if numbers.size != 9:
            raise PictureError(
                f"{source}: '{name}' has {numbers.size} numbers, and a camera matrix has 9",
                f"Give {LAYOUTS}",
            )
        k = numbers.reshape(3, 3)
        return _checked(k.T if k[2, 0] > 1.0 and k[0, 2] == 0.0 else k, source)
    named = {
        "fx": ("fx",),
        "fy": ("fy",),
        "cx": ("cx", "ppx"),
        "cy": ("cy", "ppy"),
    }
    found = {
        key: content[name] for key, names in named.items() for name in names if name in content
    }
    if len(found) < len(named):
        raise PictureError(f"{source} has no intrinsics", f"Give {LAYOUTS}")
    fx, fy, cx, cy = (float(_numbers(found[key], key, source).ravel()[0]) for key in named)
    return _checked(np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]), source)


def _checked(k: Float[np.ndarray, "3 3"], source: str) -> Float[np.ndarray, "3 3"]:
    if not (k[0, 0] > 0 and k[1, 1] > 0):
        raise PictureError(
            f"{source}: the focal lengths {k[0, 0]:g} and {k[1, 1]:g} px are not above zero",
            "Calibrate the camera, or give the driver's intrinsics",
        )
    if abs(k[0, 1]) > 1e-6 * k[0, 0] or not np.allclose(k[2], (0, 0, 1)):
        raise PictureError(
            f"{source}: the camera matrix is not of the form [fx 0 cx; 0 fy cy; 0 0 1]",
            "Give the intrinsics of the rectified picture",
        )
    return k


def _size(content: Mapping[str, Any], source: str) -> tuple[int, int] | None:
    for wide, high in (("width", "height"), ("image_width", "image_height"), ("w", "h")):
        if content.get(wide) is not None and content.get(high) is not None:
            numbers = _numbers([content[wide], content[high]], wide, source)
            return int(numbers[0]), int(numbers[1])
    return None


def _pose(content: Mapping[str, Any], source: str) -> Float[np.ndarray, "4 4"] | None:
    for name, inverted in (("world_from_camera", False), ("camera_from_world", True)):
        if content.get(name) is None:
            continue
        numbers = _numbers(content[name], name, source)
        if numbers.size != 16:
            raise PictureError(
                f"{source}: '{name}' has {numbers.size} numbers, and a pose has 16",
                "Give a 4x4 matrix, or leave it out",
            )
        pose = numbers.reshape(4, 4)
        rotation = pose[:3, :3]
        rigid = np.allclose(rotation @ rotation.T, np.eye(3), atol=RIGID_TOLERANCE)
        if not rigid or np.linalg.det(rotation) < 0 or not np.allclose(pose[3], (0, 0, 0, 1)):
            raise PictureError(
                f"{source}: '{name}' is no rotation with a translation",
                "Give a rigid 4x4 pose in metres, without scale or mirroring",
            )
        left, _, right = np.linalg.svd(rotation)
        pose = pose.copy()
        pose[:3, :3] = left @ right
        return np.linalg.inv(pose) if inverted else pose
    return None


def _scale(content: Mapping[str, Any], source: str) -> float | None:
    if content.get("depth_scale_m") is not None:
        scale_m = float(_numbers(content["depth_scale_m"], "depth_scale_m", source).ravel()[0])
    elif content.get("depth_scale") is not None:
        # BOP: to millimetres where it says cam_K; RealSense and others: to metres.
        scale_m = float(_numbers(content["depth_scale"], "depth_scale", source).ravel()[0])
        scale_m *= 1e-3 if "cam_K" in content else 1.0
    else:
        return None
    if not scale_m > 0:
        raise PictureError(f"{source}: the depth scale is {scale_m:g}", "Give it in metres a unit")
    return scale_m


def _check_distortion(
    content: Mapping[str, Any],
    k: Float[np.ndarray, "3 3"],
    size: tuple[int, int] | None,
    source: str,
) -> None:
    """Raise PictureError where a lens moves pixels farther than `DISTORTED_PX`."""
    for name in ("D", "d", "distortion", "distortion_coefficients", "coeffs"):
        value = content.get(name)
        if value is None:
            continue
        given = _numbers(value["data"] if isinstance(value, Mapping) else value, name, source)
        if not given.any():
            continue
        width, height = size or (2 * k[0, 2], 2 * k[1, 2])
        corners = np.array([(0, 0), (width, 0), (0, height), (width, height)], dtype=np.float64)
        at = (corners - k[:2, 2]) / k[[0, 1], [0, 1]]
        model = str(content.get("distortion_model", ""))
        distort = _seen_by_fisheye if model in FISHEYE_MODELS else _seen_by_lens
        moved = (distort(at, given.ravel()) - at) * k[[0, 1], [0, 1]]
        farthest_px = float(np.linalg.norm(moved, axis=1).max())
        if not farthest_px <= DISTORTED_PX:
            raise PictureError(
                f"{source}: its lens has distortion that moves pixels by up to "
                f"{farthest_px:.0f} px, and the pictures are taken as a pinhole's",
                "Rectify colour and depth first, and give the rectified camera (in ROS: "
                "image_proc, whose CameraInfo has D = 0)",
            )


def _seen_by_lens(
    at: Float[np.ndarray, "n 2"], coefficients: Float[np.ndarray, " c"]
) -> Float[np.ndarray, "n 2"]:
    """Where a lens shows points of the plane at depth 1: Brown's and the rational model.

    Parameters
    ----------
    at
        Points as a pinhole shows them, shape (n, 2).
    coefficients
        k1, k2, p1, p2, k3, k4, k5, k6 as OpenCV orders them; fewer are filled with 0.

    Returns
    -------
    Points as the lens shows them, shape (n, 2).
    """
    filled = np.pad(coefficients, (0, max(0, 8 - len(coefficients))))[:8]
    k1, k2, p1, p2, k3, k4, k5, k6 = filled
    x, y = at.T
    r2 = x**2 + y**2
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2),
            y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y,
        ],
        axis=1,
    )


def _seen_by_fisheye(
    at: Float[np.ndarray, "n 2"], coefficients: Float[np.ndarray, " c"]
) -> Float[np.ndarray, "n 2"]:
    """The same for the equidistant model of Kannala and Brandt, k1 to k4."""
    k = np.pad(coefficients, (0, max(0, 4 - len(coefficients))))[:4]
    radius = np.maximum(np.linalg.norm(at, axis=1, keepdims=True), 1e-12)
    angle = np.arctan(radius)
    squared = angle**2
    shown = angle * (1 + squared * (k[0] + squared * (k[1] + squared * (k[2] + squared * k[3]))))
    return np.asarray(at * shown / radius)


def _numbers(value: Any, name: str, source: str) -> Float[np.ndarray, "..."]:
    try:
        numbers = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise PictureError(f"{source}: '{name}' is not made of numbers", "Mend it") from error
    if not np.isfinite(numbers).all():
        raise PictureError(f"{source}: '{name}' holds a number that is not finite", "Mend it")
    return numbers
