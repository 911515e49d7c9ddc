"""Proposals lie on the surface, within their bounds, and are reproducible."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.config import GraspsConfig
from pipeline.labelling.sampling import (
    Proposal,
    VisibleSurface,
    contact_frames,
    mean_normals,
    propose,
    propose_nearby,
    tangents,
    tilt_directions,
)


def seen_from_above(points: np.ndarray, normals: np.ndarray, body: np.ndarray) -> VisibleSurface:
    """Whole in a picture taken from 0.5 m above the origin."""
    return VisibleSurface(points, normals, body, np.array([0, 0, 0.5]), np.full(len(body), True))


@pytest.fixture
def sphere() -> VisibleSurface:
    """20 000 points of a sphere of 50 mm radius, body 3."""
    normals = np.random.default_rng(1).normal(size=(20_000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return seen_from_above(0.05 * normals, normals, np.full(20_000, 3))


def test_contacts_lie_on_the_surface_and_frames_are_rigid(sphere: VisibleSurface) -> None:
    grasps = propose(sphere, 500, GraspsConfig(), np.random.default_rng(0))
    frames = grasps.world_from_contact
    np.testing.assert_allclose(np.linalg.norm(frames[:, :3, 3], axis=1), 0.05, rtol=1e-12)
    rotations = frames[:, :3, :3]
    np.testing.assert_allclose(
        rotations @ rotations.transpose(0, 2, 1), np.eye(3)[None] + 0 * rotations, atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=1e-12)
    assert (grasps.body_id == 3).all()


def test_untilted_proposals_follow_the_normal_and_tilted_ones_their_angle(
    sphere: VisibleSurface,
) -> None:
    config = GraspsConfig(tilt_max_rad=0.5, normal_share=0.5, seen_angle_max_rad=np.pi / 2)
    top = sphere.normals[:, 2] > 0.95  # where no tilt turns away from the camera
    sphere = replace(sphere, whole=top)
    grasps = propose(sphere, 2000, config, np.random.default_rng(0))
    outward = grasps.world_from_contact[:, :3, 3] / 0.05
    angle = np.arccos(np.clip((outward * grasps.world_from_contact[:, :3, 2]).sum(1), -1, 1))
    # A sphere's mean normal over a small cap is the radius, but for the cap's sampling.
    np.testing.assert_allclose(angle, grasps.tilt_rad, atol=0.03)
    normal = grasps.proposal == Proposal.NORMAL
    assert 0.45 < normal.mean() < 0.55
    assert (grasps.tilt_rad[normal] == 0).all()
    assert grasps.tilt_rad.max() <= 0.5


@pytest.mark.parametrize("angle_max_rad", [0.3, 0.8])
def test_the_camera_sees_every_approach_face_on(
    sphere: VisibleSurface, angle_max_rad: float
) -> None:
    """A mean normal over a small cap is a hair off the contact's own."""
    config = GraspsConfig(seen_angle_max_rad=angle_max_rad)
    first = propose(sphere, 2000, config, np.random.default_rng(0))
    near = propose_nearby(sphere, first, config, np.random.default_rng(1))
    for grasps in (first, near):
        contact, approach = (grasps.world_from_contact[:, :3, axis] for axis in (3, 2))
        to_eye = sphere.eye_m - contact
        cosine = (approach * to_eye).sum(axis=1) / np.linalg.norm(to_eye, axis=1)
        assert np.arccos(cosine).max() <= angle_max_rad + 0.03
        # The bound is reached, not merely kept.
        assert np.arccos(cosine).max() > 0.9 * angle_max_rad
    assert (first.tilt_rad > 0).mean() > 0.1
    np.testing.assert_array_equal(first.tilt_rad > 0, first.proposal == Proposal.TILTED)


def test_no_contact_lies_where_the_picture_ends(sphere: VisibleSurface) -> None:
    """The picture shows the half x > 0 alone."""
    half = replace(sphere, whole=sphere.points_m[:, 0] > 0)
    first = propose(half, 300, GraspsConfig(), np.random.default_rng(0))
    near = propose_nearby(half, first, GraspsConfig(), np.random.default_rng(1))
    for grasps in (first, near):
        assert (grasps.world_from_contact[:, 0, 3] > 0).all()


def test_nearby_proposals_stay_near(sphere: VisibleSurface) -> None:
    config = GraspsConfig()
    first = propose(sphere, 300, config, np.random.default_rng(0))
    near = propose_nearby(sphere, first, config, np.random.default_rng(1))
    step = np.linalg.norm(
        near.world_from_contact[:, :3, 3] - first.world_from_contact[:, :3, 3], axis=1
    )
    assert step.max() <= 2 * config.nearby_radius_m
    assert (step > 0).mean() > 0.9
    assert near.tilt_rad.max() <= config.tilt_max_rad
    assert (near.proposal == Proposal.NEARBY).all()


def test_mean_normal_of_a_right_angled_edge_is_the_diagonal() -> None:
    """Two faces meeting at the y axis, equally sampled: the mean normal bisects them."""
    side = np.linspace(0.0005, 0.0095, 10)
    along = np.linspace(-0.01, 0.01, 21)
    u, v = (a.ravel() for a in np.meshgrid(side, along))
    zero = np.zeros_like(u)
    points = np.concatenate([np.stack([-u, v, zero], 1), np.stack([zero, v, -u], 1)])
    normals = np.concatenate([np.tile([0.0, 0, 1], (len(u), 1)), np.tile([1.0, 0, 0], (len(u), 1))])
    surface = seen_from_above(points, normals, np.ones(len(points), dtype=int))
    mean = mean_normals(surface.points_m, surface.normals, np.zeros((1, 3)), 0.01)
    np.testing.assert_allclose(mean, [[np.sqrt(0.5), 0, np.sqrt(0.5)]], atol=1e-12)


def test_tilting_turns_by_exactly_the_angle() -> None:
    rng = np.random.default_rng(5)
    directions = rng.normal(size=(100, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    tilt = rng.uniform(0, 1, 100)
    turned = tilt_directions(directions, tilt, rng)
    np.testing.assert_allclose((turned * directions).sum(1), np.cos(tilt), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize("axis", np.concatenate([np.eye(3), -np.eye(3)]))
def test_frames_exist_for_every_axis_direction(axis: np.ndarray) -> None:
    frames = contact_frames(np.zeros((1, 3)), axis[None], np.array([0.7]))
    np.testing.assert_allclose(frames[0, :3, 2], axis, atol=1e-15)
    across, side = tangents(axis[None])
    np.testing.assert_allclose(np.cross(across, side), axis[None], atol=1e-15)


def test_same_seed_gives_the_same_proposals(sphere: VisibleSurface) -> None:
    one = propose(sphere, 50, GraspsConfig(), np.random.default_rng(9))
    two = propose(sphere, 50, GraspsConfig(), np.random.default_rng(9))
    assert one.world_from_contact.tobytes() == two.world_from_contact.tobytes()


def test_no_grasp_has_no_nearby_grasps(sphere: VisibleSurface) -> None:
    rng = np.random.default_rng(0)
    none = propose(sphere, 3, GraspsConfig(), rng).take(np.array([], dtype=np.int64))
    assert len(propose_nearby(sphere, none, GraspsConfig(), rng)) == 0
