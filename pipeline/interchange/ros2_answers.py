"""Ranked grasps as ROS 2 messages in an MCAP: PoseArray for programs, MarkerArray for RViz."""

from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from jaxtyping import Float
from mcap_ros2.writer import Writer

from pipeline.artifacts.publishing import scratch_beside
from pipeline.geometry.transforms import position_quaternion
from pipeline.interchange.ros2_definitions import MARKER_ARRAY, POSE_ARRAY
from pipeline.recording import colours

POSES, MARKERS = "/softgrip/grasps", "/softgrip/markers"
# Of visualization_msgs/Marker: a cylinder, added; all deleted.
_CYLINDER, _ADD, _DELETE_ALL = 3, 0, 3
PAD_HEIGHT_M = 0.002  # a pad is drawn as a disc so thick
_S = 1_000_000_000  # nanoseconds a second


class Ros2Answers:
    """A bag of answers; it appears whole, or not at all."""

    def __init__(self, path: Path, radius_m: float) -> None:
        """Begin a bag.

        Parameters
        ----------
        path
            Where it appears.
        radius_m
            r_G, the radius that pads are drawn with [m].
        """
        self._path, self._radius_m = path, radius_m

    def __enter__(self) -> Self:
        """Open a scratch file beside the path."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._scratch = scratch_beside(self._path)
        self._file = self._scratch.open("wb")
        self._writer = Writer(self._file)
        self._poses = self._writer.register_msgdef("geometry_msgs/msg/PoseArray", POSE_ARRAY)
        self._markers = self._writer.register_msgdef(
            "visualization_msgs/msg/MarkerArray", MARKER_ARRAY
        )
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Publish it, or remove what there is after an error."""
        self._writer.finish()
        self._file.close()
        if kind is None:
            self._scratch.replace(self._path)
        else:
            self._scratch.unlink()

    def write(
        self,
        camera_from_contact: Float[np.ndarray, "k 4 4"],
        quality: Float[np.ndarray, " k"],
        frame_id: str,
        time_ns: int,
    ) -> None:
        """The answer to one picture, the best grasp first; +z points out of the object.

        Parameters
        ----------
        camera_from_contact
            Poses in the camera's frame, shape (k, 4, 4) [m].
        quality
            q-hat of each, shape (k,).
        frame_id
            What ROS calls the camera's frame.
        time_ns
            When the picture was taken, which stamps the messages [ns].
        """
        stamp = {"sec": time_ns // _S, "nanosec": time_ns % _S}
        header = {"stamp": stamp, "frame_id": frame_id}
        poses = [_pose(pose) for pose in camera_from_contact]
        self._writer.write_message(
            POSES, self._poses, {"header": header, "poses": poses}, time_ns, time_ns
        )
        shown = colours.by_value(quality) / 255.0
        markers = [_marker(header, 0, _DELETE_ALL)]
        markers += [
            {
                **_marker(header, index, _ADD),
                "pose": pose,
                "scale": _xyz((2 * self._radius_m, 2 * self._radius_m, PAD_HEIGHT_M)),
                "color": dict(zip("rgba", (*map(float, colour), 1.0), strict=True)),
                "text": f"{value:.2f}",
            }
            for index, (pose, colour, value) in enumerate(zip(poses, shown, quality, strict=True))
        ]
        self._writer.write_message(MARKERS, self._markers, {"markers": markers}, time_ns, time_ns)


def _pose(pose: np.ndarray) -> dict[str, Any]:
    position, (w, x, y, z) = position_quaternion(pose)
    return {
        "position": _xyz(position),
        "orientation": {"x": float(x), "y": float(y), "z": float(z), "w": float(w)},
    }


def _xyz(values: Any) -> dict[str, float]:
    return dict(zip("xyz", map(float, values), strict=True))


def _marker(header: dict[str, Any], index: int, action: int) -> dict[str, Any]:
    stamp = {"sec": 0, "nanosec": 0}
    return {
        "header": header,
        "ns": "softgrip",
        "id": index,
        "type": _CYLINDER,
        "action": action,
        "pose": _pose(np.eye(4)),
        "scale": _xyz((0, 0, 0)),
        "color": dict.fromkeys("rgba", 0.0),
        "lifetime": stamp,
        "frame_locked": False,
        "points": [],
        "colors": [],
        "texture_resource": "",
        "texture": {
            "header": {"stamp": stamp, "frame_id": ""},
            "format": "",
            "data": b"",
        },
        "uv_coordinates": [],
        "text": "",
        "mesh_resource": "",
        "mesh_file": {"filename": "", "data": b""},
        "mesh_use_embedded_materials": False,
    }
