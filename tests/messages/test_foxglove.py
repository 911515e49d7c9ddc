"""Cameras as messages have the pixel centres of ROS, by OpenCV's projection."""

import cv2
import numpy as np
import pytest
import trimesh

from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import invert
from pipeline.messages.foxglove import camera_calibration
from pipeline.world.cameras import PIXEL_CENTRE_PX
from tests.camera.scenes import seen

BALLS_M = ((0.06, -0.03, 0.05), (-0.11, 0.04, 0.02), (0.02, 0.09, 0.08))


@pytest.mark.parametrize("at", BALLS_M)
def test_a_ball_lies_on_the_pixels_where_ros_projects_it(at: tuple[float, float, float]) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.012)
    ball.apply_translation(at)
    frame = seen(
        [Mesh(np.asarray(ball.vertices), np.asarray(ball.faces))], (0.02, -0.4, 0.5), 0, True
    )
    rows, columns = np.nonzero(frame.depth_m)
    assert len(rows) > 50
    message = camera_calibration(frame.camera, 0)
    world_in_camera = invert(frame.camera.world_from_camera)
    turn, _ = cv2.Rodrigues(world_in_camera[:3, :3])
    k = np.array(message.K).reshape(3, 3)
    found, _ = cv2.projectPoints(np.array([at]), turn, world_in_camera[:3, 3], k, None)
    middle = np.array([columns.mean(), rows.mean()])
    assert found.ravel() == pytest.approx(middle, abs=PIXEL_CENTRE_PX / 3)
    # The projection matrix of the message says the same.
    ahead = np.append(world_in_camera[:3, :3] @ at + world_in_camera[:3, 3], 1.0)
    u, v, w = np.array(message.P).reshape(3, 4) @ ahead
    assert (u / w, v / w) == pytest.approx(found.ravel())
