"""What each depth sensor measures of a picture whose truth is known."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from pipeline.config import DepthSensor, ScenesConfig
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.sensing.depth_noise import NOISE_MODELS, cosine_of_incidence, disturb
from pipeline.sensing.ray_rendering import RayRenderer
from pipeline.sensing.rendering import render_views
from pipeline.world.cameras import points_of_depth
from pipeline.world.scene import PlacedObject
from pipeline.world.view import CameraView, normals_of
from tests.sensing.scenes import CAMERAS, CUBE_AND_BALL, at, scene_of


def through(view: CameraView, sensor: DepthSensor) -> CameraView:
    """The same picture, taken through another sensor."""
    return replace(view, camera=replace(view.camera, sensor=sensor))


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
