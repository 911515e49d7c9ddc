"""Intrinsics and poses in the layouts that drivers and datasets write."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from pipeline.camera.camera_files import camera_of, read_camera_file
from pipeline.errors import PictureError

K = [[615.0, 0.0, 320.0], [0.0, 616.0, 240.0], [0.0, 0.0, 1.0]]
FLAT = [value for row in K for value in row]
BY_COLUMNS = np.array(K).T.ravel().tolist()
# Pixel centres of these layouts lie at whole numbers, the project's at +0.5.
EXPECTED = np.array([[615.0, 0.0, 320.5], [0.0, 616.0, 240.5], [0.0, 0.0, 1.0]])

LAYOUTS: dict[str, Any] = {
    "this project's": {"intrinsics": K},
    "a bare matrix": K,
    "ROS 1 CameraInfo": {"K": FLAT, "D": [0.0] * 5, "width": 640, "height": 480},
    "ROS 2 CameraInfo": {"k": FLAT, "d": [], "width": 640, "height": 480},
    "camera_calibration": {
        "image_width": 640,
        "image_height": 480,
        "camera_matrix": {"rows": 3, "cols": 3, "data": FLAT},
        "distortion_coefficients": {"rows": 1, "cols": 5, "data": [0, 0, 0, 0, 0]},
    },
    "RealSense": {"fx": 615.0, "fy": 616.0, "ppx": 320.0, "ppy": 240.0, "coeffs": [0.0] * 5},
    "named numbers": {"intrinsics": {"fx": 615.0, "fy": 616.0, "cx": 320.0, "cy": 240.0}},
    "BOP": {"cam_K": FLAT, "depth_scale": 0.1},
    "Open3D": {"width": 640, "height": 480, "intrinsic_matrix": BY_COLUMNS},
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_gives_the_same_camera(layout: str) -> None:
    camera = camera_of(LAYOUTS[layout], "camera.json")
    assert camera.intrinsics == pytest.approx(EXPECTED)


def test_a_size_and_a_scale_are_read() -> None:
    assert camera_of(LAYOUTS["Open3D"], "f").size_px == (640, 480)
    assert camera_of(LAYOUTS["BOP"], "f").depth_scale_m == pytest.approx(1e-4)
    assert camera_of({**LAYOUTS["RealSense"], "depth_scale": 0.001}, "f").depth_scale_m == 1e-3


def test_yaml_as_opencv_writes_it(tmp_path: Path) -> None:
    path = tmp_path / "camera.yaml"
    path.write_text(
        "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
        f"   data: {FLAT}\n"
    )
    assert read_camera_file(path).intrinsics == pytest.approx(EXPECTED)


def test_a_pose_is_made_exactly_rigid() -> None:
    angle = 0.3
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    pose[:3, 3] = (0.1, 0.2, 0.9)
    rounded = {"intrinsics": K, "world_from_camera": np.round(pose, 4).tolist()}
    read = camera_of(rounded, "f").world_from_camera
    assert read is not None
    assert read[:3, :3] @ read[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
    assert read == pytest.approx(pose, abs=1e-4)
    inverse = {"intrinsics": K, "camera_from_world": np.linalg.inv(pose).tolist()}
    again = camera_of(inverse, "f").world_from_camera
    assert again == pytest.approx(pose)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ({}, "has no intrinsics"),
        (3, "holds no camera"),
        ({"K": FLAT[:8]}, "has 8 numbers"),
        ({"K": ["a"] * 9}, "not made of numbers"),
        ({"K": [float("nan")] * 9}, "not finite"),
        ({"K": [-615.0, *FLAT[1:]]}, "not above zero"),
        ({"K": [615.0, 4.0, *FLAT[2:]]}, "not of the form"),
        ({"K": FLAT, "D": [-0.3, 0.1, 0, 0, 0]}, "distortion that moves pixels by up to"),
        ({"K": FLAT, "world_from_camera": np.diag([2.0, 2, 2, 1]).tolist()}, "no rotation"),
        ({"K": FLAT, "world_from_camera": np.diag([1.0, 1, -1, 1]).tolist()}, "no rotation"),
        ({"K": FLAT, "world_from_camera": [1.0] * 12}, "has 12 numbers"),
        ({"K": FLAT, "depth_scale_m": 0}, "depth scale is 0"),
    ],
)
def test_what_is_no_camera_is_refused(content: Any, says: str) -> None:
    with pytest.raises(PictureError, match=says) as told:
        camera_of(content, "camera.json")
    assert "camera.json" in str(told.value)


@pytest.mark.parametrize(
    ("model", "coefficients"),
    [
        ("plumb_bob", [-0.2, 0.1, 0.003, -0.002, 0.01]),
        ("rational_polynomial", [0.6, -2.3, 1e-3, -4e-4, 1.4, 0.5, -2.1, 1.3]),
        ("equidistant", [-0.02, 0.01, 0.0, 0.001]),
    ],
)
def test_how_far_a_lens_moves_pixels_is_as_opencv_has_it(
    model: str, coefficients: list[float]
) -> None:
    corners = np.array([(0, 0), (640, 0), (0, 480), (640, 480)], dtype=np.float64)
    at = np.column_stack([(corners - EXPECTED[:2, 2] + 0.5) / (615.0, 616.0), np.ones(4)])
    nowhere, given = np.zeros(3), np.array(coefficients)
    if model == "equidistant":
        shown, _ = cv2.fisheye.projectPoints(at[:, None], nowhere, nowhere, np.array(K), given)
    else:
        shown, _ = cv2.projectPoints(at, nowhere, nowhere, np.array(K), given)
    moved = float(np.linalg.norm(shown.reshape(-1, 2) - corners, axis=1).max())
    content = {"k": FLAT, "d": coefficients, "width": 640, "height": 480}
    with pytest.raises(PictureError, match=f"moves pixels by up to {moved:.0f} px"):
        camera_of({**content, "distortion_model": model}, "f")


def test_a_slight_distortion_is_no_matter() -> None:
    assert camera_of({"K": FLAT, "D": [1e-4, 0, 0, 0, 0]}, "f").intrinsics[0, 0] == 615.0


def test_a_damaged_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "camera.json"
    path.write_text(json.dumps({"K": FLAT})[:-3])
    with pytest.raises(PictureError, match=r"camera\.json is no valid JSON"):
        read_camera_file(path)
