"""The grid around a contact lies as it says and holds what was seen there."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from pipeline.config import ScenesConfig, SensingConfig, StaticCameraConfig
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.sensing.ray_rendering import RayRenderer
from pipeline.sensing.rendering import render_views
from pipeline.sensing.sub_cloud import merged_sub_clouds, sub_clouds
from pipeline.world.cameras import points_of_depth
from pipeline.world.scene_cameras import static_cameras
from pipeline.world.view import CameraView
from tests.sensing.scenes import CUBE_AND_BALL, at


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


def test_a_flat_top_is_seen_whole_and_a_blind_camera_sees_nothing(view: CameraView) -> None:
    cloud, seen = sub_clouds(
        view.depth_m, view.camera, at(-0.1, 0, 0.1)[None], SensingConfig(), 0.025
    )
    assert seen.mean() > 0.5
    np.testing.assert_allclose(cloud[seen][:, 2], 0.0, atol=1e-2)
    blind = replace(view, depth_m=np.zeros_like(view.depth_m))
    _, nothing = sub_clouds(blind.depth_m, view.camera, at(0, 0, 0.1)[None], SensingConfig(), 0.025)
    assert not nothing.any()
