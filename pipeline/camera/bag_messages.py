"""Depth pictures and transforms from messages of ROS 2 and of Foxglove, which differ in names only.

``sensor_msgs/Image`` and ``foxglove.RawImage``, ``CompressedImage`` of both, ``CameraInfo`` and
``foxglove.CameraCalibration``, ``PointCloud2`` and ``foxglove.PointCloud``, ``tf2_msgs/TFMessage``
and ``foxglove.FrameTransform(s)``. Messages are objects with attributes, as their decoders make
them.
"""

import io
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float
from PIL import Image, UnidentifiedImageError

from pipeline.errors import PictureError
from pipeline.geometry.transforms import pose_from

PNG = b"\x89PNG"
# Config header of image_transport's compressedDepth: format, and the quantisation's two parameters.
COMPRESSED_DEPTH = struct.Struct("<iff")
DEPTH_ENCODINGS = {"16UC1": ("u2", 1e-3), "mono16": ("u2", 1e-3), "32FC1": ("f4", 1.0)}
_FLOATS = {7: "f4", 8: "f8"}  # PointField's numbers of its types, which Foxglove kept


def frame_id_of(message: Any) -> str:
    """The coordinate frame that a message is in, without the slash that ROS 1 wrote."""
    header = getattr(message, "header", message)
    return str(header.frame_id).lstrip("/")


def depth_encoding_of(message: Any) -> str | None:
    """The encoding where a message is a depth image, compressed or not; else None."""
    if hasattr(message, "encoding"):
        return message.encoding if message.encoding in DEPTH_ENCODINGS else None
    words = str(getattr(message, "format", "")).replace(";", " ").split()
    if not words:
        return None
    if words[0] in DEPTH_ENCODINGS:
        return words[0]
    deep = words[0] == "png" and _mode(bytes(message.data)).startswith("I")
    return "16UC1" if deep else None


def depth_m_of(message: Any, scale_m: float | None, where: str) -> Float[np.ndarray, "h w"]:
    """Depth of an image's message, 0 where nothing was measured.

    Parameters
    ----------
    message
        An image of an encoding of `DEPTH_ENCODINGS`, compressed or not.
    scale_m
        Metres a unit; None: millimetres for integers, metres for floats, as ROS REP 118 says.
    where
        Bag and topic, for errors.

    Returns
    -------
    Depth along the optical axis [m], shape (h, w).

    Raises
    ------
    PictureError
        The message is shorter than it says, or compressed in an unknown way.
    """
    encoding = depth_encoding_of(message)
    if encoding is None:
        raise PictureError(
            f"{where} holds no depth image",
            f"Name a topic of encoding {', '.join(DEPTH_ENCODINGS)}",
        )
    kind, unit = DEPTH_ENCODINGS[encoding]
    if hasattr(message, "encoding"):
        raw = _plain(message, kind, where)
    else:
        raw = _compressed(message, encoding, where)
    values = raw.astype(np.float64)
    if raw.dtype.kind == "u":
        values[raw == np.iinfo(raw.dtype).max] = 0.0
        values *= unit if scale_m is None else scale_m
    elif scale_m is not None:
        values *= scale_m
    return np.where(np.isfinite(values) & (values > 0), values, 0.0)


def camera_content(message: Any) -> dict[str, Any]:
    """A camera's description as `pipeline.camera.camera_files.camera_of` reads it."""
    upper = hasattr(message, "K")
    return {
        "K": list(message.K if upper else message.k),
        "D": list(message.D if upper else message.d),
        "distortion_model": message.distortion_model,
        "width": message.width,
        "height": message.height,
    }


def points_m_of(message: Any, where: str) -> Float[np.ndarray, "n 3"]:
    """Points of a cloud's message in its frame; what is not finite or the origin is left out.

    Parameters
    ----------
    message
        ``PointCloud2`` or ``foxglove.PointCloud``.
    where
        Bag and topic, for errors.

    Returns
    -------
    Points in metres, shape (n, 3).

    Raises
    ------
    PictureError
        The cloud has no coordinates of floating-point numbers.
    """
    fields = {str(field.name): field for field in message.fields}
    stride = int(message.point_step if hasattr(message, "point_step") else message.point_stride)
    kinds = [
        _FLOATS.get(int(getattr(fields[axis], "datatype", getattr(fields[axis], "type", 0))))
        for axis in "xyz"
        if axis in fields
    ]
    if len(kinds) < 3 or None in kinds or stride <= 0:
        raise PictureError(
            f"{where} is a cloud without x, y and z as floating-point numbers",
            "Record sensor_msgs/PointCloud2 with float32 coordinates",
        )
    order = ">" if getattr(message, "is_bigendian", False) else "<"
    layout = np.dtype(
        {
            "names": list("xyz"),
            "formats": [f"{order}{kind}" for kind in kinds],
            "offsets": [int(fields[axis].offset) for axis in "xyz"],
            "itemsize": stride,
        }
    )
    data = bytes(message.data)
    raw = np.frombuffer(data[: len(data) // stride * stride], dtype=layout)
    points = np.stack([raw[axis].astype(np.float64) for axis in "xyz"], axis=1)
    points = points[np.isfinite(points).all(axis=1)]
    points = points[(points != 0).any(axis=1)]
    if hasattr(message, "pose") and message.HasField("pose"):
        pose = _pose(message.pose.position, message.pose.orientation)
        points = points @ pose[:3, :3].T + pose[:3, 3]
    return np.asarray(points)


def transforms_of(message: Any) -> dict[str, tuple[str, Float[np.ndarray, "4 4"]]]:
    """Child frame → its parent, and parent_from_child [m]."""
    several = message.transforms if hasattr(message, "transforms") else [message]
    found = {}
    for one in several:
        if hasattr(one, "header"):
            parent, child = one.header.frame_id, one.child_frame_id
            pose = _pose(one.transform.translation, one.transform.rotation)
        else:
            parent, child = one.parent_frame_id, one.child_frame_id
            pose = _pose(one.translation, one.rotation)
        found[str(child).lstrip("/")] = (str(parent).lstrip("/"), pose)
    return found


def root_from(
    frame: str, tree: Mapping[str, tuple[str, Float[np.ndarray, "4 4"]]]
) -> Float[np.ndarray, "4 4"] | None:
    """Pose of a frame in the root of its tree [m]; None where the tree does not hold the frame."""
    if frame not in tree:
        return None
    pose, seen = np.eye(4), set()
    while frame in tree and frame not in seen:
        seen.add(frame)
        parent, step = tree[frame]
        pose, frame = step @ pose, parent
    return pose


def _pose(position: Any, quaternion: Any) -> Float[np.ndarray, "4 4"]:
    wxyz = np.array([quaternion.w, quaternion.x, quaternion.y, quaternion.z], dtype=np.float64)
    return pose_from(np.array([position.x, position.y, position.z], dtype=np.float64), wxyz)


def _plain(message: Any, kind: str, where: str) -> np.ndarray:
    height, width, step = int(message.height), int(message.width), int(message.step)
    order = ">" if getattr(message, "is_bigendian", False) else "<"
    layout = np.dtype(f"{order}{kind}")
    data = bytes(message.data)
    if not (height > 0 and step >= width * layout.itemsize > 0 and len(data) >= height * step):
        raise PictureError(
            f"{where}: an image of {width} by {height} pixels holds {len(data)} bytes, fewer than "
            "it needs",
            "Record the bag anew",
        )
    rows = np.frombuffer(data, np.uint8, height * step).reshape(height, step)
    cut = np.ascontiguousarray(rows[:, : width * layout.itemsize])
    return cut.view(layout)


def _compressed(message: Any, encoding: str, where: str) -> np.ndarray:
    data = bytes(message.data)
    start = data.find(PNG, 0, COMPRESSED_DEPTH.size + len(PNG))
    if start < 0:
        raise PictureError(
            f"{where} is compressed as '{message.format}', and only PNG is read",
            "Record the raw depth image, or compressedDepth with format png",
        )
    try:
        raw = np.asarray(Image.open(io.BytesIO(data[start:])))
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        raise PictureError(
            f"{where}: a compressed image cannot be read: {error}", "Record the bag anew"
        ) from error
    if raw.ndim != 2 or raw.dtype == np.uint8:
        raise PictureError(
            f"{where} holds pictures of type {raw.dtype}, no depth", "Name the depth's topic"
        )
    if encoding != "32FC1":
        return raw.astype(np.uint16)
    if start < COMPRESSED_DEPTH.size:
        raise PictureError(
            f"{where} lacks compressedDepth's header",
            "Record it by compressed_depth_image_transport",
        )
    # The transport keeps A / depth + B in 16 bits.
    _, a, b = COMPRESSED_DEPTH.unpack_from(data)
    values = raw.astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(values > 0, a / (values - b), 0.0)


def _mode(data: bytes) -> str:
    try:
        return Image.open(io.BytesIO(data)).mode
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError):
        return ""
