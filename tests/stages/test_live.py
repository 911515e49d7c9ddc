"""`make live`: a bag by an independent writer in, an answer that an independent reader reads."""

import json
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.camera.frame import Frame
from pipeline.config.learning import NetworkConfig
from pipeline.network.export import export_onnx_bytes
from pipeline.network.ga_cnn import build_network
from schemas.softgrip.v1.predictions_pb2 import RankedGrasps
from stages.live import live
from tests.camera.bag_files import (
    BEGIN_NS,
    DEPTH,
    INFO,
    OPTICAL,
    TF,
    camera_info,
    image,
    transform,
    write_bag,
)
from tests.camera.scenes import box, seen, table
from tests.network.test_inference import lively

PICTURES, STEP_NS = 6, 2_000_000_000  # slow enough that none is skipped on any machine


@pytest.fixture(scope="module")
def frame() -> Frame:
    target = box((0.12, 0.10, 0.08), (0.03, 0.02, 0.04))
    return seen([table(), target], (0.05, -0.35, 0.6), 0.001, posed=True)


@pytest.fixture(scope="module")
def results(frame: Frame, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("live")
    times = [BEGIN_NS + STEP_NS * number for number in range(PICTURES)]
    bag = write_bag(
        folder / "bag",
        [
            (TF, BEGIN_NS - 2, transform(frame, BEGIN_NS)),
            (INFO, BEGIN_NS - 1, camera_info(frame, BEGIN_NS)),
            *((DEPTH, time_ns, image(frame, time_ns)) for time_ns in times),
            # A fast camera's burst: all but the first come while it is worked on.
            *((DEPTH, times[-1] + STEP_NS + n, image(frame, times[-1])) for n in range(4)),
        ],
    )
    network = folder / "small.onnx"
    config = NetworkConfig(layers=18, channels=(8, 8, 16, 16))
    network.write_bytes(export_onnx_bytes(lively(build_network(config, seed=0)), cells=24))
    live(bag, network=str(network), run="ci", out=folder / "out")
    return folder / "out"


def test_every_picture_is_answered_or_counted(results: Path) -> None:
    told = json.loads((results / "live.json").read_text())
    assert told["answered"] == told["with_grasps"] == PICTURES + 1
    assert told["skipped"] == 3
    assert told["supports_found"] == 1
    assert told["refused"] == {}
    whole = told["ms"]["picture to pose"]
    assert whole["p50"] <= whole["p95"] <= whole["p99"]
    parts = sum(times["p50"] for part, times in told["ms"].items() if part != "picture to pose")
    assert parts == pytest.approx(whole["p50"], rel=0.5)


def test_an_independent_reader_reads_the_poses(results: Path, frame: Frame) -> None:
    with AnyReader([results / "ros2.mcap"]) as reader:
        found = [
            (connection.msgtype, time_ns, reader.deserialize(data, connection.msgtype))
            for connection, time_ns, data in reader.messages()
        ]
    arrays = [(t, m) for kind, t, m in found if kind == "geometry_msgs/msg/PoseArray"]
    markers = [m for kind, _, m in found if kind == "visualization_msgs/msg/MarkerArray"]
    assert len(arrays) == len(markers) == PICTURES + 1
    for (time_ns, poses), shown in zip(arrays, markers, strict=True):
        stamp = poses.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == time_ns
        assert poses.header.frame_id == OPTICAL
        assert 1 <= len(poses.poses) <= 5
        assert len(shown.markers) == len(poses.poses) + 1  # the first deletes those before
        for pose in poses.poses:
            at = frame.camera.world_from_camera @ np.array(
                [pose.position.x, pose.position.y, pose.position.z, 1.0]
            )
            assert at[2] == pytest.approx(0.08, abs=0.085)  # on the box
            q = pose.orientation
            out = frame.camera.world_from_camera[:3, :3] @ Rotation.from_quat(
                [q.x, q.y, q.z, q.w]
            ).apply([0.0, 0.0, 1.0])
            assert out[2] > np.cos(np.radians(51))  # out of the box, within the tilt
        assert shown.markers[1].scale.x == pytest.approx(0.05)


def test_messages_of_the_project_say_the_same(results: Path) -> None:
    with open_artifact(results / "grasps.mcap") as artifact:
        messages = list(artifact.messages(RankedGrasps))
    assert [time_ns for time_ns, _ in messages][:2] == [BEGIN_NS, BEGIN_NS + STEP_NS]
    with AnyReader([results / "ros2.mcap"]) as reader:
        first = next(
            reader.deserialize(data, connection.msgtype)
            for connection, _, data in reader.messages()
            if connection.topic == "/softgrip/grasps"
        )
    position = first.poses[0].position
    expected = from_tensor(messages[0][1].camera_from_contact)[0, :3, 3]
    assert (position.x, position.y, position.z) == pytest.approx(tuple(expected))
