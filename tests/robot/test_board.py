"""The check by a printed board, on pictures drawn by a homography from poses that are known."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.errors import CalibrationError
from pipeline.robot.board import (
    BoardSize,
    camera_from_board,
    check_hand_eye,
    draw_board,
    read_grey,
)
from pipeline.robot.calibration import read_calibration
from stages.board import board
from tests.robot.conftest import CALIBRATION

SIZE = BoardSize(8, 6, 0.03)
DOTS = 100  # an inch, of the drawing


def poses(count: int = 7) -> list[np.ndarray]:
    """base_from_camera of a camera that looks at the board from all around."""
    found = []
    for number in range(count):
        angle = 2 * np.pi * number / count
        tilt = Rotation.from_euler("xyz", [np.pi - 0.3 * np.cos(angle), 0.35 * np.sin(angle), 0.2])
        pose = np.eye(4)
        pose[:3, :3] = tilt.as_matrix()
        middle = np.array([0.5 + 0.12, 0.09 - 0.1, 0.02])
        pose[:3, 3] = middle - (0.38 + 0.02 * (number % 3)) * pose[:3, 2]
        found.append(pose)
    return found


# The print's y axis points to -y of the base, its z into the table.
BASE_FROM_BOARD = np.array([[1.0, 0, 0, 0.5], [0, -1, 0, 0.08], [0, 0, -1, 0.02], [0, 0, 0, 1]])


def drawn(k: np.ndarray, camera_from_print: np.ndarray, width: int, height: int) -> np.ndarray:
    """The print seen by a pinhole whose pixel centres are whole numbers."""
    dots_a_metre = DOTS / 0.0254
    picture = draw_board(SIZE, DOTS)
    scale = picture.shape[1] / (SIZE.columns * SIZE.square_m)
    assert scale == pytest.approx(dots_a_metre, rel=0.01)
    metres = np.array([[1 / scale, 0, 0.5 / scale], [0, 1 / scale, 0.5 / scale], [0, 0, 1]])
    onto = k @ camera_from_print[:3, [0, 1, 3]] @ metres
    return cv2.warpPerspective(
        picture, onto, (width, height), flags=cv2.INTER_AREA, borderValue=255
    )


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Calibration, pictures and poses whose hand-eye is exactly the file's."""
    folder = tmp_path_factory.mktemp("board")
    content = json.loads(CALIBRATION.read_text())
    (folder / "cell.json").write_text(json.dumps(content))
    camera = content["wrist_camera"]
    k = np.array([[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1]])
    hand_eye = read_calibration(folder / "cell.json").flange_from_camera
    listed = []
    for number, base_from_camera in enumerate(poses()):
        camera_from_print = np.linalg.inv(base_from_camera) @ BASE_FROM_BOARD
        picture = drawn(k, camera_from_print, camera["width"], camera["height"])
        cv2.imwrite(str(folder / f"{number}.png"), picture)
        flange = base_from_camera @ np.linalg.inv(hand_eye)
        listed.append({"picture": f"{number}.png", "base_from_flange": flange.tolist()})
    (folder / "poses.json").write_text(json.dumps(listed))
    return folder


def test_the_board_is_found_where_it_lies(cell: Path) -> None:
    camera = read_calibration(cell / "cell.json").wrist
    for number, base_from_camera in enumerate(poses()):
        found = camera_from_board(read_grey(cell / f"{number}.png"), camera, SIZE, "picture")
        true = np.linalg.inv(base_from_camera) @ BASE_FROM_BOARD
        corners = SIZE.corners_m @ (found - true)[:3, :3].T + (found - true)[:3, 3]
        assert np.linalg.norm(corners, axis=1).max() < 1.5e-3


def checked(cell: Path, tmp_path: Path, off: np.ndarray) -> dict[str, object]:
    content = json.loads((cell / "cell.json").read_text())
    hand_eye = np.array(content["flange_from_camera"]) @ off
    content["flange_from_camera"] = hand_eye.tolist()
    path = tmp_path / "cell.json"
    path.write_text(json.dumps(content))
    board(tmp_path, poses=cell / "poses.json", calibration=path, square_mm=30.0)
    figures: dict[str, object] = json.loads((tmp_path / "board.json").read_text())
    return figures


def test_a_right_calibration_leaves_less_than_a_millimetre(cell: Path, tmp_path: Path) -> None:
    figures = checked(cell, tmp_path, np.eye(4))
    assert max(dict(figures["residue_mm"]).values()) < 1.0  # type: ignore[call-overload]


def test_a_wrong_one_is_told_with_the_right_one(cell: Path, tmp_path: Path) -> None:
    off = np.eye(4)
    off[:3, :3] = Rotation.from_rotvec([0.0, np.radians(2.0), 0.0]).as_matrix()
    off[:3, 3] = (0.006, -0.004, 0.0)
    figures = checked(cell, tmp_path, off)
    residue = dict(figures["residue_mm"])  # type: ignore[call-overload]
    assert np.sqrt(np.mean(np.square(list(residue.values())))) > 3.0
    assert figures["given_is_off_by_mm"] == pytest.approx(7.2, abs=1.5)
    assert figures["given_is_off_by_deg"] == pytest.approx(2.0, abs=0.3)
    true = read_calibration(cell / "cell.json").flange_from_camera
    fitted = np.array(figures["flange_from_camera"])
    assert fitted[:3, 3] == pytest.approx(true[:3, 3], abs=1.5e-3)
    turned = Rotation.from_matrix(fitted[:3, :3].T @ true[:3, :3]).magnitude()
    assert np.degrees(turned) < 0.3


def test_exact_poses_leave_nothing_and_find_hand_eye_exactly() -> None:
    rng = np.random.default_rng(0)
    hand_eye = np.eye(4)
    hand_eye[:3, :3] = Rotation.random(random_state=1).as_matrix()
    hand_eye[:3, 3] = (0.1, -0.05, 0.03)
    cameras = poses()
    flanges = [pose @ np.linalg.inv(hand_eye) for pose in cameras]
    boards = [np.linalg.inv(pose) @ BASE_FROM_BOARD for pose in cameras]
    assert check_hand_eye(flanges, boards, hand_eye, SIZE).distance_mm.max() < 1e-6
    spoiled = hand_eye.copy()
    spoiled[:3, :3] = spoiled[:3, :3] @ Rotation.from_rotvec(0.05 * rng.normal(size=3)).as_matrix()
    spoiled[:3, 3] += 0.01
    found = check_hand_eye(flanges, boards, spoiled, SIZE)
    assert found.fitted == pytest.approx(hand_eye, abs=1e-6)
    assert found.distance_mm.min() > 0.5


def test_pictures_that_say_too_little_are_told(cell: Path, tmp_path: Path) -> None:
    camera = read_calibration(cell / "cell.json").wrist
    shape = (camera.height_px, camera.width_px)
    with pytest.raises(CalibrationError, match="empty shows 0 corners of the board"):
        camera_from_board(np.full(shape, 200, np.uint8), camera, SIZE, "empty")
    with pytest.raises(CalibrationError, match="and its camera takes 640 by 480"):
        camera_from_board(np.zeros((10, 10), np.uint8), camera, SIZE, "small")
    with pytest.raises(CalibrationError, match="cannot be read as a picture"):
        read_grey(tmp_path / "none.png")
    still = [np.eye(4)] * 6
    with pytest.raises(CalibrationError, match="turned about one axis only"):
        check_hand_eye(still, still, np.eye(4), SIZE)
    with pytest.raises(CalibrationError, match="2 pictures say too little"):
        check_hand_eye(still[:2], still[:2], np.eye(4), SIZE)
    with pytest.raises(CalibrationError, match="given without a calibration"):
        board(tmp_path, poses=cell / "poses.json")
    (tmp_path / "poses.json").write_text('[{"picture": "0.png"}]')
    with pytest.raises(CalibrationError, match="no list of pictures and poses"):
        board(tmp_path, poses=tmp_path / "poses.json", calibration=cell / "cell.json")


def test_the_print_has_the_size_that_it_says(tmp_path: Path) -> None:
    board(tmp_path, square_mm=25.4, columns=5, rows=4)
    assert read_grey(tmp_path / "board.png").shape == (4 * 300, 5 * 300)
