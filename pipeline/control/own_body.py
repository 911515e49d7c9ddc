"""The gripper's own body: cut out of a picture before it is taken for an object."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from pipeline.compiled_code import njit
from pipeline.config.evaluation import HandConfig
from pipeline.config.grasps import PadConfig
from pipeline.control.cloud import DepthPicture
from pipeline.world.cameras import pixel_slopes


def cut_gripper_out(
    picture: DepthPicture,
    world_from_gripper: Float[np.ndarray, "4 4"],
    hand: HandConfig,
    pad: PadConfig,
    margin_m: float,
) -> DepthPicture:
    """The picture without what it measured of the pad and the stem.

    Parameters
    ----------
    picture
        Depth image with its camera as calibrated.
    world_from_gripper
        Pose of the gripper at its exposure, shape (4, 4).
    hand
        The stem: its radius, where it begins and ends.
    pad
        The pad: its radius and altitude.
    margin_m
        What is measured this near to the body is taken for it too [m].

    Returns
    -------
    The picture, with depth 0 (not measured) there.
    """
    # Pad and stem are cylinders on the gripper's axis: radius, lower and upper end.
    parts = np.array(
        [
            [pad.radius_m, 0.0, pad.altitude_m],
            [hand.stem_radius_m, pad.altitude_m, hand.length_m],
        ]
    )
    parts += [margin_m, -margin_m, margin_m]
    x, y = pixel_slopes(picture.camera.intrinsics, picture.depth_m.shape)
    gripper_from_camera = np.linalg.solve(world_from_gripper, picture.camera.world_from_camera)
    depth_m = _cut(np.asarray(picture.depth_m, np.float64), x, y, gripper_from_camera, parts)
    return replace(picture, depth_m=depth_m)


@njit()
def _cut(
    depth: Float[np.ndarray, "h w"],
    x: Float[np.ndarray, " w"],
    y: Float[np.ndarray, " h"],
    pose: Float[np.ndarray, "4 4"],
    parts: Float[np.ndarray, "parts 3"],
) -> Float[np.ndarray, "h w"]:
    left = depth.copy()
    for row in range(len(y)):
        for column in range(len(x)):
            z, u, v = depth[row, column], x[column], y[row]
            if not z > 0.0:
                continue
            along = z * (pose[2, 0] * u + pose[2, 1] * v + pose[2, 2]) + pose[2, 3]
            aside_x = z * (pose[0, 0] * u + pose[0, 1] * v + pose[0, 2]) + pose[0, 3]
            aside_y = z * (pose[1, 0] * u + pose[1, 1] * v + pose[1, 2]) + pose[1, 3]
            for part in range(len(parts)):
                if (
                    parts[part, 1] < along < parts[part, 2]
                    and aside_x * aside_x + aside_y * aside_y < parts[part, 0] ** 2
                ):
                    left[row, column] = 0.0
                    break
    return left
