"""A driver's own time tells how many nodes it keeps busy."""

import pytest

from pipeline.execution.driver_cost import driver_cost


def test_a_driver_of_one_second_feeds_as_many_cores_as_workers_seconds() -> None:
    cost = driver_cost(driver_s=1.0, workers_s=1600.0, grasps=2_000_000)
    assert cost["driver_s_per_1000_grasps"] == pytest.approx(0.0005)
    assert cost["nodes_one_driver_feeds"] == pytest.approx(200.0)


def test_of_nothing_made_nothing_is_said() -> None:
    assert driver_cost(0.1, 0.0, 0) == {}
