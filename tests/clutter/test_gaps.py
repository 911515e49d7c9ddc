"""Gaps and penetration against closed forms."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.clutter.gaps import Surface, gap_m, pairwise_gaps_m, penetration_m
from tests.bodies import mesh_of, pose_at

BOX = mesh_of(trimesh.creation.box(extents=(0.1, 0.1, 0.1)))
BALL = mesh_of(trimesh.creation.icosphere(subdivisions=4, radius=0.05))


@settings(max_examples=30, deadline=None)
@given(st.floats(0.101, 0.3), st.floats(0.101, 0.3))
def test_two_boxes_are_as_far_as_their_corners(x_m: float, y_m: float) -> None:
    found = gap_m(Surface(BOX), np.eye(4), Surface(BOX), pose_at(x_m, y_m, 0.02))
    assert found == pytest.approx(np.hypot(x_m - 0.1, y_m - 0.1), abs=1e-9)


def test_a_ball_is_its_radius_nearer_than_its_centre() -> None:
    found = gap_m(Surface(BALL), np.eye(4), Surface(BOX), pose_at(0.13, 0.0, 0.0))
    assert found == pytest.approx(0.03, abs=1e-4)


def test_bodies_through_each_other_have_no_gap_but_a_depth() -> None:
    poses = (np.eye(4), pose_at(0.097, 0.01, 0.01))
    assert gap_m(Surface(BOX), poses[0], Surface(BOX), poses[1]) == 0.0
    assert penetration_m(BOX, BOX.transformed(poses[1])) == pytest.approx(0.003, abs=1e-9)
    assert penetration_m(BOX, BOX.transformed(pose_at(0.2, 0, 0))) == 0.0


def test_far_pairs_get_a_lower_bound_and_near_pairs_their_gap() -> None:
    surfaces = [Surface(BALL), Surface(BALL), Surface(BALL)]
    poses = [np.eye(4), pose_at(0.11, 0, 0), pose_at(0.5, 0.5, 0)]
    gaps = pairwise_gaps_m(surfaces, poses, beyond_m=0.05)
    exact = pairwise_gaps_m(surfaces, poses)
    assert gaps[0, 1] == exact[0, 1] == pytest.approx(0.01, abs=2e-4)
    assert 0.05 < gaps[0, 2] <= exact[0, 2]
    np.testing.assert_array_equal(gaps, gaps.T)
    assert np.isinf(np.diag(gaps)).all()
