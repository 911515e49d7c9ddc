"""Point clouds are read in metres, and become the picture a camera would have taken of them."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from pypcd4 import PointCloud

from pipeline.camera.cloud_files import read_cloud_m
from pipeline.camera.frame import frame_of_cloud
from pipeline.errors import PictureError
from pipeline.world.cameras import points_of_depth

POINTS = np.random.default_rng(0).uniform((-0.2, -0.2, 0.6), (0.2, 0.2, 0.8), (500, 3))


def written(path: Path, points: np.ndarray) -> Path:
    if path.suffix == ".npy":
        np.save(path, points)
    elif path.suffix == ".pcd":
        PointCloud.from_xyz_points(points.astype(np.float32)).save(str(path))
    else:
        trimesh.PointCloud(points).export(path)
    return path


@pytest.mark.parametrize("name", ["c.ply", "c.pcd", "c.npy"])
def test_every_format_gives_the_same_points(tmp_path: Path, name: str) -> None:
    points = read_cloud_m(written(tmp_path / name, POINTS), None)
    assert points == pytest.approx(POINTS, abs=1e-6)


def test_what_was_not_measured_is_left_out(tmp_path: Path) -> None:
    points = np.vstack([POINTS, np.full((7, 3), np.nan), np.zeros((5, 3))])
    assert len(read_cloud_m(written(tmp_path / "c.npy", points), None)) == len(POINTS)


@pytest.mark.parametrize(
    ("points", "says"),
    [
        (1e3 * POINTS, "the unit is wrong"),
        (POINTS[:20], "20 measured points"),
        (POINTS[0], "shape"),
    ],
)
def test_what_is_no_cloud_is_refused(tmp_path: Path, points: np.ndarray, says: str) -> None:
    path = written(tmp_path / "c.npy", points)
    with pytest.raises(PictureError, match=says) as told:
        read_cloud_m(path, None)
    assert str(path) in str(told.value)


@pytest.mark.parametrize("name", ["c.ply", "c.pcd", "c.npy"])
def test_a_damaged_file_is_named(tmp_path: Path, name: str) -> None:
    path = written(tmp_path / name, POINTS)
    path.write_bytes(path.read_bytes()[:60])
    with pytest.raises(PictureError, match=name):
        read_cloud_m(path, None)


def test_the_picture_of_a_cloud_shows_its_points() -> None:
    side = np.linspace(-0.2, 0.2, 120)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    plane = np.stack([x, y, 0.7 + 0.2 * x], axis=1)
    frame = frame_of_cloud("plane", plane, None)
    points, _, _ = points_of_depth(frame.depth_m, frame.camera, 1)
    assert len(points) > 0.5 * len(plane)
    # A pixel stands for what is within it: half its width times the plane's slope.
    assert np.abs(points[:, 2] - 0.7 - 0.2 * points[:, 0]).max() < 2e-3


def test_a_cloud_behind_the_camera_is_refused() -> None:
    with pytest.raises(PictureError, match="behind the camera"):
        frame_of_cloud("c", POINTS * (1, 1, -1), None)
