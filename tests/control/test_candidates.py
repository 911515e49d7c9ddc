"""Candidates on planes whose normal is known; collisions with posts; the geometric picker."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.config import EvaluateConfig, RunConfig
from pipeline.control.candidates import Candidates, candidates_at, sample_near
from pipeline.control.clearance import free_of_collision
from pipeline.control.cloud import Cloud, merged_cloud
from pipeline.control.ranking import GeometricRanking, smooth_quality
from pipeline.labelling.sampling import contact_frames
from tests.control.fakes import picture_of
from tests.control.plates import plate

CONFIG = EvaluateConfig()
EYE = np.array([0.0, 0.0, 0.9])
RADIUS_M = 0.01


def cloud_of(points: np.ndarray) -> Cloud:
    return Cloud(points, np.broadcast_to(EYE, points.shape))


def test_approach_is_the_mean_normal_of_a_tilted_plate() -> None:
    tilt = 0.3
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    points = plate() @ turn.T
    middle, eye = points[12_960][None], EYE[None]
    found = candidates_at(cloud_of(points), middle, eye, RADIUS_M, CONFIG.policy.tilt_max_rad)
    np.testing.assert_allclose(found.world_from_contact[0, :3, 2], turn[:, 2], atol=1e-9)
    np.testing.assert_allclose(found.world_from_contact[0, :3, 3], middle[0], atol=1e-9)
    assert found.roughness_m[0] < 1e-6
    assert len(candidates_at(cloud_of(points), middle, eye, RADIUS_M, tilt_max_rad=0.2)) == 0


@pytest.mark.parametrize(("turned_deg", "found"), [(60, 60), (90, 75), (94, 75), (97, None)])
def test_a_wall_is_approached_as_steeply_as_is_allowed(turned_deg: int, found: int | None) -> None:
    turn = Rotation.from_euler("y", turned_deg, degrees=True).as_matrix()
    points, eye = plate(0.0) @ turn.T, np.array([[0.9, 0.0, 0.0]])
    middle = points[12_960][None]
    limits = np.radians(75), np.radians(20)
    some = candidates_at(cloud_of(points), middle, eye, RADIUS_M, *limits).world_from_contact
    axes = [Rotation.from_euler("y", found, degrees=True).as_matrix()[:, 2]] if found else []
    np.testing.assert_allclose(some[:, :3, 2], np.reshape(axes, (-1, 3)), atol=1e-6)


def test_neighbourhoods_agree_with_numpy() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.03, 0.03, (400, 3)) * [1, 1, 0.02]
    at = points[:5]
    found = candidates_at(cloud_of(points), at, np.tile(EYE, (5, 1)), RADIUS_M, 1.5)
    for pose, place in zip(found.world_from_contact, at, strict=True):
        patch = points[np.linalg.norm(points - place, axis=1) <= RADIUS_M]
        normal = np.linalg.eigh(np.cov(patch.T, bias=True))[1][:, 0]
        assert abs(pose[:3, 2] @ normal) > 1 - 1e-9


def test_merging_averages_the_noise_of_pictures() -> None:
    """The mean of sixteen measurements has a quarter of the noise of one."""
    rng = np.random.default_rng(0)
    exact = picture_of(plate(), np.array([0.0, 0.0, 0.9]), np.zeros(3))
    seen = exact.depth_m > 0
    pictures = [
        replace(exact, depth_m=np.where(seen, exact.depth_m + noise, 0.0))
        for noise in rng.normal(0.0, 0.0003, (16, *seen.shape))
    ]
    # The plate at 50 mm lies in the middle of its cubes of 4 mm: no noise takes a point out of one.
    one, all_of_them = (merged_cloud(p, 0.004, 0.006) for p in (pictures[:1], pictures))
    assert all_of_them.points_m[:, 2].std() == pytest.approx(one.points_m[:, 2].std() / 4, rel=0.1)


def test_merging_gives_one_point_a_cube_however_often_it_was_measured() -> None:
    eyes = [np.array([0.0, 0.1, 0.9]), np.array([0.3, 0.0, 0.5])]
    first, second = (picture_of(plate(), eye, np.zeros(3)) for eye in eyes)
    once, thrice = merged_cloud([first], 0.003, 0.006), merged_cloud([first] * 3, 0.003, 0.006)
    np.testing.assert_allclose(thrice.points_m, once.points_m, atol=1e-12)
    both = merged_cloud([first, second], 0.003, 0.006)
    cubes = np.floor(both.points_m / 0.003).astype(np.int64)
    assert len(np.unique(cubes, axis=0)) == len(both)


def test_the_aim_is_the_first_candidate_near_it() -> None:
    aim = np.array([0.01, 0.02, 0.05])
    near = sample_near(cloud_of(plate()), aim, 0.015, 20, RADIUS_M, 1.0, np.random.default_rng(0))
    np.testing.assert_allclose(near.world_from_contact[0, :3, 3], aim, atol=1e-3)
    assert np.linalg.norm(near.world_from_contact[:, :3, 3] - aim, axis=1).max() <= 0.016


def test_a_post_beside_the_stem_is_in_the_way_of_one_pose_alone() -> None:
    post = np.column_stack([np.full(20, 0.03), np.zeros(20), np.linspace(0, 0.15, 20)])
    poses = contact_frames(
        np.array([[0.0, 0, 0], [0.025, 0, 0]]), np.tile([0, 0, 1.0], (2, 1)), np.zeros(2)
    )
    assert free_of_collision(poses, post, CONFIG.hand).tolist() == [True, False]
    low = post[post[:, 2] < CONFIG.hand.stem_begins_m - 0.005]
    assert free_of_collision(poses, low, CONFIG.hand).all()


def test_the_geometric_picker_wants_the_pad_on_the_flattest_at_the_top() -> None:
    """A plate's middle, its rim, and its corner are as smooth; a step and a low place are less."""
    run = RunConfig()
    x, y = np.meshgrid(np.linspace(-0.06, 0.06, 241), np.linspace(-0.06, 0.06, 241))
    height = np.where(x > 0.04, 0.05, 0.10)
    points = np.column_stack([x.ravel(), y.ravel(), height.ravel()])
    seen = picture_of(points, np.array([0.0, 0.0, 0.6]), np.zeros(3))
    places = np.array([[0, 0, 0.10], [-0.058, 0, 0.1], [0.038, 0, 0.1], [-0.058, 0.058, 0.1]])
    places = np.concatenate([places, [[0.06, 0.0, 0.05]]])
    poses = contact_frames(places, np.tile([0, 0, 1.0], (5, 1)), np.zeros(5))
    ranking = GeometricRanking(CONFIG.policy.picker, run.sensing, run.gripper.pad)
    value = ranking([seen], Candidates(poses, np.zeros(5), np.zeros(5)))
    assert np.argmax(value) == 0
    assert value[0] > 0.9 > value[1] > value[3]  # half of the pad is over nothing, three quarters
    assert value[0] > value[2]  # half of it is over the step
    assert np.argmin(value) == 4


def test_smoothing_prefers_a_region_to_a_lucky_point() -> None:
    """A lone 0.9 among neighbours of 0.5 is worth less than 0.8 among its like."""
    x = np.concatenate([np.arange(5) * 0.002, 0.1 + np.arange(5) * 0.002])
    places = np.column_stack([x, np.zeros(10), np.zeros(10)])
    up = np.tile([0, 0, 1.0], (10, 1))
    found = Candidates(contact_frames(places, up, np.zeros(10)), np.zeros(10), np.zeros(10))
    quality = np.array([0.5, 0.5, 0.9, 0.5, 0.5, 0.8, 0.8, 0.8, 0.8, 0.8])
    assert np.argmax(quality) == 2
    assert np.argmax(smooth_quality(found, quality, 0.007, 0.3)) >= 5
    np.testing.assert_array_equal(smooth_quality(found, quality, 0.0, 0.3), quality)
