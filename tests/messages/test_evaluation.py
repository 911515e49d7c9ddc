"""Pictures that an attempt keeps lie where the camera's whole picture has them."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.artifacts import from_tensor
from pipeline.control.attempts import SeenPicture
from pipeline.control.cloud import DepthPicture
from pipeline.messages.evaluation import seen_message
from pipeline.world.cameras import pixel_slopes
from tests.camera.scenes import box, seen, table


@pytest.mark.parametrize("every", [1, 2, 3])
@pytest.mark.parametrize(("left", "top"), [(0, 0), (31, 46), (32, 45)])
def test_a_part_of_a_picture_is_thinned_as_the_whole(every: int, left: int, top: int) -> None:
    frame = seen([table(), box((0.1, 0.1, 0.1), (0, 0, 0.05))], (0.02, -0.4, 0.5), 0.0, posed=True)
    whole, depth = frame.camera, frame.depth_m
    k = whole.intrinsics.copy()
    k[:2, 2] -= (left, top)
    part = replace(whole, width_px=101, height_px=88, intrinsics=k)
    picture = DepthPicture(depth[top : top + 88, left : left + 101], part)
    message = seen_message(SeenPicture(7, picture, whole), every)
    thin = np.round(1000 * depth[::every, ::every])
    assert (message.whole_height_px, message.whole_width_px) == thin.shape
    kept = from_tensor(message.depth_mm)
    rows = slice(message.top_px, message.top_px + kept.shape[0])
    columns = slice(message.left_px, message.left_px + kept.shape[1])
    assert kept.size > 0.9 * 101 * 88 / every**2
    assert (kept == thin[rows, columns]).all()
    assert message.step == 7
    # Every kept pixel has the ray that it had in the whole picture.
    x, y = pixel_slopes(from_tensor(message.intrinsics), kept.shape)
    all_x, all_y = pixel_slopes(whole.intrinsics, depth.shape)
    assert x == pytest.approx(all_x[::every][columns])
    assert y == pytest.approx(all_y[::every][rows])
