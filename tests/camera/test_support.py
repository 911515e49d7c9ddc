"""The support under objects, and the walls around them, of scenes whose truth is known."""

import numpy as np
import pytest

from pipeline.camera.frame import Frame
from pipeline.camera.support import Support, inside, stands_out
from pipeline.camera.support_search import UP_IN_CAMERA, find_support
from pipeline.config import RunConfig
from pipeline.errors import PictureError
from pipeline.geometry.transforms import invert, look_at, transform_points
from pipeline.world.cameras import points_of_depth
from tests.camera.scenes import bin_walls, box, rounded_bin, seen, table

SETTINGS = RunConfig().predict.support
ABOVE = (0.05, -0.45, 0.6)
LOOKED_AT = np.array([0.0, 0.0, 0.02])  # by every camera of tests.camera.scenes
FROM_THE_SIDE = (0.1, -0.8, 0.35)
OBJECTS = [
    box((0.10, 0.06, 0.08), (0.05, 0.05, 0.04)),
    box((0.06, 0.06, 0.12), (-0.1, -0.02, 0.06)),
]


def support_of(frame: Frame) -> Support:
    points, _, _ = points_of_depth(frame.depth_m, frame.camera, 2)
    pose = frame.camera.world_from_camera
    return find_support(
        points,
        np.broadcast_to(pose[:3, 3], points.shape),
        np.broadcast_to(pose[:3, 2], points.shape),
        np.array([0.0, 0.0, 1.0]) if frame.posed else UP_IN_CAMERA,
        frame.posed,
        SETTINGS,
        np.random.default_rng(0),
    )


@pytest.mark.parametrize("eye", [ABOVE, FROM_THE_SIDE])
@pytest.mark.parametrize("noise", [0.0, 0.003])
def test_the_table_is_found_where_it_is(eye: tuple[float, float, float], noise: float) -> None:
    found = support_of(seen([table(), *OBJECTS], eye, noise, posed=True))
    assert found.world_from_support[:3, 2] == pytest.approx((0, 0, 1), abs=0.02)
    assert abs(found.world_from_support[2, 3]) < 0.004
    assert not found.walls


@pytest.mark.parametrize("eye", [ABOVE, FROM_THE_SIDE])
def test_without_a_pose_up_is_found_from_the_picture(eye: tuple[float, float, float]) -> None:
    found = support_of(seen([table(), *OBJECTS], eye, 0.002, posed=False))
    up_in_camera = look_at(np.array(eye), np.array([0.0, 0.0, 0.02]))[:3, :3].T @ (0.0, 0.0, 1.0)
    assert found.world_from_support[:3, 2] == pytest.approx(up_in_camera, abs=0.02)


def test_bin_walls_are_found_and_what_lies_beyond_them_is_out() -> None:
    outside = box((0.08, 0.08, 0.10), (0.36, 0.1, 0.05))
    scene = [table(), *bin_walls(), *OBJECTS, outside]
    frame = seen(scene, (0.0, -0.1, 0.8), 0.002, posed=True)
    found = support_of(frame)
    assert len(found.walls) >= 2
    points, _, _ = points_of_depth(frame.depth_m, frame.camera, 2)
    local = transform_points(invert(found.world_from_support), points)
    high = local[:, 2] > 0.02
    kept = points[high & inside(found, local, SETTINGS)]
    assert len(kept) > 200
    assert (np.abs(kept[:, :2]) < 0.21).all()


def test_the_face_of_a_box_is_no_wall() -> None:
    large = box((0.25, 0.10, 0.25), (0.0, 0.2, 0.125))
    assert not support_of(seen([table(), large], FROM_THE_SIDE, 0.002, posed=True)).walls


def test_an_upright_plane_is_no_support() -> None:
    wall = box((2.0, 0.02, 2.0), (0.0, 0.5, 0.0))
    with pytest.raises(PictureError, match=r"no table or bin floor was found: of 1 planes none"):
        support_of(seen([wall], (0.0, -0.3, 0.0), 0.001, posed=True))


def test_a_plane_with_much_below_it_is_no_support() -> None:
    shelf = box((0.3, 0.25, 0.01), (0.0, 0.0, 0.3))
    found = support_of(seen([table(), shelf], (0.0, -0.5, 1.0), 0.001, posed=True))
    assert abs(found.world_from_support[2, 3]) < 0.004


@pytest.mark.parametrize("eye", [(0.0, -0.1, 0.8), (0.05, -0.45, 0.65)])
@pytest.mark.parametrize("posed", [True, False])
def test_a_bins_rounded_foot_is_no_object(eye: tuple[float, float, float], posed: bool) -> None:
    bodies = [rounded_bin(), box((0.06, 0.06, 0.04), (0.155, 0.1, 0.02))]
    frame = seen(bodies, eye, 0.002, posed)
    found = support_of(frame)
    to_support = invert(found.world_from_support)
    points, _, _ = points_of_depth(frame.depth_m, frame.camera, 1)
    eyes = np.broadcast_to(frame.camera.world_from_camera[:3, 3], points.shape)
    chosen = stands_out(
        found,
        transform_points(to_support, points),
        transform_points(to_support, eyes),
        RunConfig().predict,
    )
    world = points if posed else transform_points(look_at(np.array(eye), LOOKED_AT), points)
    on_box = (np.abs(world[:, 0] - 0.155) < 0.033) & (np.abs(world[:, 1] - 0.1) < 0.033)
    assert chosen[on_box & (world[:, 2] > 0.034)].mean() > 0.9
    assert chosen[~on_box].mean() < 0.0005
