"""Bags written by rosbags, which shares no code with the program's reader."""

import io
import struct
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore
from scipy.spatial.transform import Rotation

from pipeline.camera.frame import Frame

STORE: Typestore = get_typestore(Stores.ROS2_HUMBLE)
T: dict[str, Any] = dict(STORE.types)
DEPTH, INFO, TF = "/camera/depth/image_raw", "/camera/depth/camera_info", "/tf_static"
OPTICAL = "camera_depth_optical_frame"
BEGIN_NS = 1_700_000_000_000_000_000


def header(time_ns: int, frame: str = OPTICAL) -> Any:
    stamp = T["builtin_interfaces/msg/Time"](sec=time_ns // 10**9, nanosec=time_ns % 10**9)
    return T["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def image(frame: Frame, time_ns: int, encoding: str = "16UC1") -> Any:
    """A depth image with four bytes of padding at the end of each row."""
    raw = (
        np.round(1e3 * frame.depth_m).astype("<u2")
        if encoding == "16UC1"
        else np.where(frame.depth_m > 0, frame.depth_m, np.nan).astype("<f4")
    )
    height, width = raw.shape
    rows = np.hstack([raw.view(np.uint8).reshape(height, -1), np.zeros((height, 4), np.uint8)])
    return T["sensor_msgs/msg/Image"](
        header=header(time_ns),
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=0,
        step=rows.shape[1],
        data=rows.ravel(),
    )


def compressed(frame: Frame, time_ns: int, encoding: str = "16UC1") -> Any:
    """As compressed_depth_image_transport writes it: 12 bytes of header, then PNG."""
    a, b = 10_000.0, -50.0
    if encoding == "16UC1":
        raw = np.round(1e3 * frame.depth_m).astype(np.uint16)
    else:
        with np.errstate(divide="ignore"):
            inverse = np.round(a / frame.depth_m + b)
        raw = np.where(frame.depth_m > 0, inverse, 0).astype(np.uint16)
    png = io.BytesIO()
    Image.fromarray(raw).save(png, format="PNG")
    data = struct.pack("<iff", 0, a, b) + png.getvalue()
    return T["sensor_msgs/msg/CompressedImage"](
        header=header(time_ns),
        format=f"{encoding}; compressedDepth png",
        data=np.frombuffer(data, np.uint8),
    )


def camera_info(frame: Frame, time_ns: int, d: tuple[float, ...] = (0.0,) * 5) -> Any:
    k = frame.camera.intrinsics.copy()
    k[:2, 2] -= 0.5
    roi = T["sensor_msgs/msg/RegionOfInterest"](
        x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
    )
    return T["sensor_msgs/msg/CameraInfo"](
        header=header(time_ns),
        height=frame.camera.height_px,
        width=frame.camera.width_px,
        distortion_model="plumb_bob",
        d=np.array(d),
        k=k.ravel(),
        r=np.eye(3).ravel(),
        p=np.eye(3, 4).ravel(),
        binning_x=0,
        binning_y=0,
        roi=roi,
    )


def transform(frame: Frame, time_ns: int) -> Any:
    """The camera in the world by way of a frame between them, 1 m beside the world's origin."""
    between = np.array([1.0, 0.0, 0.0])
    pose = frame.camera.world_from_camera
    vector, quaternion = T["geometry_msgs/msg/Vector3"], T["geometry_msgs/msg/Quaternion"]

    def one(parent: str, child: str, at: np.ndarray, turned: np.ndarray) -> Any:
        x, y, z, w = Rotation.from_matrix(turned).as_quat()
        return T["geometry_msgs/msg/TransformStamped"](
            header=header(time_ns, parent),
            child_frame_id=child,
            transform=T["geometry_msgs/msg/Transform"](
                translation=vector(*map(float, at)), rotation=quaternion(x=x, y=y, z=z, w=w)
            ),
        )

    return T["tf2_msgs/msg/TFMessage"](
        transforms=[
            one("world", "mount", between, np.eye(3)),
            one("mount", OPTICAL, pose[:3, 3] - between, pose[:3, :3]),
        ]
    )


def cloud(points_m: np.ndarray, time_ns: int) -> Any:
    """Points of 20 bytes: x, y and z with something between them."""
    field = T["sensor_msgs/msg/PointField"]
    layout = np.dtype(
        {"names": list("xyz"), "formats": ["<f4"] * 3, "offsets": [0, 4, 12], "itemsize": 20}
    )
    data = np.zeros(len(points_m), layout)
    for axis, name in enumerate("xyz"):
        data[name] = points_m[:, axis]
    return T["sensor_msgs/msg/PointCloud2"](
        header=header(time_ns),
        height=1,
        width=len(points_m),
        fields=[
            field(name=name, offset=offset, datatype=7, count=1)
            for name, offset in zip("xyz", (0, 4, 12), strict=True)
        ],
        is_bigendian=False,
        point_step=20,
        row_step=20 * len(points_m),
        data=np.frombuffer(data.tobytes(), np.uint8),
        is_dense=False,
    )


def write_bag(folder: Path, messages: list[tuple[str, int, Any]]) -> Path:
    """Topic, time and message of each, into the MCAP of a bag's folder."""
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections: dict[str, Any] = {}
        for topic, time_ns, message in messages:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(connections[topic], time_ns, STORE.serialize_cdr(message, kind))
    return next(folder.glob("*.mcap"))
