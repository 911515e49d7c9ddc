"""A driver's own time tells how many nodes it keeps busy."""

import time

import pytest

from pipeline.execution.driver_cost import DriverClock, driver_cost


def test_a_driver_of_one_second_feeds_as_many_cores_as_workers_seconds() -> None:
    cost = driver_cost(driver_s=1.0, workers_s=1600.0, made=2_000_000)
    assert cost["driver_s_per_1000_grasps"] == pytest.approx(0.0005)
    assert cost["nodes_one_driver_feeds"] == pytest.approx(200.0)


def test_of_nothing_made_nothing_is_said() -> None:
    assert driver_cost(0.1, 0.0, 0) == {}


@pytest.mark.parametrize(("has_workers", "of_driver"), [(True, 2.0), (False, 0.5)])
def test_start_and_end_are_told_apart_and_work_in_the_driver_s_process_is_not_the_driver_s(
    monkeypatch: pytest.MonkeyPatch, has_workers: bool, of_driver: float
) -> None:
    seen = iter([14.0, 15.8, 16.0, 16.7])  # at three results, and at the end
    monkeypatch.setattr(time, "process_time", lambda: next(seen))
    clock = DriverClock(10.0, has_workers)
    clock.book(3.0, 500)
    clock.book(1.5, 1000)
    clock.book(0.0, 400)  # it was there already
    cost = clock.cost()
    assert cost["driver_start_s"] == pytest.approx(4.0 if has_workers else 1.0)
    assert cost["driver_s_per_1000_grasps"] == pytest.approx(of_driver)
    assert cost["nodes_one_driver_feeds"] == pytest.approx(1.5 / of_driver / 8, abs=0.05)
    assert cost["driver_end_s"] == pytest.approx(0.7)


def test_of_a_scene_the_driver_may_have_rendered_a_part_itself(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = iter([14.0, 16.0, 16.5])
    monkeypatch.setattr(time, "process_time", lambda: next(seen))
    clock = DriverClock(10.0, has_workers=True)
    clock.book(3.0, 1, here_s=2.5)
    clock.book(2.0, 1, here_s=1.8)
    cost = clock.cost("scenes")
    assert cost["driver_start_s"] == pytest.approx(1.5)
    assert cost["driver_s_per_1000_scenes"] == pytest.approx(200.0)


def test_of_one_result_nothing_is_said() -> None:
    clock = DriverClock(0.0, has_workers=True)
    clock.book(1.0, 10)
    assert clock.cost() == {}
