"""What a frame tells of a first choice: on one surface or across an edge, in the mask, stable."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.camera.frame import Frame
from pipeline.camera.proposals import Proposals
from pipeline.camera.trial import (
    edge_share,
    first_choice,
    stability_of,
    unmasked,
    with_lost_pixels,
)
from pipeline.config.predict import TrialConfig
from tests.camera.scenes import box, seen, table

CONFIG = TrialConfig()
RADIUS_M = 0.025
TOP_M = 0.08


@pytest.fixture(scope="module")
def frame() -> Frame:
    """A box of 12 by 10 cm in the middle of a table, from above."""
    return seen(
        [table(), box((0.12, 0.10, TOP_M), (0.0, 0.0, TOP_M / 2))], (0.0, -0.2, 0.6), 0.0, True
    )


def upright(x: float, y: float, z: float = TOP_M) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = (x, y, z)
    return pose


def found(*places: tuple[float, float]) -> Proposals:
    poses = np.stack([upright(*place) for place in places]) if places else np.empty((0, 4, 4))
    n = len(places)
    quality = np.linspace(0.9, 0.1, n)
    return Proposals(poses, quality, np.zeros(n), np.zeros(n, dtype=np.int64), None, {})


def test_the_middle_of_a_box_is_off_its_edges(frame: Frame) -> None:
    assert edge_share(frame, upright(0.0, 0.0), RADIUS_M, CONFIG) == 0.0
    assert edge_share(frame, upright(0.03, 0.02), RADIUS_M, CONFIG) == 0.0


def test_half_of_a_pad_on_the_rim_is_beyond_the_edge(frame: Frame) -> None:
    assert edge_share(frame, upright(0.06, 0.0), RADIUS_M, CONFIG) == pytest.approx(0.5, abs=0.08)


def test_a_pad_askew_is_off_the_surface(frame: Frame) -> None:
    pose = upright(0.0, 0.0)
    c, s = np.cos(1.2), np.sin(1.2)
    pose[:3, :3] = [[1, 0, 0], [0, c, -s], [0, s, c]]
    assert edge_share(frame, pose, RADIUS_M, TrialConfig(edge_jump_m=0.003)) > 0.4


def test_what_was_not_measured_and_what_the_mask_leaves_out_is_no_surface(frame: Frame) -> None:
    nothing = replace(frame, depth_m=np.zeros_like(frame.depth_m))
    assert edge_share(nothing, upright(0.0, 0.0), RADIUS_M, CONFIG) == 1.0
    beside = replace(frame, allowed=np.zeros(frame.allowed.shape, dtype=bool))
    assert edge_share(beside, upright(0.0, 0.0), RADIUS_M, CONFIG) == 1.0
    assert edge_share(frame, upright(5.0, 0.0), RADIUS_M, CONFIG) == 1.0  # out of the picture


def test_a_first_choice_is_judged_by_the_mask(frame: Frame) -> None:
    plain = first_choice(frame, found((0.0, 0.0), (0.03, 0.0)), RADIUS_M, CONFIG)
    assert plain is not None
    assert plain.in_mask is None
    assert plain.off_edges
    assert plain.quality == 0.9
    left = np.zeros(frame.allowed.shape, dtype=bool)
    left[:, :160] = True
    masked = replace(frame, allowed=left)
    inside = first_choice(masked, found((-0.03, 0.0)), RADIUS_M, CONFIG)
    outside = first_choice(masked, found((0.03, 0.0)), RADIUS_M, CONFIG)
    assert inside is not None
    assert outside is not None
    assert (inside.in_mask, inside.off_edges) == (True, True)
    assert (outside.in_mask, outside.off_edges) == (False, False)
    assert first_choice(frame, found(), RADIUS_M, CONFIG) is None


def test_pixels_are_lost_by_their_share(frame: Frame) -> None:
    before = int((frame.depth_m > 0).sum())
    few = with_lost_pixels(frame, 0.3, np.random.default_rng(1))
    assert (few.depth_m > 0).sum() == pytest.approx(0.7 * before, rel=0.03)
    kept = few.depth_m > 0
    assert (few.depth_m[kept] == frame.depth_m[kept]).all()


def test_stability_is_how_far_first_choices_lie_apart(frame: Frame) -> None:
    first = first_choice(frame, found((0.0, 0.0), (0.05, 0.0)), RADIUS_M, CONFIG)
    assert first is not None
    others = [found((0.0, 0.03), (0.045, 0.0)), None, found((0.05, 0.0), (0.0, 0.0)), found()]
    stable = stability_of(first, others, apart_m=0.02)
    assert stable.moved_m.tolist() == [pytest.approx(0.03), np.inf, pytest.approx(0.05), np.inf]
    assert stable.quality_change.tolist() == [0.0, -0.9, 0.0, -0.9]
    assert stable.found_again.tolist() == [0.5, 0.0, 1.0, 0.0]


def test_a_mask_can_be_taken_off(frame: Frame) -> None:
    masked = replace(frame, allowed=np.zeros(frame.allowed.shape, dtype=bool))
    assert unmasked(masked).allowed.all()
