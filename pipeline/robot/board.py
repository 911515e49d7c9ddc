"""Hand-eye calibration held against pictures of a printed board that lies still.

Each picture gives the board in the camera, each pose of the arm the camera in the base by way of
the calibration, so each gives the board in the base: the same place each time, where all is right.
How far these places differ is the residue of intrinsics, hand-eye, arm and print together.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from pipeline.errors import CalibrationError
from pipeline.geometry.transforms import invert, transform_points
from pipeline.read_only import read_only
from pipeline.world.cameras import PIXEL_CENTRE_PX, PinholeCamera

DICTIONARY = cv2.aruco.DICT_5X5_100
MARKER_SHARE = 0.75  # of a square's side
FEWEST_CORNERS = 8  # of a picture: fewer give no pose that can be trusted
FEWEST_PICTURES = 5  # hand-eye and the board have 12 unknowns, a picture says 6
# The arm must turn about axes this far apart between pictures, or hand-eye is not determined.
LEAST_TURN_RAD, LEAST_BETWEEN_AXES_RAD = np.radians(10.0), np.radians(10.0)
MM_AN_INCH = 25.4


@dataclass(frozen=True)
class BoardSize:
    """A ChArUco board. columns, rows : of squares. square_m : measured side of one [m]."""

    columns: int = 8
    rows: int = 6
    square_m: float = 0.03

    @property
    def board(self) -> cv2.aruco.CharucoBoard:
        """OpenCV's board; its frame has the origin at a corner of the print, z into it."""
        size = (self.columns, self.rows)
        marker_m = MARKER_SHARE * self.square_m
        return cv2.aruco.CharucoBoard(
            size, self.square_m, marker_m, cv2.aruco.getPredefinedDictionary(DICTIONARY)
        )

    @property
    def corners_m(self) -> Float[np.ndarray, "4 3"]:
        """The print's outer corners in its own frame."""
        x, y = self.columns * self.square_m, self.rows * self.square_m
        return np.array([[0.0, 0, 0], [x, 0, 0], [x, y, 0], [0, y, 0]])


@dataclass(frozen=True, eq=False)
class HandEyeCheck:
    """How well a hand-eye calibration fits pictures of a board.

    Attributes
    ----------
    distance_mm
        How far the corners of each picture's board lie from their mean, root mean square over
        the four, shape (n,).
    fitted
        flange_from_camera that fits these pictures best, shape (4, 4).
    fitted_mm
        The same distances by it, shape (n,).
    off_mm
        How far the given one is from it [mm].
    off_rad
        And turned by how much [rad].
    """

    distance_mm: Float[np.ndarray, " n"]
    fitted: Float[np.ndarray, "4 4"]
    fitted_mm: Float[np.ndarray, " n"]
    off_mm: float
    off_rad: float

    def __post_init__(self) -> None:
        for name in ("distance_mm", "fitted", "fitted_mm"):
            object.__setattr__(self, name, read_only(getattr(self, name)))


def draw_board(size: BoardSize, dots_an_inch: int) -> UInt8[np.ndarray, "h w"]:
    """The board to print at a resolution, without a margin; printers must not scale it."""
    dots = round(1000 * size.square_m / MM_AN_INCH * dots_an_inch)
    return np.asarray(size.board.generateImage((dots * size.columns, dots * size.rows)))


def camera_from_board(
    picture: UInt8[np.ndarray, "h w"], camera: PinholeCamera, size: BoardSize, name: str
) -> Float[np.ndarray, "4 4"]:
    """Pose of the board in the camera that took a picture of it.

    Parameters
    ----------
    picture
        Grey levels, rectified, shape (h, w).
    camera
        Its intrinsics.
    size
        The board.
    name
        What the picture is called, for errors.

    Returns
    -------
    The pose, shape (4, 4).

    Raises
    ------
    CalibrationError
        Too little of the board is seen, or the picture has another size than its camera.
    """
    if picture.shape != (camera.height_px, camera.width_px):
        raise CalibrationError(
            f"{name} is {picture.shape[1]} by {picture.shape[0]} pixels, and its camera takes "
            f"{camera.width_px} by {camera.height_px}",
            "Give pictures of the stream that is calibrated",
        )
    board = size.board
    corners, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(picture)
    found = 0 if ids is None else len(ids)
    if found < FEWEST_CORNERS:
        raise CalibrationError(
            f"{name} shows {found} corners of the board, and {FEWEST_CORNERS} are needed",
            "Light it well, hold the camera still, and check columns, rows and the print",
        )
    on_board = np.asarray(board.getChessboardCorners())[np.ravel(ids)]
    k = camera.intrinsics.copy()
    k[:2, 2] -= PIXEL_CENTRE_PX  # OpenCV's pixel centres
    _, turn, move = cv2.solvePnP(on_board, corners, k, None, flags=cv2.SOLVEPNP_ITERATIVE)
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(turn)[0]
    pose[:3, 3] = move.ravel()
    return pose


def check_hand_eye(
    base_from_flange: Sequence[Float[np.ndarray, "4 4"]],
    camera_from_board: Sequence[Float[np.ndarray, "4 4"]],
    flange_from_camera: Float[np.ndarray, "4 4"],
    size: BoardSize,
) -> HandEyeCheck:
    """Where the board lies by each picture, by the given calibration and by the best one.

    Parameters
    ----------
    base_from_flange
        The arm's pose at each picture, each of shape (4, 4).
    camera_from_board
        The board in the camera at each, each of shape (4, 4).
    flange_from_camera
        The calibration that is checked, shape (4, 4).
    size
        The board.

    Returns
    -------
    Distances, and the calibration that makes their squares least.

    Raises
    ------
    CalibrationError
        There are too few pictures, or the arm turned too little between them.
    """
    _check_poses(base_from_flange)
    corners = size.corners_m
    flanges, boards = np.array(base_from_flange), np.array(camera_from_board)

    def placed(hand_eye: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "n 4 3"]:
        return np.array(
            [
                transform_points(flange @ hand_eye @ board, corners)
                for flange, board in zip(flanges, boards, strict=True)
            ]
        )

    def away_m(changed: Float[np.ndarray, " 6"]) -> Float[np.ndarray, " r"]:
        places = placed(flange_from_camera @ _pose_of(changed))
        return np.asarray((places - places.mean(axis=0)).ravel())

    best = least_squares(away_m, np.zeros(6), x_scale=(0.1, 0.1, 0.1, 0.01, 0.01, 0.01))
    change = _pose_of(best.x)
    given_mm, fitted_mm = (
        1000 * np.sqrt((found.reshape(len(flanges), 4, 3) ** 2).sum(axis=2).mean(axis=1))
        for found in (away_m(np.zeros(6)), best.fun)
    )
    return HandEyeCheck(
        distance_mm=given_mm,
        fitted=flange_from_camera @ change,
        fitted_mm=fitted_mm,
        off_mm=1000 * float(np.linalg.norm(change[:3, 3])),
        off_rad=float(np.linalg.norm(best.x[:3])),
    )


def _check_poses(base_from_flange: Sequence[Float[np.ndarray, "4 4"]]) -> None:
    if len(base_from_flange) < FEWEST_PICTURES:
        raise CalibrationError(
            f"{len(base_from_flange)} pictures say too little of hand-eye, and {FEWEST_PICTURES} "
            "are needed",
            "Take a dozen from all around the board, near and far",
        )
    first = invert(base_from_flange[0])
    turns = [Rotation.from_matrix((first @ pose)[:3, :3]).as_rotvec() for pose in base_from_flange]
    far = [turn for turn in turns if np.linalg.norm(turn) >= LEAST_TURN_RAD]
    axes = np.array([turn / np.linalg.norm(turn) for turn in far]).reshape(-1, 3)
    between = np.arccos(np.clip(np.abs(axes @ axes.T), 0, 1)).max(initial=0.0)
    if between < LEAST_BETWEEN_AXES_RAD:
        raise CalibrationError(
            "the arm turned about one axis only, or by less than 10 degrees, between the pictures",
            "Tilt the camera to all sides: pure shifts do not tell hand-eye",
        )


def _pose_of(changed: Float[np.ndarray, " 6"]) -> Float[np.ndarray, "4 4"]:
    """Rotation vector [rad] and translation [m] as a pose."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(changed[:3]).as_matrix()
    pose[:3, 3] = changed[3:]
    return pose


def read_grey(path: Path) -> UInt8[np.ndarray, "h w"]:
    """A picture's grey levels. Raises CalibrationError where the file is none."""
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if picture is None:
        raise CalibrationError(f"{path} cannot be read as a picture", "Give PNG or JPEG files")
    return np.asarray(picture)
