"""What depth does not show: told by its instance, placed by its outlines, felt for."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from pipeline.config import EvaluateConfig
from pipeline.control.candidates import Candidates
from pipeline.control.cloud import DepthPicture
from pipeline.control.decision import Cause, Strategy
from pipeline.control.policy import Attempt
from pipeline.control.unseen import hull_top, unseen_contacts, unseen_instances
from pipeline.geometry.transforms import look_at
from pipeline.world.cameras import PinholeCamera, points_of_depth
from tests.control.fakes import FakeEyes, FakeRobot

SIDE_M, TOP_M = 0.06, 0.05
MIDDLE_M = np.array([0.03, -0.02])
GLASS, WOOD = 1, 2
POLICY = EvaluateConfig().policy
UNSEEN, ABOVE_TABLE_M = POLICY.unseen, POLICY.above_table_m
K = np.array([[300.0, 0.0, 160.0], [0.0, 300.0, 120.0], [0.0, 0.0, 1.0]])


def rays(camera: PinholeCamera) -> np.ndarray:
    """Rays of all pixels in WCS, of depth 1."""
    v, u = np.mgrid[: camera.height_px, : camera.width_px] + 0.5
    k = camera.intrinsics
    own = np.stack([(u - k[0, 2]) / k[0, 0], (v - k[1, 2]) / k[1, 1], np.ones_like(u)], axis=-1)
    return np.asarray(own @ camera.world_from_camera[:3, :3].T)


def hits_box(camera: PinholeCamera, middle_m: np.ndarray) -> np.ndarray:
    """Depth of an upright box in each pixel, inf where it is missed: the slab method."""
    low = np.array([*(middle_m - SIDE_M / 2), 0.0])
    high = np.array([*(middle_m + SIDE_M / 2), TOP_M])
    with np.errstate(divide="ignore"):
        one, other = ((end - camera.world_from_camera[:3, 3]) / rays(camera) for end in (low, high))
    enters, leaves = np.minimum(one, other).max(axis=-1), np.maximum(one, other).min(axis=-1)
    return np.where(enters <= leaves, enters, np.inf)


def picture(
    eye_m: Sequence[float], glass_m: np.ndarray | None = MIDDLE_M, wood_m: np.ndarray | None = None
) -> DepthPicture:
    """A glass box, which depth sees through, and a wooden one."""
    pose = look_at(np.array(eye_m), np.array([0.0, 0.0, 0.0]))
    camera = PinholeCamera("made", 320, 240, K, pose, "lidar", near_m=0.0, far_m=3.0)
    depth = -pose[2, 3] / rays(camera)[..., 2]
    instances = np.zeros(depth.shape, dtype=np.int64)
    if wood_m is not None:
        box = hits_box(camera, wood_m)
        instances[box < depth] = WOOD
        depth = np.minimum(depth, box)
    if glass_m is not None:
        instances[hits_box(camera, glass_m) < depth] = GLASS
    return DepthPicture(depth, camera, instances)


AROUND = [(0.2, 0.0, 0.6), (-0.25, 0.0, 0.55), (0.0, 0.3, 0.6)]


def test_the_table_is_at_height_zero_and_a_box_is_as_high_as_it_is() -> None:
    shown = picture((0.2, 0.1, 0.7), None, MIDDLE_M)
    heights = points_of_depth(shown.depth_m, shown.camera, every=1)[0][:, 2]
    assert heights.min() == pytest.approx(0.0, abs=1e-9)
    assert heights.max() == pytest.approx(TOP_M, abs=1e-9)


def test_only_what_depth_misses_is_unseen() -> None:
    pictures = [picture(eye, wood_m=np.array([-0.1, 0.05])) for eye in AROUND]
    assert unseen_instances(pictures, UNSEEN, ABOVE_TABLE_M) == [GLASS]


def test_without_instances_nothing_is_told() -> None:
    unsegmented = [replace(picture(AROUND[0]), instances=None)]
    assert unseen_contacts(unsegmented, UNSEEN, ABOVE_TABLE_M) == []
    assert unseen_contacts([], UNSEEN, ABOVE_TABLE_M) == []


def test_opposite_outlines_give_the_middle_and_bound_the_height() -> None:
    contact = hull_top([picture(eye) for eye in AROUND], GLASS, UNSEEN)
    assert contact is not None
    np.testing.assert_allclose(contact[:2, 3], MIDDLE_M, atol=0.008)
    assert TOP_M - 0.004 <= contact[2, 3] <= 2.5 * TOP_M
    np.testing.assert_array_equal(contact[:3, :3], np.eye(3))


def test_more_pictures_leave_less_room() -> None:
    tops = [hull_top([picture(eye) for eye in AROUND[:n]], GLASS, UNSEEN) for n in (1, 2, 3)]
    heights = [top[2, 3] for top in tops if top is not None]
    assert len(heights) == 3
    assert heights[0] >= heights[1] >= heights[2] < heights[0]


def test_what_stands_before_the_glass_hides_no_part_of_it() -> None:
    """A wooden box between one eye and the glass takes nothing off the hull's middle."""
    free = [picture(eye) for eye in AROUND]
    before = picture(AROUND[0], wood_m=MIDDLE_M + np.array([SIDE_M, 0.0]))
    seen, hidden = (np.count_nonzero(p.instances == GLASS) for p in (free[0], before))
    assert hidden < 0.9 * seen
    contact = hull_top([before, *free[1:]], GLASS, UNSEEN)
    assert contact is not None
    np.testing.assert_allclose(contact[:2, 3], MIDDLE_M, atol=0.012)


def test_an_eye_that_looks_past_the_table_places_nothing() -> None:
    level = replace(free_of_table(), instances=np.full((240, 320), GLASS))
    assert hull_top([level], GLASS, UNSEEN) is None


def free_of_table() -> DepthPicture:
    """Looks up: no ray meets the table."""
    pose = look_at(np.array([0.5, 0.0, 0.1]), np.array([0.0, 0.0, 0.9]))
    camera = replace(picture(AROUND[0]).camera, world_from_camera=pose)
    return DepthPicture(np.zeros((240, 320)), camera)


class GlassEyes(FakeEyes):
    """Depth shows the bare table; colour shows the box."""

    def _taken(self, eye: np.ndarray, target: np.ndarray) -> DepthPicture | None:
        self.left -= 1
        return None if self.left < 0 else picture(tuple(eye))


def unused(_: Sequence[DepthPicture], candidates: Candidates) -> np.ndarray:
    raise AssertionError(f"nothing was measured, yet {len(candidates)} candidates are ranked")


@pytest.mark.parametrize("several_views", [True, False])
def test_it_feels_its_way_down_to_what_it_cannot_measure(several_views: bool) -> None:
    robot = FakeRobot(TOP_M)
    eyes = GlassEyes(np.empty((0, 3)), robot)
    strategy = Strategy("closed-loop", unused, several_views, True, True, True)
    config = EvaluateConfig()
    decision = Attempt(eyes, robot, strategy, config, 0.01, np.random.default_rng(0)).run()
    assert decision.cause is Cause.LIFTED
    assert decision.predicted_quality == 0.0
    assert decision.corrections == 0
    np.testing.assert_allclose(decision.world_from_contact[:2, 3], MIDDLE_M, atol=SIDE_M / 2)


def test_a_place_that_failed_is_aim_unmeasured_last() -> None:
    robot = FakeRobot(TOP_M)
    eyes = TwoGlasses(np.empty((0, 3)), robot)
    strategy = Strategy("open-loop", unused, False, False, False, False)
    aims: list[np.ndarray] = []
    for avoid_m in ([], aims):
        attempt = Attempt(
            eyes, robot, strategy, EvaluateConfig(), 0.01, np.random.default_rng(0), avoid_m
        )
        aims.append(attempt.run().world_from_contact[:3, 3])
    assert np.linalg.norm(aims[0] - aims[1]) > 2 * SIDE_M


class TwoGlasses(GlassEyes):
    """A second box, further on."""

    def _taken(self, eye: np.ndarray, target: np.ndarray) -> DepthPicture | None:
        one, other = picture(tuple(eye)), picture(tuple(eye), -3 * MIDDLE_M)
        assert one.instances is not None
        second = (other.instances == GLASS) & (one.instances == 0)
        return replace(one, instances=np.where(second, WOOD, one.instances))
