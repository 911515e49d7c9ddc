"""Depth is metric, both renderers agree, and the grid lies as it says."""

import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy import ndimage

from pipeline.clutter.scene import ClutterScene, PlacedObject
from pipeline.config import CameraConfig, ObjectsConfig, ScenesConfig, SensingConfig
from pipeline.config.grasps import Noise
from pipeline.errors import MachineError
from pipeline.geometry.catalogue import CatalogueObject, MeasuredObject, finish_object
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.mesh_files import MeshSource
from pipeline.geometry.shape import nsvr, shape_class
from pipeline.sensing.cameras import cameras_of, points_of_depth
from pipeline.sensing.depth_noise import NOISE_MODELS, disturb, incidence_rad
from pipeline.sensing.rendering import RayRenderer
from pipeline.sensing.sapien_rendering import SapienRenderer
from pipeline.sensing.sub_cloud import sub_clouds
from pipeline.sensing.view import CameraView

CAMERAS = cameras_of(CameraConfig())


def made_object(name: str, shape: trimesh.Trimesh, cache: object) -> CatalogueObject:
    mesh = Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))
    source = MeshSource(name, name, "none", mesh, "m", "declared")
    value = nsvr(mesh)
    measured = MeasuredObject(source, mesh, (), value, shape_class(value))
    config = ObjectsConfig(target_extent_min_m=0.1, target_extent_max_m=0.1)
    return finish_object(measured, config, np.random.default_rng(0), cache)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, CatalogueObject]:
    """A cube and a ball, 100 mm each."""
    cache = tmp_path_factory.mktemp("parts")
    ball = trimesh.creation.icosphere(subdivisions=5)
    return {
        "cube": made_object("cube", trimesh.creation.box(), cache),
        "ball": made_object("ball", ball, cache),
    }


def scene_of(*placed: PlacedObject) -> ClutterScene:
    return ClutterScene("s", 1, "train", 0, placed, np.full(len(placed), np.inf), (), 0.0, ())


def at(x: float, y: float, z: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


@pytest.fixture(scope="module")
def view(objects: Mapping[str, CatalogueObject]) -> CameraView:
    """Cube and ball seen by rays."""
    scene = scene_of(
        PlacedObject("cube", 1, at(-0.1, 0, 0.05)), PlacedObject("ball", 2, at(0.1, 0, 0.05))
    )
    return RayRenderer(ScenesConfig(), CAMERAS).rendered(scene, objects).views[0]


def test_depth_puts_every_pixel_on_its_surface(view: CameraView) -> None:
    points, rows, columns = points_of_depth(view.depth_m, view.camera, 1)
    body = view.segmentation[rows, columns]
    assert (body == 0).any()
    np.testing.assert_allclose(points[body == 0, 2], 0.0, atol=1e-4)
    outside_cube = np.abs(points[body == 1] - [-0.1, 0, 0.05]).max(axis=1) - 0.05
    np.testing.assert_allclose(outside_cube, 0.0, atol=1e-4)
    radius = np.linalg.norm(points[body == 2] - [0.1, 0, 0.05], axis=1)
    np.testing.assert_allclose(radius, 0.05, atol=1e-4)


def test_sapien_and_rays_agree(view: CameraView, objects: Mapping[str, CatalogueObject]) -> None:
    try:
        renderer = SapienRenderer(ScenesConfig(), CAMERAS)
    except MachineError as error:
        pytest.skip(f"no Vulkan driver: {error}")
    scene = scene_of(
        PlacedObject("cube", 1, at(-0.1, 0, 0.05)), PlacedObject("ball", 2, at(0.1, 0, 0.05))
    )
    one, two = (renderer.rendered(scene, objects).views[0] for _ in range(2))
    assert one.depth_m.tobytes() == two.depth_m.tobytes()
    # Lit: no pixel of the ball or the table is black.
    assert one.colour.max(axis=2)[one.depth_m > 0].min() > 20
    same = one.segmentation == view.segmentation
    assert same.mean() > 0.999
    assert (np.abs(one.depth_m - view.depth_m)[same] < 1e-4).mean() > 0.999


def test_noise_has_its_spread_and_its_seed(view: CameraView) -> None:
    noisy = disturb(view, SensingConfig(), np.random.default_rng(3))
    again = disturb(view, SensingConfig(), np.random.default_rng(3))
    assert noisy.tobytes() == again.tobytes()
    table = (view.segmentation == 0) & (noisy > 0)
    error = (noisy - view.depth_m)[table]
    # 0.8 mm + 0.7 mm/m at 0.9 m, over cosines between 0.8 and 1.
    assert 0.0012 < error.std() < 0.0022
    assert abs(error.mean()) < 1e-4


@pytest.mark.parametrize("noise", sorted(NOISE_MODELS))
def test_every_sensor_has_its_published_spread(noise: Noise, view: CameraView) -> None:
    """In units of the model's own spread at each pixel, the error is standard normal."""
    model = NOISE_MODELS[noise]
    noisy = disturb(view, SensingConfig(noise=noise), np.random.default_rng(5))
    depth = view.depth_m.astype(np.float64)
    flat = (view.segmentation == 0) & (noisy > 0)
    sigma = model.floor_m + model.linear * depth + model.quadratic_1_m * (depth - 0.4) ** 2
    units = ((noisy - depth) * np.cos(incidence_rad(view)) / sigma)[flat]
    assert units.std() == pytest.approx(1.0, abs=0.02)
    assert units.mean() == pytest.approx(0.0, abs=0.02)


def test_published_spreads_at_their_distances() -> None:
    lidar, light = NOISE_MODELS["lidar"], NOISE_MODELS["structured-light"]
    assert lidar.floor_m + lidar.linear * 1.0 == pytest.approx(0.0025)
    assert lidar.floor_m + lidar.linear * 9.0 == pytest.approx(0.0155)
    assert light.floor_m + light.quadratic_1_m * (1.4 - 0.4) ** 2 == pytest.approx(0.0031)


@pytest.mark.parametrize("noise", sorted(NOISE_MODELS))
def test_no_sensor_sees_at_grazing_incidence(noise: Noise, view: CameraView) -> None:
    noisy = disturb(view, SensingConfig(noise=noise), np.random.default_rng(5))
    grazing = incidence_rad(view) > NOISE_MODELS[noise].grazing_rad
    assert grazing.any()
    assert not noisy[grazing].any()
    assert (noisy[~grazing & (view.depth_m > 0)] > 0).mean() > 0.95


def test_incidence_on_the_table_is_the_angle_to_its_normal(view: CameraView) -> None:
    points, rows, columns = points_of_depth(view.depth_m, view.camera, 1)
    ray = points - view.camera.world_from_camera[:3, 3]
    expected = np.arccos(-ray[:, 2] / np.linalg.norm(ray, axis=1))
    found = incidence_rad(view)[rows, columns]
    table = ndimage.binary_erosion(view.segmentation == 0, iterations=3)[rows, columns]
    inner = table & (rows > 2) & (rows < 420) & (columns > 2) & (columns < 508)
    # The picture's own edge of the table is a step too.
    smooth = inner & (np.abs(points[:, :2]).max(axis=1) < 0.55)
    np.testing.assert_allclose(found[smooth], expected[smooth], atol=2e-3)


def test_no_noise_is_the_picture_itself(view: CameraView) -> None:
    clean = disturb(view, SensingConfig(noise="none"), np.random.default_rng(0))
    np.testing.assert_array_equal(clean, view.depth_m)


def test_grid_matches_a_plain_loop(view: CameraView) -> None:
    """The oracle sorts all points of the picture into cells, one grasp at a time."""
    config = SensingConfig()
    poses = np.stack([at(-0.1, 0.0, 0.1), at(0.1, 0.01, 0.1), at(-0.05, 0.0, 0.1)])
    cloud, seen = sub_clouds(view.depth_m, view.camera, poses, config, 0.025)
    points, _, _ = points_of_depth(view.depth_m.astype(np.float64), view.camera, 1)
    cells, half = config.grid_cells, config.grid_side_m / 2
    for index, pose in enumerate(poses):
        local = points - pose[:3, 3]
        local = local[np.abs(local[:, 2]) <= config.grid_depth_m]
        row = np.floor((local[:, 1] + half) / (2 * half) * cells).astype(int)
        column = np.floor((local[:, 0] + half) / (2 * half) * cells).astype(int)
        inside = (row >= 0) & (row < cells) & (column >= 0) & (column < cells)
        counts = np.zeros((cells, cells))
        np.add.at(counts, (row[inside], column[inside]), 1)
        sums = np.zeros((cells, cells, 3))
        np.add.at(sums, (row[inside], column[inside]), local[inside])
        np.testing.assert_array_equal(seen[index], counts > 0)
        mean = sums / np.maximum(counts, 1)[..., None] / 0.025
        np.testing.assert_allclose(cloud[index], mean, atol=1e-5)


def test_a_flat_top_is_seen_whole_and_a_blind_camera_sees_nothing(view: CameraView) -> None:
    cloud, seen = sub_clouds(
        view.depth_m, view.camera, at(-0.1, 0, 0.1)[None], SensingConfig(), 0.025
    )
    assert seen.mean() > 0.5
    np.testing.assert_allclose(cloud[seen][:, 2], 0.0, atol=1e-2)
    blind = replace(view, depth_m=np.zeros_like(view.depth_m))
    _, nothing = sub_clouds(blind.depth_m, view.camera, at(0, 0, 0.1)[None], SensingConfig(), 0.025)
    assert not nothing.any()


def test_pictures_are_lit_where_convex_parts_are_computed_too() -> None:
    """CoACD and SAPIEN share a process; the order in which they load must not turn it dark."""
    script = (
        "import coacd\n"
        "from pipeline.config import CameraConfig, ScenesConfig\n"
        "from pipeline.errors import MachineError\n"
        "from pipeline.sensing.cameras import cameras_of\n"
        "from pipeline.sensing.sapien_rendering import rendered_table\n"
        "try:\n"
        "    rendered_table(ScenesConfig(), cameras_of(CameraConfig())[0])\n"
        "except MachineError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert "coacd" in done.stdout
