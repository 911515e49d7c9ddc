"""Depth is metric, both renderers agree, and the grid lies as it says."""

import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy import ndimage

from pipeline.config import (
    CamerasConfig,
    DepthSensor,
    ObjectsConfig,
    ScenesConfig,
    SensingConfig,
    StaticCameraConfig,
    WristCameraConfig,
)
from pipeline.errors import MachineError
from pipeline.geometry.catalogue import CatalogueObject, MeasuredObject, finish_object
from pipeline.geometry.descriptor import describe
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.mesh_files import MeshSource
from pipeline.geometry.shape import nsvr, shape_class
from pipeline.geometry.transforms import invert, transform_points
from pipeline.sensing.depth_noise import NOISE_MODELS, cosine_of_incidence, disturb
from pipeline.sensing.ray_rendering import RayRenderer
from pipeline.sensing.rendering import Renderer, new_renderer, render_views
from pipeline.sensing.sapien_rendering import SapienRenderer
from pipeline.sensing.sub_cloud import merged_sub_clouds, sub_clouds
from pipeline.world.cameras import (
    camera_names,
    points_of_depth,
    scene_cameras,
    shown_whole,
    static_cameras,
    wrist_cameras,
)
from pipeline.world.scene import ClutterScene, PlacedObject
from pipeline.world.view import CameraView, normals_of

CAMERAS = static_cameras(StaticCameraConfig())


def made_object(name: str, shape: trimesh.Trimesh, cache: object) -> CatalogueObject:
    mesh = Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))
    source = MeshSource(name, name, "none", mesh, "m", "declared")
    value = nsvr(mesh)
    measured = MeasuredObject(source, mesh, (), value, shape_class(value), describe(mesh))
    config = ObjectsConfig(target_extent_min_rg=4, target_extent_max_rg=4, transparent=("glass*",))
    return finish_object(measured, config, np.random.default_rng(0), cache)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, CatalogueObject]:
    """A cube, a ball and a glass ball, 100 mm each."""
    cache = tmp_path_factory.mktemp("parts")
    ball = trimesh.creation.icosphere(subdivisions=5)
    return {
        "cube": made_object("cube", trimesh.creation.box(), cache),
        "ball": made_object("ball", ball, cache),
        "glass ball": made_object("glass ball", ball, cache),
    }


def scene_of(*placed: PlacedObject) -> ClutterScene:
    return ClutterScene("s", 1, "train", 0, placed, np.full(len(placed), np.inf), (), 0.0, ())


def at(x: float, y: float, z: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


CUBE_AND_BALL = scene_of(
    PlacedObject("cube", 1, at(-0.1, 0, 0.05)), PlacedObject("ball", 2, at(0.1, 0, 0.05))
)


@pytest.fixture(scope="module")
def view(objects: Mapping[str, CatalogueObject]) -> CameraView:
    """Cube and ball seen by rays."""
    renderer = RayRenderer(ScenesConfig())
    return render_views(CUBE_AND_BALL, objects, CAMERAS, renderer).views[0]


@pytest.fixture(scope="module")
def sapien_renderer() -> Renderer:
    try:
        return SapienRenderer(ScenesConfig())
    except MachineError as error:
        pytest.skip(f"no Vulkan driver: {error}")


def through(view: CameraView, sensor: DepthSensor) -> CameraView:
    """The same picture, taken through another sensor."""
    return replace(view, camera=replace(view.camera, sensor=sensor))


@pytest.mark.parametrize("renderer", ["embree", "sapien"])
def test_depth_puts_every_pixel_on_its_surface(
    renderer: str, view: CameraView, request: pytest.FixtureRequest
) -> None:
    """Plane, box and sphere as formulas; every pixel of Embree's, 99.9 % inside of SAPIEN's."""
    if renderer == "sapien":
        driver: Renderer = request.getfixturevalue("sapien_renderer")
        objects = request.getfixturevalue("objects")
        view = render_views(CUBE_AND_BALL, objects, CAMERAS, driver).views[0]
        inner = interior(view)
        view = replace(view, depth_m=np.where(inner, view.depth_m, 0.0))
    points, rows, columns = points_of_depth(view.depth_m, view.camera, 1)
    body = view.segmentation[rows, columns]
    assert (body == 0).any()
    np.testing.assert_allclose(points[body == 0, 2], 0.0, atol=1e-4)
    outside_cube = np.abs(points[body == 1] - [-0.1, 0, 0.05]).max(axis=1) - 0.05
    np.testing.assert_allclose(outside_cube, 0.0, atol=1e-4)
    radius = np.linalg.norm(points[body == 2] - [0.1, 0, 0.05], axis=1)
    np.testing.assert_allclose(radius, 0.05, atol=1e-4)


def interior(view: CameraView) -> np.ndarray:
    """Pixels whose eight neighbours lie on the same body, with no step in depth."""
    high = ndimage.maximum_filter(view.depth_m, 3) - ndimage.minimum_filter(view.depth_m, 3)
    one = ndimage.maximum_filter(view.segmentation, 3) == ndimage.minimum_filter(
        view.segmentation, 3
    )
    return np.asarray(one & (high < 0.02) & (view.depth_m > 0))


def test_sapien_and_rays_agree(
    sapien_renderer: Renderer, objects: Mapping[str, CatalogueObject]
) -> None:
    """On depth, segmentation and normals, from the static camera and from both wrist's."""
    cameras = scene_cameras(
        CamerasConfig(), np.array([[-0.1, 0, 0.05], [0.1, 0, 0.05]]), np.random.default_rng(2)
    )
    assert [camera.name for camera in cameras] == ["static_0", "wrist_0", "wrist_1"]
    assert camera_names(CamerasConfig()) == [camera.name for camera in cameras]
    by_rays = render_views(CUBE_AND_BALL, objects, cameras, RayRenderer(ScenesConfig())).views
    by_sapien = render_views(CUBE_AND_BALL, objects, cameras, sapien_renderer).views
    again = render_views(CUBE_AND_BALL, objects, cameras, sapien_renderer).views
    for one, two, rays in zip(by_sapien, again, by_rays, strict=True):
        assert one.depth_m.tobytes() == two.depth_m.tobytes()
        assert one.colour.tobytes() == two.colour.tobytes()
        # Lit: no pixel of the ball or the table is black.
        assert one.colour.max(axis=2)[one.depth_m > 0].min() > 20
        inner = interior(rays)
        assert inner.sum() > 0.98 * (rays.depth_m > 0).sum()
        assert (one.segmentation == rays.segmentation)[inner].mean() > 0.999
        assert (np.abs(one.depth_m - rays.depth_m)[inner] < 1e-4).mean() > 0.999
        cosine = (normals_of(one) * normals_of(rays)).sum(axis=2)[inner]
        assert (cosine > np.cos(np.radians(2.0))).mean() > 0.999


def test_normals_are_those_of_the_surface(view: CameraView) -> None:
    points, rows, columns = points_of_depth(view.depth_m, view.camera, 1)
    in_world = normals_of(view)[rows, columns] @ view.camera.world_from_camera[:3, :3].T
    body = view.segmentation[rows, columns]
    np.testing.assert_allclose(
        in_world[body == 0], [[0.0, 0.0, 1.0]] * (body == 0).sum(), atol=0.01
    )
    outward = (points[body == 2] - [0.1, 0, 0.05]) / 0.05
    assert ((in_world[body == 2] * outward).sum(axis=1) > np.cos(np.radians(1.5))).mean() > 0.99


def test_the_renderer_asked_for_is_the_one(sapien_renderer: Renderer) -> None:
    assert new_renderer("embree", ScenesConfig()).name == "embree"
    assert new_renderer("auto", ScenesConfig()).name == sapien_renderer.name == "sapien"


def test_the_wrist_looks_at_an_object_from_its_distance() -> None:
    config = WristCameraConfig(viewpoints=5)
    centres = np.array([[0.1, 0.2, 0.03], [-0.2, 0.0, 0.05]])
    cameras = wrist_cameras(config, centres, np.random.default_rng(4))
    again = wrist_cameras(config, centres, np.random.default_rng(4))
    looked_at = []
    for camera, same in zip(cameras, again, strict=True):
        np.testing.assert_array_equal(camera.world_from_camera, same.world_from_camera)
        at_m = camera.world_from_camera @ [0.0, 0.0, config.distance_m, 1.0]
        looked_at.append(int(np.argmin(np.linalg.norm(centres - at_m[:3], axis=1))))
        np.testing.assert_allclose(at_m[:3], centres[looked_at[-1]], atol=1e-9)
        height = camera.world_from_camera[2, 3] - at_m[2]
        elevation = np.arcsin(height / config.distance_m)
        assert config.elevation_min_rad <= elevation <= config.elevation_max_rad
    assert sorted(looked_at) in ([0, 0, 0, 1, 1], [0, 0, 1, 1, 1])
    assert wrist_cameras(config, np.empty((0, 3)), np.random.default_rng(4)) == ()


def test_what_is_transparent_is_measured_through(objects: Mapping[str, CatalogueObject]) -> None:
    """Its pixels measure the table behind it or nothing; exact depth still has it."""
    glass = scene_of(
        PlacedObject("cube", 1, at(-0.1, 0, 0.05)), PlacedObject("glass ball", 2, at(0.1, 0, 0.05))
    )
    renderer = RayRenderer(ScenesConfig())
    seen = render_views(glass, objects, CAMERAS, renderer).views[0]
    opaque = render_views(CUBE_AND_BALL, objects, CAMERAS, renderer).views[0]
    assert opaque.behind_m is None
    np.testing.assert_array_equal(seen.depth_m, opaque.depth_m)
    on_glass = seen.segmentation == 2
    for sensor in NOISE_MODELS:
        measured = disturb(through(seen, sensor), np.random.default_rng(1))
        returned = on_glass & (measured > 0)
        model = NOISE_MODELS[sensor]
        assert 0.5 * (1 - model.transparent_loss) < returned.sum() / on_glass.sum()
        assert returned.sum() / on_glass.sum() < 1 - 0.9 * model.transparent_loss
        points, rows, columns = points_of_depth(measured, seen.camera, 1)
        behind = points[on_glass[rows, columns]]
        assert abs(np.median(behind[:, 2])) < 0.002
    # In colour it is mostly what lies behind it.
    glassy = seen.colour[on_glass].astype(float)
    table = seen.colour[(seen.segmentation == 0) & (seen.depth_m > 0)].astype(float).mean(axis=0)
    solid = opaque.colour[on_glass].astype(float)
    assert np.abs(glassy - table).mean() < 0.5 * np.abs(solid - table).mean()


def test_nothing_is_measured_out_of_range(view: CameraView) -> None:
    near = replace(view, camera=replace(view.camera, sensor="ideal", near_m=0.85))
    measured = disturb(near, np.random.default_rng(0))
    exact = view.depth_m.astype(np.float64)
    np.testing.assert_array_equal(measured, np.where(exact >= 0.85, exact, 0.0))
    assert ((measured == 0) & (exact > 0)).any()


def test_noise_has_its_spread_and_its_seed(view: CameraView) -> None:
    noisy = disturb(view, np.random.default_rng(3))
    again = disturb(view, np.random.default_rng(3))
    assert noisy.tobytes() == again.tobytes()
    table = (view.segmentation == 0) & (noisy > 0)
    error = (noisy - view.depth_m)[table]
    # 0.8 mm + 0.7 mm/m at 0.9 m, over cosines between 0.8 and 1.
    assert 0.0012 < error.std() < 0.0022
    assert abs(error.mean()) < 1e-4


@pytest.mark.parametrize("sensor", sorted(NOISE_MODELS))
def test_every_sensor_has_its_published_spread(sensor: DepthSensor, view: CameraView) -> None:
    """In units of the model's own spread at each pixel, the error is standard normal."""
    model = NOISE_MODELS[sensor]
    noisy = disturb(through(view, sensor), np.random.default_rng(5))
    depth = view.depth_m.astype(np.float64)
    flat = (view.segmentation == 0) & (noisy > 0)
    sigma = model.sigma_m(depth, cosine_of_incidence(view))
    units = ((noisy - depth) / np.sqrt(sigma**2 + model.step_m**2 / 12.0))[flat]
    assert units.std() == pytest.approx(1.0, abs=0.02)
    assert units.mean() == pytest.approx(0.0, abs=0.02)


def test_published_spreads_at_their_distances() -> None:
    lidar, light = NOISE_MODELS["lidar"], NOISE_MODELS["structured-light"]
    assert lidar.floor_m + lidar.linear * 1.0 == pytest.approx(0.0025)
    assert lidar.floor_m + lidar.linear * 9.0 == pytest.approx(0.0155)
    assert light.floor_m + light.quadratic_1_m * (1.4 - 0.4) ** 2 == pytest.approx(0.0031)


@pytest.mark.parametrize("sensor", sorted(NOISE_MODELS))
def test_no_sensor_sees_at_grazing_incidence(sensor: DepthSensor, view: CameraView) -> None:
    noisy = disturb(through(view, sensor), np.random.default_rng(5))
    grazing = cosine_of_incidence(view) < np.cos(NOISE_MODELS[sensor].grazing_rad)
    assert grazing.any()
    assert not noisy[grazing].any()
    assert (noisy[~grazing & (view.depth_m > 0)] > 0).mean() > 0.95


def test_incidence_on_the_table_is_the_angle_to_its_normal(view: CameraView) -> None:
    points, rows, columns = points_of_depth(view.depth_m, view.camera, 1)
    ray = points - view.camera.world_from_camera[:3, 3]
    expected = np.arccos(-ray[:, 2] / np.linalg.norm(ray, axis=1))
    found = np.arccos(cosine_of_incidence(view))[rows, columns]
    table = ndimage.binary_erosion(view.segmentation == 0, iterations=3)[rows, columns]
    inner = table & (rows > 2) & (rows < 420) & (columns > 2) & (columns < 508)
    # The picture's own edge of the table is a step too.
    smooth = inner & (np.abs(points[:, :2]).max(axis=1) < 0.55)
    np.testing.assert_allclose(found[smooth], expected[smooth], atol=6e-3)  # half a step of the map


def test_incidence_matches_the_plain_formula(view: CameraView) -> None:
    """The oracle decodes the normals and divides by the rays' lengths."""
    rows, columns = np.indices(view.depth_m.shape)
    k = view.camera.intrinsics
    ray = np.stack(
        [
            (columns + 0.5 - k[0, 2]) / k[0, 0],
            (rows + 0.5 - k[1, 2]) / k[1, 1],
            np.ones(view.depth_m.shape),
        ],
        axis=2,
    )
    cosine = -(normals_of(view) * ray).sum(axis=2) / np.linalg.norm(ray, axis=2)
    expected = np.clip(np.nan_to_num(cosine), 0.0, 1.0)
    np.testing.assert_allclose(cosine_of_incidence(view), expected, atol=1e-12)


def test_an_ideal_sensor_measures_the_picture_itself(view: CameraView) -> None:
    clean = disturb(through(view, "ideal"), np.random.default_rng(0))
    np.testing.assert_array_equal(clean, view.depth_m)


@pytest.mark.parametrize("azimuths_rad", [(0.0,), (0.0, 2.0, 4.0)])
def test_grid_matches_a_plain_loop(
    azimuths_rad: tuple[float, ...], objects: Mapping[str, CatalogueObject]
) -> None:
    """The oracle sorts all points of the pictures into cells, one grasp at a time."""
    config = SensingConfig()
    poses = np.stack([at(-0.1, 0.0, 0.1), at(0.1, 0.01, 0.1), at(-0.05, 0.0, 0.1)])
    beside = StaticCameraConfig(
        azimuths_rad=azimuths_rad, elevations_rad=(1.0,) * len(azimuths_rad)
    )
    views = render_views(
        CUBE_AND_BALL, objects, static_cameras(beside), RayRenderer(ScenesConfig())
    ).views
    pictures = [(view.depth_m.astype(np.float64), view.camera) for view in views]
    cloud, seen = merged_sub_clouds(pictures, poses, config, 0.025)
    if len(pictures) == 1:
        np.testing.assert_array_equal(sub_clouds(*pictures[0], poses, config, 0.025)[0], cloud)
    points = np.concatenate([points_of_depth(*picture, 1)[0] for picture in pictures])
    cells, half = config.grid_cells, config.grid_side_m / 2
    for index, pose in enumerate(poses):
        local = points - pose[:3, 3]
        height = local[:, 2]
        local = local[(height >= -config.grid_depth_m) & (height <= config.grid_height_m)]
        row = np.floor((local[:, 1] + half) / (2 * half) * cells).astype(int)
        column = np.floor((local[:, 0] + half) / (2 * half) * cells).astype(int)
        inside = (row >= 0) & (row < cells) & (column >= 0) & (column < cells)
        row, column, local = row[inside], column[inside], local[inside]
        top = np.full((cells, cells), -np.inf)
        np.maximum.at(top, (row, column), local[:, 2])
        inside = local[:, 2] >= top[row, column] - config.layer_m
        counts = np.zeros((cells, cells))
        np.add.at(counts, (row[inside], column[inside]), 1)
        sums = np.zeros((cells, cells, 3))
        np.add.at(sums, (row[inside], column[inside]), local[inside])
        np.testing.assert_array_equal(seen[index], counts > 0)
        mean = sums / np.maximum(counts, 1)[..., None] / 0.025
        np.testing.assert_allclose(cloud[index], mean, atol=1e-5)


def test_what_stands_above_is_seen_and_what_lies_under_an_edge_is_not_mixed_in(
    view: CameraView,
) -> None:
    """On the table beside a ball of 100 mm: a cell holds the ball or the table, none both."""
    config = SensingConfig()
    beside = at(0.06, 0.0, 0.0)[None]
    cloud, seen = sub_clouds(view.depth_m, view.camera, beside, config, 0.025)
    height_m = 0.025 * cloud[0, ..., 2][seen[0]]
    assert height_m.max() > 2 * config.grid_depth_m
    assert (height_m > -0.001).all()
    lower = config.model_copy(update={"grid_height_rg": config.grid_depth_rg})
    blind, _ = sub_clouds(view.depth_m, view.camera, beside, lower, 0.025)
    assert 0.025 * blind[..., 2].max() <= config.grid_depth_m + 1e-6
    # An edge of the cube: with all of their points its cells hang between its top and its foot.
    edge = at(-0.05125, 0.0, 0.1)[None]  # in the middle of a cell
    apart, both = (
        sub_clouds(view.depth_m, view.camera, edge, with_layer, 0.025)
        for with_layer in (
            config.model_copy(update={"grid_depth_rg": 4.4}),
            config.model_copy(update={"grid_depth_rg": 4.4, "layer_rg": 40.0}),
        )
    )
    between = [
        ((0.025 * c[0, ..., 2] < -0.01) & (0.025 * c[0, ..., 2] > -0.09) & s[0]).sum()
        for c, s in (apart, both)
    ]
    assert between[0] == 0 < between[1]


def test_shown_whole_is_a_ball_whose_every_point_is_in_the_picture(view: CameraView) -> None:
    """Against the picture's own projection of points all over each ball."""
    rng = np.random.default_rng(3)
    centres, radius = rng.uniform(-0.7, 0.7, (400, 3)) * [1, 1, 0.2], 0.04
    shell = rng.normal(size=(3000, 3))
    shell *= radius / np.linalg.norm(shell, axis=1, keepdims=True)
    camera = view.camera
    world = centres[:, None] + shell
    local = transform_points(invert(camera.world_from_camera), world.reshape(-1, 3))
    pixels = local @ camera.intrinsics.T
    column, row = (pixels[:, i] / pixels[:, 2] for i in (0, 1))
    inside = (column >= 0) & (column <= camera.width_px) & (row >= 0) & (row <= camera.height_px)
    whole = inside.reshape(len(centres), -1).all(axis=1)
    found = shown_whole(camera, centres, radius)
    assert 0.1 < whole.mean() < 0.9
    assert not (found & ~whole).any()
    # 3000 points do not touch a face that cuts less than a hair off the ball.
    assert (shown_whole(camera, centres, 0.97 * radius) >= whole).all()


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
        "from pipeline.config import ScenesConfig, StaticCameraConfig\n"
        "from pipeline.errors import MachineError\n"
        "from pipeline.world.cameras import static_cameras\n"
        "from pipeline.sensing.sapien_rendering import render_table\n"
        "try:\n"
        "    render_table(ScenesConfig(), static_cameras(StaticCameraConfig())[0])\n"
        "except MachineError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert "coacd" in done.stdout
