"""Cameras, pictures and poses as foxglove messages, which viewers show without a plug-in."""

from collections.abc import Mapping

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.timestamp_pb2 import Timestamp
from jaxtyping import Float

from pipeline.geometry.transforms import position_quaternion
from pipeline.world.cameras import PIXEL_CENTRE_PX, PinholeCamera

WORLD_FRAME = "world"


def raw_image(
    image: np.ndarray, encoding: str, dtype: str, camera: PinholeCamera, time_ns: int
) -> RawImage:
    """A picture, uncompressed.

    Parameters
    ----------
    image
        (h, w) or (h, w, 3).
    encoding
        Foxglove's name of the pixels' layout, such as ``32FC1``.
    dtype
        NumPy's name of the bytes that the encoding stands for, such as ``<f4``.
    camera
        What took it.
    time_ns
        When, in simulated or recorded time.

    Returns
    -------
    The message.
    """
    data = np.ascontiguousarray(image, dtype=dtype)
    return RawImage(
        timestamp=stamp(time_ns),
        frame_id=camera.name,
        width=camera.width_px,
        height=camera.height_px,
        encoding=encoding,
        step=data.strides[0],
        data=data.tobytes(),
    )


def camera_calibration(camera: PinholeCamera, time_ns: int) -> CameraCalibration:
    """The intrinsics of a camera without distortion, with ROS's pixel centres.

    ROS and Foxglove put the centre of the first pixel at (0, 0), the project at (0.5, 0.5): the
    same ray has a principal point smaller by `PIXEL_CENTRE_PX` here.

    Parameters
    ----------
    camera
        What took the picture.
    time_ns
        When, in simulated or recorded time.

    Returns
    -------
    The message.
    """
    k = camera.intrinsics.copy()
    k[:2, 2] -= PIXEL_CENTRE_PX
    projection = np.hstack([k, np.zeros((3, 1))])
    return CameraCalibration(
        timestamp=stamp(time_ns),
        frame_id=camera.name,
        width=camera.width_px,
        height=camera.height_px,
        K=k.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=projection.ravel().tolist(),
    )


def frame_transforms(
    world_from_frame: Mapping[str, Float[np.ndarray, "4 4"]], time_ns: int
) -> FrameTransforms:
    """Where named frames lie in the world."""
    transforms = []
    for name, pose in world_from_frame.items():
        position, (w, x, y, z) = position_quaternion(pose)
        transform = FrameTransform(
            timestamp=stamp(time_ns), parent_frame_id=WORLD_FRAME, child_frame_id=name
        )
        transform.translation.x, transform.translation.y, transform.translation.z = position
        transform.rotation.w, transform.rotation.x = w, x
        transform.rotation.y, transform.rotation.z = y, z
        transforms.append(transform)
    return FrameTransforms(transforms=transforms)


def poses_in_world(poses: Float[np.ndarray, "k 4 4"], time_ns: int) -> PosesInFrame:
    """Poses in the world, in their order."""
    message = PosesInFrame(timestamp=stamp(time_ns), frame_id=WORLD_FRAME)
    for pose in poses:
        position, (w, x, y, z) = position_quaternion(pose)
        added = message.poses.add()
        added.position.x, added.position.y, added.position.z = position
        added.orientation.w, added.orientation.x = w, x
        added.orientation.y, added.orientation.z = y, z
    return message


def stamp(time_ns: int) -> Timestamp:
    """A time in nanoseconds as protobuf writes it."""
    return Timestamp(seconds=time_ns // 10**9, nanos=time_ns % 10**9)
