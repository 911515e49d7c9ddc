"""Recorded bags: the depth pictures of a ROS 2 or Foxglove MCAP, in recorded time, with no ROS.

ROS 2 messages are decoded by mcap-ros2-support, by the definitions that the bag itself carries.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap.records import Message, Schema
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoders
from mcap_ros2.decoder import DecoderFactory as Ros2Decoders

from pipeline.artifacts.bounds import MAGIC, BoundedFile
from pipeline.artifacts.reading import DAMAGE
from pipeline.camera.bag_messages import (
    camera_content,
    depth_encoding_of,
    depth_m_of,
    frame_id_of,
    points_m_of,
    root_from,
    transforms_of,
)
from pipeline.camera.camera_files import CameraFile, camera_of
from pipeline.camera.depth_files import check_range
from pipeline.camera.frame import Frame, camera_of_picture, frame_of_cloud
from pipeline.errors import ArtifactError, PictureError

IMAGES = (
    "sensor_msgs/msg/Image",
    "sensor_msgs/msg/CompressedImage",
    "foxglove.RawImage",
    "foxglove.CompressedImage",
)
CAMERAS = ("sensor_msgs/msg/CameraInfo", "foxglove.CameraCalibration")
CLOUDS = ("sensor_msgs/msg/PointCloud2", "foxglove.PointCloud")
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "foxglove.FrameTransform", "foxglove.FrameTransforms")


@dataclass(frozen=True, eq=False)
class RecordedPicture:
    """One depth picture of a bag, not yet decoded.

    Attributes
    ----------
    time_ns
        When it was recorded [ns].
    read
        Decodes it, with the camera and the transforms known by then; gives the frame and the name
        of the camera's coordinate frame.
    """

    time_ns: int
    read: Callable[[], tuple[Frame, str]]


class Bag:
    """An open bag."""

    def __init__(self, file: BoundedFile) -> None:
        self.path = file.path
        self._reader = make_reader(file, validate_crcs=True)
        self._decoders = (Ros2Decoders(), ProtobufDecoders())
        summary = self._reader.get_summary()
        if summary is None:
            raise self._error("it has no index", "Run 'mcap recover' on it")
        self.topics = {
            channel.topic: summary.schemas[channel.schema_id].name
            for channel in summary.channels.values()
            if channel.schema_id in summary.schemas
        }

    def pictures(
        self, topic: str | None = None, scale_m: float | None = None
    ) -> Iterator[RecordedPicture]:
        """Depth pictures, or clouds, in the order in which they were recorded.

        Parameters
        ----------
        topic
            Of the pictures; None: the only depth image, else the only cloud.
        scale_m
            Metres a unit of a depth image; None: as ROS REP 118 says.

        Yields
        ------
        RecordedPicture
            Each, to be decoded before the next is asked for.

        Raises
        ------
        PictureError
            The bag has no such topic, no camera info, or is damaged.
        """
        topic = self._chosen(topic)
        cloud = self.topics[topic] in CLOUDS
        cameras = [name for name, kind in self.topics.items() if kind in CAMERAS]
        if not cloud and not cameras:
            raise self._error(
                f"{topic} has no camera info: the bag holds neither "
                "sensor_msgs/CameraInfo nor foxglove.CameraCalibration",
                "Record the driver's camera_info topic too",
            )
        moving = [name for name, kind in self.topics.items() if kind in TRANSFORMS]
        described: dict[str, tuple[str, CameraFile]] = {}
        tree: dict[str, tuple[str, np.ndarray]] = {}
        for schema, name, message in self._messages([topic, *cameras, *moving]):
            if name == topic:
                read = partial(self._read, topic, schema, message, described, tree, scale_m)
                yield RecordedPicture(message.log_time, read)
            elif name in moving:
                tree |= transforms_of(self._decoded(schema, message))
            else:
                decoded = self._decoded(schema, message)
                content = camera_content(decoded)
                where = f"{self.path}, {name}"
                described[name] = (frame_id_of(decoded), camera_of(content, where))

    def _read(
        self,
        topic: str,
        schema: Schema,
        message: Message,
        described: dict[str, tuple[str, CameraFile]],
        tree: dict[str, tuple[str, np.ndarray]],
        scale_m: float | None,
    ) -> tuple[Frame, str]:
        decoded = self._decoded(schema, message)
        return self._frame(topic, decoded, described, tree, scale_m), frame_id_of(decoded)

    def _frame(
        self,
        topic: str,
        message: Any,
        described: dict[str, tuple[str, CameraFile]],
        tree: dict[str, tuple[str, np.ndarray]],
        scale_m: float | None,
    ) -> Frame:
        where = f"{self.path}, {topic}"
        pose = root_from(frame_id_of(message), tree)
        name = topic.strip("/").replace("/", "_")
        if self.topics[topic] in CLOUDS:
            return frame_of_cloud(name, points_m_of(message, where), pose)
        camera = self._camera(topic, frame_id_of(message), described)
        depth_m = depth_m_of(message, scale_m, where)
        check_range(Path(where), depth_m, 1.0 if scale_m is None else scale_m)
        shape = (depth_m.shape[0], depth_m.shape[1])
        if camera.size_px is not None and camera.size_px != (shape[1], shape[0]):
            raise PictureError(
                f"{where} has pictures of {shape[1]} by {shape[0]} pixels, and its camera info is "
                f"of {camera.size_px[0]} by {camera.size_px[1]}",
                "Record the camera info of the same stream",
            )
        return Frame(
            name=name,
            depth_m=depth_m,
            camera=camera_of_picture(
                name, shape, camera.intrinsics, np.eye(4) if pose is None else pose
            ),
            posed=pose is not None,
            allowed=np.ones(shape, dtype=bool),
        )

    def _camera(
        self, topic: str, frame_id: str, described: dict[str, tuple[str, CameraFile]]
    ) -> CameraFile:
        """The camera beside the topic, else the one of its frame, else the only one."""
        beside = topic.rpartition("/")[0] + "/"
        near = [camera for name, (_, camera) in described.items() if name.startswith(beside)]
        same = [camera for _, (of, camera) in described.items() if of == frame_id]
        every = [camera for _, camera in described.values()]
        for found in (near, same, every):
            if len(found) == 1:
                return found[0]
        raise self._error(
            f"{topic} has no camera info before it"
            if not every
            else f"{topic} has {len(every)} camera infos, none of which is beside it",
            "Record the camera_info topic of the depth image",
        )

    def _chosen(self, topic: str | None) -> str:
        """The topic that is asked for, or the only one that there is."""
        if topic is not None:
            if self.topics.get(topic) in (*IMAGES, *CLOUDS):
                return topic
            raise self._error(
                f"it has no images or clouds on {topic}", f"It holds {self._listed()}"
            )
        images = [name for name, kind in self.topics.items() if kind in IMAGES]
        depths = [name for name in sorted(images) if self._is_depth(name)]
        clouds = [name for name, kind in sorted(self.topics.items()) if kind in CLOUDS]
        found = depths or clouds
        if len(found) == 1:
            return found[0]
        raise self._error(
            f"it has {len(found)} topics of depth: {', '.join(found)}"
            if found
            else "it has no depth image and no point cloud",
            "Name one by --topic" if found else f"It holds {self._listed()}",
        )

    def _is_depth(self, topic: str) -> bool:
        first = next(self._messages([topic]), None)
        if first is None:
            return False
        return depth_encoding_of(self._decoded(first[0], first[2])) is not None

    def _messages(self, topics: list[str]) -> Iterator[tuple[Schema, str, Message]]:
        """Messages as they lie in the file, not decoded, by time."""
        for schema, channel, message in self._reader.iter_messages(topics=topics):
            if schema is not None:
                yield schema, channel.topic, message

    def _decoded(self, schema: Schema, message: Message) -> Any:
        encoding = "cdr" if schema.encoding.startswith("ros2") else "protobuf"
        for factory in self._decoders:
            decode = factory.decoder_for(encoding, schema)
            if decode is not None:
                return decode(message.data)
        raise self._error(
            f"{schema.name} is encoded as '{schema.encoding}'",
            "Bags of ROS 2 (ros2msg) and of Foxglove (protobuf) are read",
        )

    def _listed(self) -> str:
        return ", ".join(f"{name} ({kind})" for name, kind in sorted(self.topics.items())) or "none"

    def _error(self, what: str, remedy: str) -> PictureError:
        return PictureError(f"{self.path}: {what}", remedy)


@contextmanager
def open_bag(path: Path) -> Iterator[Bag]:
    """Open a bag; what is wrong with it is said in one sentence.

    Parameters
    ----------
    path
        An MCAP, or the folder that ``ros2 bag record`` wrote with one in it.

    Yields
    ------
    Bag
        The open bag.

    Raises
    ------
    PictureError
        It is missing, no MCAP, cut, or damaged.
    """
    path = _bag_file(path)
    with BoundedFile(path) as file:
        begins = file.read(len(MAGIC))
        file.seek(max(file.size - len(MAGIC), 0))
        ends = file.read(len(MAGIC))
        file.seek(0)
        if begins != MAGIC:
            raise PictureError(f"{path} is no MCAP", "Convert it by 'ros2 bag convert'")
        if ends != MAGIC or file.size < 2 * len(MAGIC):
            raise PictureError(
                f"{path} is cut: it ends before its index, as where a recorder was killed",
                "Run 'mcap recover' on it, or record it anew",
            )
        try:
            yield Bag(file)
        except ArtifactError as error:
            raise PictureError(error.what, "Record it anew, or run 'mcap recover' on it") from error
        except DAMAGE as error:
            raise PictureError(
                f"{path} is damaged: {' '.join(str(error).split()) or type(error).__name__}",
                "Record it anew, or run 'mcap recover' on it",
            ) from error


def _bag_file(path: Path) -> Path:
    if path.is_file():
        return path
    inside = sorted(path.glob("*.mcap")) if path.is_dir() else []
    if len(inside) == 1:
        return inside[0]
    if path.is_dir() and list(path.glob("*.db3")):
        raise PictureError(f"{path} is a bag in SQLite", "Convert it by 'ros2 bag convert' to mcap")
    raise PictureError(
        f"{path} holds {len(inside)} MCAP files" if path.is_dir() else f"{path} is not there",
        "Name one MCAP file",
    )
