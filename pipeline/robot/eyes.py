"""A driver's cameras, as its calibration describes them, as the policy's `Eyes`."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.control.cloud import DepthPicture
from pipeline.errors import CalibrationError
from pipeline.geometry.transforms import invert, transform_points
from pipeline.robot.calibration import Calibration
from pipeline.robot.driver import Driver
from pipeline.sensing.depth_by_rays import window_around
from pipeline.world.cameras import PinholeCamera, points_of_depth

_AT_HOME_M = 0.01  # the arm is out of sight where the pad is this near to home


class DrivenEyes:
    """The cell's cameras as `pipeline.control.robot.Eyes`; the gripper itself is cut out."""

    def __init__(self, driver: Driver, calibration: Calibration, config: RunConfig) -> None:
        """Take no picture yet.

        Parameters
        ----------
        driver
            Takes the pictures.
        calibration
            The cameras.
        config
            Size of pad and hand, which are cut out of the wrist's picture.
        """
        self._driver = driver
        self._calibration = calibration
        self._config = config
        self._from_home: list[DepthPicture] = []

    def static(self) -> list[DepthPicture] | None:
        """One picture of every camera beside the table, the arm out of their sight.

        Away from home the arm would be seen as something to grip, so the last pictures that were
        taken with the arm at home are given again.
        """
        here = self._calibration.world_from_gripper(self._driver.base_from_flange())
        away_m = np.linalg.norm(here[:3, 3] - self._calibration.home[:3, 3])
        if away_m > _AT_HOME_M and self._from_home:
            return self._from_home
        depths = self._driver.static_depths_m()
        if depths is None:
            return None
        cameras = self._calibration.static
        if len(depths) != len(cameras):
            raise CalibrationError(
                f"the driver gives {len(depths)} static pictures, and {len(cameras)} cameras are "
                "calibrated",
                "Give one of each camera, in the order of static_cameras",
            )
        self._from_home = [
            DepthPicture(in_range(depth, camera), camera)
            for depth, camera in zip(depths, cameras, strict=True)
        ]
        return self._from_home

    def wrist_camera(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> PinholeCamera:
        """The wrist's camera as it is calibrated, for the gripper at a pose."""
        held = self._calibration
        world_from_flange = world_from_gripper @ invert(held.flange_from_gripper)
        return replace(held.wrist, world_from_camera=world_from_flange @ held.flange_from_camera)

    def wrist(self, around_m: Float[np.ndarray, " 3"], radius_m: float) -> DepthPicture | None:
        """The part of the wrist camera's picture that shows a ball in WCS.

        Parameters
        ----------
        around_m
            Its centre [m], shape (3,).
        radius_m
            Its radius [m].

        Returns
        -------
        The picture, with a camera that describes this part only; None where the camera stopped.
        """
        depth_m = self._driver.wrist_depth_m()
        if depth_m is None:
            return None
        pose = self._calibration.world_from_gripper(self._driver.base_from_flange())
        whole = self.wrist_camera(pose)
        part = window_around(whole, around_m, radius_m)
        left, top = np.round(whole.intrinsics[:2, 2] - part.intrinsics[:2, 2]).astype(int)
        shown = in_range(depth_m, whole)[top : top + part.height_px, left : left + part.width_px]
        return DepthPicture(self._without_gripper(shown, part, pose), part)

    def _without_gripper(
        self,
        depth_m: Float[np.ndarray, "h w"],
        camera: PinholeCamera,
        pose: Float[np.ndarray, "4 4"],
    ) -> Float[np.ndarray, "h w"]:
        """The picture without what lies where pad and hand are: a cylinder behind the pad."""
        points, rows, columns = points_of_depth(depth_m, camera, every=1)
        own = transform_points(invert(pose), points)
        hand = self._config.evaluate.hand
        radius_m = self._config.gripper.pad.radius_m + hand.margin_m
        inside = (np.hypot(own[:, 0], own[:, 1]) < radius_m) & (own[:, 2] > hand.margin_m)
        kept = depth_m.copy()
        kept[rows[inside], columns[inside]] = 0.0
        return kept


def in_range(depth_m: Float[np.ndarray, "h w"], camera: PinholeCamera) -> Float[np.ndarray, "h w"]:
    """A depth picture without what its camera cannot measure, NaN included.

    Parameters
    ----------
    depth_m
        Depth along the camera's z [m], shape (h, w).
    camera
        Its size and range.

    Returns
    -------
    The same, 0 where nothing was measured.

    Raises
    ------
    CalibrationError
        The picture is of another size than its camera, or looks like millimetres.
    """
    if depth_m.shape != (camera.height_px, camera.width_px):
        raise CalibrationError(
            f"{camera.name}: the driver's picture is {depth_m.shape[1]} by {depth_m.shape[0]} "
            f"pixels, and the calibrated one {camera.width_px} by {camera.height_px}",
            "Calibrate the stream that the driver gives",
        )
    measured = np.isfinite(depth_m) & (depth_m > 0)
    kept = measured & (depth_m >= camera.near_m) & (depth_m <= camera.far_m)
    if measured.any() and not kept.any():
        raise CalibrationError(
            f"{camera.name}: the nearest depth is {depth_m[measured].min():g} m and the farthest "
            f"{depth_m[measured].max():g} m, all out of its range of {camera.near_m:g} to "
            f"{camera.far_m:g} m",
            "Give depth in metres: drivers often give millimetres",
        )
    return np.where(kept, depth_m, 0.0)
