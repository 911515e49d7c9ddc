"""Frames are read with what lies beside them, and kept to a workspace."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.camera.frame import Frame
from pipeline.camera.frame_files import FrameFiles, frames_in, read_frame, within_workspace
from pipeline.errors import PictureError
from pipeline.world.cameras import points_of_depth
from tests.camera.scenes import HEIGHT_PX, INTRINSICS, WIDTH_PX, seen, table


@pytest.fixture
def depth(tmp_path: Path) -> Path:
    path = tmp_path / "desk.depth.png"
    Image.fromarray(np.full((HEIGHT_PX, WIDTH_PX), 700, dtype=np.uint16)).save(path)
    (tmp_path / "desk.json").write_text(json.dumps({"intrinsics": INTRINSICS.tolist()}))
    return path


def test_what_lies_beside_a_depth_image_is_found(depth: Path) -> None:
    Image.new("RGB", (WIDTH_PX, HEIGHT_PX), (9, 8, 7)).save(depth.with_name("desk.color.png"))
    mask = np.zeros((HEIGHT_PX, WIDTH_PX), dtype=np.uint8)
    mask[:, :100] = 255
    Image.fromarray(mask).save(depth.with_name("desk.mask.png"))
    frame = read_frame(FrameFiles(depth))
    assert frame.name == "desk"
    assert not frame.posed
    assert frame.colour is not None
    assert frame.colour[0, 0].tolist() == [9, 8, 7]
    assert frame.allowed.sum() == 100 * HEIGHT_PX
    assert frame.instances is None


def test_one_camera_serves_all_frames_of_a_folder(depth: Path) -> None:
    depth.with_name("desk.json").rename(depth.with_name("camera.json"))
    assert read_frame(FrameFiles(depth)).camera.intrinsics[0, 0] == INTRINSICS[0, 0]


def test_frames_of_a_folder_are_found_by_their_names(depth: Path) -> None:
    folder = depth.parent
    (folder / "below").mkdir()
    for name in ("below/b.depth.npy", "c.PLY", "desk.mask.png", "d.npy", "camera.json"):
        (folder / name).touch()
    found = [item.depth.relative_to(folder).as_posix() for item in frames_in(folder)]
    assert found == ["below/b.depth.npy", "c.PLY", "desk.depth.png"]


def test_a_missing_camera_is_asked_for(depth: Path) -> None:
    depth.with_name("desk.json").unlink()
    with pytest.raises(PictureError, match=r"no camera beside it.*desk\.json"):
        read_frame(FrameFiles(depth))


@pytest.mark.parametrize(
    ("camera", "says"),
    [
        ({"width": 640, "height": 480}, "640 by 480 pixels, and .* has 320 by 240"),
        ({"K": [300, 0, 900, 0, 300, 120, 0, 0, 1]}, "centre .* lies outside the depth image"),
        ({"K": [150, 0, 79.5, 0, 150, 59.5, 0, 0, 1]}, "of a picture of 160 by 120 pixels, and"),
        ({"K": [300, 0, 119.5, 0, 300, 159.5, 0, 0, 1]}, "of a picture of 240 by 320 pixels, and"),
        ({"K": [300, 0, 159.5, 0, 400, 119.5, 0, 0, 1]}, "pixels of depth cameras are square"),
        ({"K": [9000, 0, 160, 0, 9000, 120, 0, 0, 1]}, "a picture 2 degrees wide"),
    ],
)
def test_intrinsics_that_do_not_fit_are_refused(
    depth: Path, camera: dict[str, object], says: str
) -> None:
    given = {"intrinsics": INTRINSICS.tolist(), **camera}
    if "K" in camera:
        del given["intrinsics"]
    depth.with_name("desk.json").write_text(json.dumps(given))
    with pytest.raises(PictureError, match=says):
        read_frame(FrameFiles(depth))


def test_a_crop_off_the_middle_is_taken(depth: Path) -> None:
    k = [[300.0, 0.0, 90.0], [0.0, 300.0, 150.0], [0.0, 0.0, 1.0]]
    depth.with_name("desk.json").write_text(json.dumps({"intrinsics": k}))
    assert read_frame(FrameFiles(depth)).camera.intrinsics[0, 2] == 90.5


def test_a_picture_of_another_size_than_its_depth_is_refused(depth: Path) -> None:
    Image.new("RGB", (640, 480)).save(depth.with_name("desk.color.png"))
    with pytest.raises(PictureError, match="colour picture is 640 by 480 pixels, and the depth"):
        read_frame(FrameFiles(depth))


def test_a_camera_with_distortion_is_refused(depth: Path) -> None:
    text = (
        "image_width: 320\nimage_height: 240\n"
        "camera_matrix: {rows: 3, cols: 3, data: [300, 0, 159.5, 0, 300, 119.5, 0, 0, 1]}\n"
        "distortion_model: plumb_bob\n"
        "distortion_coefficients: {rows: 1, cols: 5, data: [-0.2, 0.05, 0, 0, 0]}\n"
    )
    camera = depth.with_name("lens.yaml")
    camera.write_text(text)
    with pytest.raises(PictureError, match=r"lens\.yaml: its lens has distortion .* Rectify"):
        read_frame(FrameFiles(depth, camera=camera))


def test_nan_is_what_was_not_measured(tmp_path: Path) -> None:
    path = tmp_path / "desk.depth.npy"
    depth_m = np.full((HEIGHT_PX, WIDTH_PX), 0.7, dtype=np.float32)
    depth_m[:50] = np.nan
    depth_m[50:60] = np.inf
    np.save(path, depth_m)
    (tmp_path / "desk.json").write_text(json.dumps({"intrinsics": INTRINSICS.tolist()}))
    read = read_frame(FrameFiles(path)).depth_m
    assert (read[:60] == 0).all()
    assert (read[60:] == np.float32(0.7)).all()


def test_a_mask_of_what_was_not_measured_is_refused(depth: Path) -> None:
    empty = np.asarray(Image.open(depth)).copy()
    empty[:, :100] = 0
    Image.fromarray(empty).save(depth)
    mask = np.zeros((HEIGHT_PX, WIDTH_PX), dtype=np.uint8)
    mask[:, :50] = 255
    Image.fromarray(mask).save(depth.with_name("desk.mask.png"))
    with pytest.raises(PictureError, match="allows only pixels that were not measured"):
        read_frame(FrameFiles(depth))


@pytest.fixture(scope="module")
def posed() -> Frame:
    return seen([table()], (0.05, -0.35, 0.6), 0.0, posed=True)


def allowed_points(frame: Frame) -> np.ndarray:
    points, rows, columns = points_of_depth(frame.depth_m, frame.camera, 1)
    return np.asarray(points[frame.allowed[rows, columns]])


def test_a_box_of_the_world_keeps_what_lies_in_it(posed: Frame, tmp_path: Path) -> None:
    path = tmp_path / "w.json"
    path.write_text(json.dumps({"box_m": [[0.1, 0.1, 0.1], [-0.1, 0.0, -0.1]]}))
    points = allowed_points(within_workspace(posed, path))
    assert len(points) > 100
    assert (np.abs(points[:, 0]) <= 0.1).all()
    assert ((points[:, 1] >= 0) & (points[:, 1] <= 0.1)).all()


def test_a_polygon_of_the_world_keeps_what_lies_in_it(posed: Frame, tmp_path: Path) -> None:
    path = tmp_path / "w.json"
    path.write_text(json.dumps({"polygon_m": [[-0.1, -0.1], [0.1, -0.1], [0.0, 0.1]]}))
    points = allowed_points(within_workspace(posed, path))
    assert len(points) > 100
    # Inside a triangle: below both of its slanted sides.
    assert (points[:, 1] <= 0.1 - 2 * np.abs(points[:, 0]) + 1e-9).all()
    assert (points[:, 1] >= -0.1).all()


def test_a_polygon_of_pixels_keeps_its_pixels(posed: Frame, tmp_path: Path) -> None:
    path = tmp_path / "w.json"
    path.write_text(json.dumps({"polygon_px": [[100, 50], [200, 50], [200, 150], [100, 150]]}))
    allowed = within_workspace(posed, path).allowed
    assert allowed[100, 150]
    assert not allowed[30, 150]
    assert not allowed[100, 220]


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("{", "cannot be read as JSON"),
        ("[]", "names 0 of box_m"),
        ('{"box_m": [[0, 0, 0]]}', r"has the shape \(1, 3\), and 2 corners"),
        ('{"polygon_px": [[0, 0], [1, 1]]}', "three or more corners"),
        ('{"polygon_m": [["a", 0], [1, 1], [1, 0]]}', "not made of numbers"),
        ('{"box_m": [[8, 8, 8], [9, 9, 9]]}', "nothing that synthetic measured lies in this"),
    ],
)
def test_what_is_no_workspace_is_refused(
    posed: Frame, tmp_path: Path, content: str, says: str
) -> None:
    path = tmp_path / "w.json"
    path.write_text(content)
    with pytest.raises(PictureError, match=says) as told:
        within_workspace(posed, path)
    assert "w.json" in str(told.value)
