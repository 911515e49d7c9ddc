"""What must be known of a cell before its first attempt, from one JSON file."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from pipeline.camera.camera_files import RIGID_TOLERANCE, camera_of
from pipeline.camera.frame import camera_of_picture
from pipeline.errors import CalibrationError
from pipeline.read_only import read_only
from pipeline.world.cameras import PinholeCamera

# A pad, flange or camera is nearer to its neighbour than this, a table nearer to the arm's base.
FARTHEST_HAND_M, FARTHEST_BASE_M = 1.0, 5.0
HEAVIEST_HAND_KG = 20.0  # of what an arm with a suction gripper carries


@dataclass(frozen=True, eq=False)
class Calibration:
    """How the parts of a cell lie to each other, and what its sensors read at nothing.

    Attributes
    ----------
    world_from_base
        The arm's base in WCS: z is up and z = 0 is the table, shape (4, 4).
    flange_from_gripper
        GCS at the flange, the tool centre point: origin at the pad's centre where it first
        touches, +z from the pad to the flange, shape (4, 4).
    flange_from_camera
        CCS of the wrist's camera at the flange (hand-eye), shape (4, 4).
    wrist
        The wrist's camera, its pose left open.
    static
        The cameras beside the table, with their poses in WCS.
    hand_mass_kg
        Mass of all that hangs on the wrench's sensor [kg].
    hand_centre_m
        Its centre of mass in the flange's frame [m], shape (3,).
    vacuum_open_pa
        What the pressure sensor reads while the pad draws free air [Pa].
    vacuum_closed_pa
        And while the pad is closed on a smooth plate [Pa]; NaN: there is no sensor.
    home
        world_from_gripper of the pad where it waits, out of the static cameras' sight.
    drop
        world_from_gripper of the pad where lifted objects are let go.
    """

    world_from_base: Float[np.ndarray, "4 4"]
    flange_from_gripper: Float[np.ndarray, "4 4"]
    flange_from_camera: Float[np.ndarray, "4 4"]
    wrist: PinholeCamera
    static: tuple[PinholeCamera, ...]
    hand_mass_kg: float
    hand_centre_m: Float[np.ndarray, " 3"]
    vacuum_open_pa: float
    vacuum_closed_pa: float
    home: Float[np.ndarray, "4 4"]
    drop: Float[np.ndarray, "4 4"]

    def __post_init__(self) -> None:
        for name in (
            "world_from_base",
            "flange_from_gripper",
            "flange_from_camera",
            "hand_centre_m",
            "home",
            "drop",
        ):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    def world_from_gripper(
        self, base_from_flange: Float[np.ndarray, "4 4"]
    ) -> Float[np.ndarray, "4 4"]:
        """Where the pad is in WCS, for the flange at a pose."""
        return np.asarray(self.world_from_base @ base_from_flange @ self.flange_from_gripper)

    def pressure(self, vacuum_pa: float) -> float:
        """A reading of the sensor over that of a closed pad, in [0, 1]; NaN without a sensor."""
        span = self.vacuum_closed_pa - self.vacuum_open_pa
        return float(np.clip((vacuum_pa - self.vacuum_open_pa) / span, 0.0, 1.0))


def read_calibration(path: Path) -> Calibration:
    """Read a cell's calibration.

    Parameters
    ----------
    path
        JSON as ``runs/robot/calibration.json`` shows it. Cameras are given in any layout of
        `pipeline.camera.camera_files`, with ``width`` and ``height``.

    Returns
    -------
    The calibration.

    Raises
    ------
    CalibrationError
        The file cannot be read, lacks something, or says something impossible; one sentence.
    PictureError
        A camera in it has no intrinsics, or those of a lens with distortion.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as error:
        raise CalibrationError(f"{path} cannot be read as JSON: {error}", "Mend it") from error
    if not isinstance(content, Mapping):
        raise CalibrationError(f"{path} holds no object of named values", "Mend it")
    static = _listed(content, "static_cameras", path)
    open_pa, closed_pa = (
        _number(content, name, path, math.nan) for name in ("vacuum_open_pa", "vacuum_closed_pa")
    )
    if closed_pa <= open_pa:
        raise CalibrationError(
            f"{path}: a closed pad reads {closed_pa:g} Pa and an open one {open_pa:g}, and the "
            "vacuum of a closed pad is the larger",
            "Give both as pressure under that of the air, in Pa",
        )
    mass_kg = _number(content, "hand_mass_kg", path)
    if not 0 <= mass_kg <= HEAVIEST_HAND_KG:
        raise CalibrationError(
            f"{path}: hand_mass_kg is {mass_kg:g}, and 0 to {HEAVIEST_HAND_KG:g} kg hang on a "
            "flange",
            "Weigh gripper and camera, in kg",
        )
    return Calibration(
        world_from_base=_pose(content, "world_from_base", path, FARTHEST_BASE_M),
        flange_from_gripper=_pose(content, "flange_from_gripper", path, FARTHEST_HAND_M),
        flange_from_camera=_pose(content, "flange_from_camera", path, FARTHEST_HAND_M),
        wrist=_camera(content.get("wrist_camera"), "wrist", path),
        static=tuple(
            _camera(one, f"static_{number}", path, posed=True) for number, one in enumerate(static)
        ),
        hand_mass_kg=mass_kg,
        hand_centre_m=_vector(content, "hand_centre_m", path),
        vacuum_open_pa=open_pa,
        vacuum_closed_pa=closed_pa,
        home=_above(content, "home_m", path),
        drop=_above(content, "drop_m", path),
    )


def _camera(content: Any, name: str, path: Path, posed: bool = False) -> PinholeCamera:
    where = f"{path}, {name}"
    if not isinstance(content, Mapping):
        raise CalibrationError(f"{where}: there is no camera", "Give its intrinsics and size")
    found = camera_of(content, where)
    if found.size_px is None:
        raise CalibrationError(f"{where} has no width and height", "Give them in pixels")
    if posed and found.world_from_camera is None:
        raise CalibrationError(
            f"{where} has no pose", "Give world_from_camera: the table's z is up and 0"
        )
    pose = np.eye(4) if found.world_from_camera is None else found.world_from_camera
    camera = camera_of_picture(name, found.size_px[::-1], found.intrinsics, pose)
    near_m, far_m = (_number(content, key, path) for key in ("near_m", "far_m"))
    if not 0 <= near_m < far_m:
        raise CalibrationError(
            f"{where} measures from {near_m:g} to {far_m:g} m", "Give near_m and far_m in metres"
        )
    return replace(camera, near_m=near_m, far_m=far_m)


def _pose(
    content: Mapping[str, Any], name: str, path: Path, farthest_m: float
) -> Float[np.ndarray, "4 4"]:
    pose = _numbers(content, name, path, (4, 4))
    turn = pose[:3, :3]
    rigid = np.allclose(turn @ turn.T, np.eye(3), atol=RIGID_TOLERANCE)
    if not rigid or np.linalg.det(turn) < 0 or not np.allclose(pose[3], (0, 0, 0, 1)):
        raise CalibrationError(
            f"{path}: {name} is no rotation with a translation",
            "Give a rigid 4x4 pose, without scale or mirroring",
        )
    far_m = float(np.linalg.norm(pose[:3, 3]))
    if far_m > farthest_m:
        raise CalibrationError(
            f"{path}: {name} lies {far_m:g} m away, and no cell has more than {farthest_m:g} m "
            "there",
            "Give it in metres, not millimetres",
        )
    left, _, right = np.linalg.svd(turn)
    pose[:3, :3] = left @ right
    return pose


def _above(content: Mapping[str, Any], name: str, path: Path) -> Float[np.ndarray, "4 4"]:
    """The pad facing straight down at a place in WCS above the table."""
    place = _vector(content, name, path)
    if not 0 < place[2] <= FARTHEST_BASE_M:
        raise CalibrationError(
            f"{path}: {name} lies {place[2]:g} m above the table", "Give it in WCS, in metres"
        )
    pose = np.eye(4)
    pose[:3, 3] = place
    return pose


def _vector(content: Mapping[str, Any], name: str, path: Path) -> Float[np.ndarray, " 3"]:
    return _numbers(content, name, path, (3,))


def _numbers(
    content: Mapping[str, Any], name: str, path: Path, shape: tuple[int, ...]
) -> Float[np.ndarray, "..."]:
    size = " by ".join(map(str, shape))
    if content.get(name) is None:
        raise CalibrationError(f"{path} does not say {name}", f"Give {size} numbers")
    try:
        numbers = np.array(content[name], dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise CalibrationError(f"{path}: {name} is not made of numbers", "Mend it") from error
    if numbers.shape != shape or not np.isfinite(numbers).all():
        raise CalibrationError(
            f"{path}: {name} is not {size} finite numbers", "Mend it: poses are 4 rows of 4"
        )
    return numbers


def _number(
    content: Mapping[str, Any], name: str, path: Path, absent: float | None = None
) -> float:
    value = content.get(name)
    if value is None and absent is not None:
        return absent
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise CalibrationError(f"{path} does not say {name}", "Give one finite number")
    return float(value)


def _listed(content: Mapping[str, Any], name: str, path: Path) -> list[Any]:
    found = content.get(name)
    if not isinstance(found, list) or not found:
        raise CalibrationError(
            f"{path} names no {name}", "Give at least one camera beside the table"
        )
    return found
