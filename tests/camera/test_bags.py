"""Bags of ROS 2, written by another library, are read as what was recorded; others are refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap_protobuf.writer import Writer as ProtobufWriter

from pipeline.camera.bags import open_bag
from pipeline.camera.frame import Frame
from pipeline.errors import PictureError
from pipeline.messages.foxglove import camera_calibration, frame_transforms, raw_image
from pipeline.world.cameras import points_of_depth
from tests.camera.bag_files import (
    BEGIN_NS,
    DEPTH,
    INFO,
    OPTICAL,
    TF,
    camera_info,
    cloud,
    compressed,
    image,
    transform,
    write_bag,
)
from tests.camera.scenes import box, seen, table

STEP_NS = 66_000_000


@pytest.fixture(scope="module")
def frame() -> Frame:
    target = box((0.12, 0.10, 0.08), (0.03, 0.02, 0.04))
    return seen([table(), target], (0.05, -0.35, 0.6), 0.0, posed=True)


def read_all(path: Path, **options: Any) -> list[tuple[int, Frame, str]]:
    with open_bag(path) as bag:
        return [(one.time_ns, *one.read()) for one in bag.pictures(**options)]


@pytest.mark.parametrize(
    ("message", "tolerance_m"),
    [
        (lambda frame: image(frame, BEGIN_NS), 5.1e-4),
        (lambda frame: image(frame, BEGIN_NS, "32FC1"), 1e-6),
        (lambda frame: compressed(frame, BEGIN_NS), 5.1e-4),
        (lambda frame: compressed(frame, BEGIN_NS, "32FC1"), 5e-3),
    ],
    ids=["16UC1", "32FC1", "compressed 16UC1", "compressed 32FC1"],
)
def test_every_kind_of_depth_image_gives_the_same_picture(
    frame: Frame, tmp_path: Path, message: Any, tolerance_m: float
) -> None:
    path = write_bag(
        tmp_path / "bag",
        [
            (TF, BEGIN_NS - 2, transform(frame, BEGIN_NS)),
            (INFO, BEGIN_NS - 1, camera_info(frame, BEGIN_NS)),
            (DEPTH, BEGIN_NS, message(frame)),
            (DEPTH, BEGIN_NS + STEP_NS, message(frame)),
        ],
    )
    for source in (path, path.parent):
        found = read_all(source)
        assert [time_ns for time_ns, _, _ in found] == [BEGIN_NS, BEGIN_NS + STEP_NS]
        _, read, frame_id = found[0]
        assert frame_id == OPTICAL
        assert read.depth_m == pytest.approx(frame.depth_m, abs=tolerance_m)
        assert read.camera.intrinsics == pytest.approx(frame.camera.intrinsics)
        assert read.posed
        assert read.camera.world_from_camera == pytest.approx(
            frame.camera.world_from_camera, abs=1e-9
        )


def test_a_cloud_needs_no_camera(frame: Frame, tmp_path: Path) -> None:
    unposed = Frame(**{**vars(frame), "camera": frame.camera})
    local = unposed.moved(np.linalg.inv(frame.camera.world_from_camera))
    points, _, _ = points_of_depth(local.depth_m, local.camera, 1)
    spoilt = np.vstack([points, np.full((5, 3), np.nan), np.zeros((5, 3))])
    path = write_bag(tmp_path / "bag", [("/points", BEGIN_NS, cloud(spoilt, BEGIN_NS))])
    _, read, _ = read_all(path)[0]
    assert not read.posed
    again, _, _ = points_of_depth(read.depth_m, read.camera, 1)
    assert np.percentile(again[:, 2], [5, 50, 95]) == pytest.approx(
        np.percentile(points[:, 2], [5, 50, 95]), abs=0.01
    )


def foxglove_bag(frame: Frame, path: Path) -> Path:
    camera = frame.camera
    poses = {frame.camera.name: frame.camera.world_from_camera}
    with path.open("wb") as file, ProtobufWriter(file) as writer:
        for topic, message in (
            ("/tf", frame_transforms(poses, 0)),
            ("/camera/calibration", camera_calibration(camera, 0)),
            ("/camera/depth", raw_image(frame.depth_m, "32FC1", "<f4", camera, 0)),
        ):
            writer.write_message(topic, message, log_time=BEGIN_NS, publish_time=BEGIN_NS)
    return path


def test_foxglove_topics_are_read_too(frame: Frame, tmp_path: Path) -> None:
    _, read, _ = read_all(foxglove_bag(frame, tmp_path / "foxglove.mcap"))[0]
    assert read.depth_m == pytest.approx(frame.depth_m, abs=1e-6)
    assert read.camera.intrinsics == pytest.approx(frame.camera.intrinsics)
    assert read.camera.world_from_camera == pytest.approx(frame.camera.world_from_camera)


def whole(frame: Frame, folder: Path) -> Path:
    return write_bag(
        folder,
        [(INFO, BEGIN_NS, camera_info(frame, 0)), (DEPTH, BEGIN_NS + 1, image(frame, 0))],
    )


def test_a_bag_without_camera_info_is_refused(frame: Frame, tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag", [(DEPTH, BEGIN_NS, image(frame, 0))])
    with pytest.raises(PictureError, match=r"bag.*has no camera info.* Record the driver's"):
        read_all(path)


def test_a_picture_before_its_camera_info_is_refused(frame: Frame, tmp_path: Path) -> None:
    path = write_bag(
        tmp_path / "bag",
        [(DEPTH, BEGIN_NS, image(frame, 0)), (INFO, BEGIN_NS + 1, camera_info(frame, 0))],
    )
    with pytest.raises(PictureError, match="has no camera info before it"):
        read_all(path)


@pytest.mark.parametrize("left", [0.3, 0.7, 0.999])
def test_a_cut_bag_is_refused(frame: Frame, tmp_path: Path, left: float) -> None:
    path = whole(frame, tmp_path / "bag")
    data = path.read_bytes()
    path.write_bytes(data[: int(left * len(data))])
    with pytest.raises(PictureError, match=r"is cut: .*mcap recover"):
        read_all(path)


def test_a_damaged_bag_is_refused(frame: Frame, tmp_path: Path) -> None:
    path = foxglove_bag(frame, tmp_path / "foxglove.mcap")
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(PictureError, match="damaged"):
        read_all(path)


def test_a_lens_with_distortion_is_refused(frame: Frame, tmp_path: Path) -> None:
    path = write_bag(
        tmp_path / "bag",
        [
            (INFO, BEGIN_NS, camera_info(frame, 0, (-0.3, 0.1, 0.0, 0.0, 0.0))),
            (DEPTH, BEGIN_NS + 1, image(frame, 0)),
        ],
    )
    with pytest.raises(PictureError, match=r"camera_info: its lens has distortion"):
        read_all(path)


def test_topics_are_named_where_there_are_none_or_several(frame: Frame, tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a", [(INFO, BEGIN_NS, camera_info(frame, 0))])
    with pytest.raises(PictureError, match=r"no depth image and no point cloud.*camera_info"):
        read_all(path)
    messages: list[tuple[str, int, Any]] = [(INFO, BEGIN_NS, camera_info(frame, 0))]
    messages += [(topic, BEGIN_NS + 1, image(frame, 0)) for topic in (DEPTH, "/other/depth")]
    path = write_bag(tmp_path / "b", messages)
    with pytest.raises(PictureError, match=r"2 topics of depth: .*Name one by --topic"):
        read_all(path)
    assert len(read_all(path, topic="/other/depth")) == 1
    with pytest.raises(PictureError, match="no images or clouds on /nothing"):
        read_all(path, topic="/nothing")


def test_what_is_no_bag_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PictureError, match="is not there"):
        read_all(tmp_path / "none.mcap")
    (tmp_path / "x.mcap").write_bytes(b"something else")
    with pytest.raises(PictureError, match="is no MCAP"):
        read_all(tmp_path / "x.mcap")
