"""A stream of pictures: which are answered, which skipped, and how the support is kept."""

import numpy as np
import pytest

from pipeline.camera.bags import RecordedPicture
from pipeline.camera.frame import Frame
from pipeline.camera.live import LiveGrasps, Parts, in_recorded_time
from pipeline.config import RunConfig
from pipeline.control.ranking import GeometricRanking
from tests.camera.scenes import box, seen, table

CONFIG = RunConfig.model_validate({"predict": {"live": {"every_px": 1, "cloud_every_px": 1}}})
MS = 1_000_000
EYE = (0.05, -0.35, 0.6)


@pytest.fixture(scope="module")
def frame() -> Frame:
    return seen([table(), box((0.12, 0.10, 0.08), (0.03, 0.02, 0.04))], EYE, 0.001, posed=True)


def unread(times_ms: list[float]) -> list[RecordedPicture]:
    def read() -> tuple[Frame, str]:
        raise AssertionError("a picture that is skipped is not decoded")

    return [RecordedPicture(int(ms * MS), read) for ms in times_ms]


def test_pictures_that_come_too_soon_are_skipped_and_counted() -> None:
    clock = [0.0]

    def answer(picture: RecordedPicture) -> int:
        clock[0] += 0.050
        return picture.time_ns

    pictures = unread([0, 20, 40, 60, 80, 120, 130, 170, 175])
    found = list(in_recorded_time(pictures, answer, lambda: clock[0]))
    assert [one.time_ns // MS for one in found] == [0, 60, 120, 170]
    assert [one.skipped for one in found] == [2, 1, 1, 1]
    assert all(one.seconds == pytest.approx(0.05) for one in found)


def proposer(config: RunConfig = CONFIG) -> LiveGrasps:
    picker = config.evaluate.policy.picker
    return LiveGrasps(GeometricRanking(picker, config.sensing, config.gripper.pad), config)


def test_the_best_grasp_of_a_picture_lies_on_the_boxs_top(frame: Frame) -> None:
    live, parts = proposer(), Parts()
    for draw in range(3):
        found = live.propose(frame, np.random.default_rng(draw), parts)
        best = found.world_from_contact[0]
        assert best[2, 3] == pytest.approx(0.08, abs=0.005)
        assert abs(best[0, 3] - 0.03) < 0.07
        assert abs(best[1, 3] - 0.02) < 0.06
    assert live.found_anew == 1
    assert set(parts.seconds) == {"support", "cloud", "contacts", "ranking", "choice"}
    assert all(spent > 0 for spent in parts.seconds.values())


def test_a_support_that_moved_is_found_anew(frame: Frame) -> None:
    live = proposer()
    live.propose(frame, np.random.default_rng(0), Parts())
    lifted = np.eye(4)
    lifted[2, 3] = 0.1
    other = frame.moved(lifted)
    found = live.propose(other, np.random.default_rng(0), Parts())
    assert live.found_anew == 2
    assert found.world_from_contact[0, 2, 3] == pytest.approx(0.18, abs=0.005)


def test_thinned_pictures_give_the_same_place(frame: Frame) -> None:
    thin = RunConfig.model_validate({"predict": {"live": {"every_px": 2, "cloud_every_px": 3}}})
    best = proposer(thin).propose(frame, np.random.default_rng(0), Parts()).world_from_contact[0]
    assert best[2, 3] == pytest.approx(0.08, abs=0.005)


def test_an_empty_table_has_no_grasp() -> None:
    empty = seen([table()], EYE, 0.0, posed=True)
    assert len(proposer().propose(empty, np.random.default_rng(0), Parts())) == 0
