"""Errors group by group: each by hand, and what the baselines are."""

from typing import Any

import numpy as np
import pytest

from pipeline.network.error_analysis import Predictions, error_analysis


def analysed() -> dict[str, Any]:
    quality = np.array([0.9, 0.8, 0.1, 0.0])
    return error_analysis(
        Predictions(
            quality=quality,
            predicted={
                "network": quality + np.array([0.1, 0.1, 0.4, 0.0]),
                "analytic": np.zeros(4),
            },
            seal_ratio=np.array([0.9, 0.8, 0.2, 0.1]),
            object_name=np.array(["box", "box", "ball", ""]),
            shape_class=np.array(["basic", "basic", "complex", ""]),
            tilt_rad=np.deg2rad([0.0, 10.0, 45.0, 90.0]),
            edge_rg=np.array([0.2, np.inf, 1.0, 0.0]),
        )
    )


def test_errors_of_all_and_of_each_object_the_worst_first() -> None:
    found = analysed()
    assert found["all"]["grasps"] == 4
    assert found["all"]["errors"]["network"] == pytest.approx(0.15)
    assert found["all"]["errors"]["analytic"] == pytest.approx(0.45)
    assert list(found["by_object"]) == ["ball", "box"]
    assert found["by_object"]["ball"]["errors"]["network"] == pytest.approx(0.4)
    assert found["by_object"]["box"]["mean_q"] == pytest.approx(0.85)
    assert found["by_class"]["complex"]["grasps"] == 1


def test_baselines_are_the_best_of_their_kind_on_these_grasps() -> None:
    errors = analysed()["all"]["errors"]
    assert errors["median of these"] == pytest.approx((0.45 + 0.35 + 0.35 + 0.45) / 4)
    # q rises with the ratio: the best rising function has no error.
    assert errors["seal ratio, fitted to these"] == pytest.approx(0.0)


def test_groups_hold_every_grasp_once() -> None:
    found = analysed()
    assert {name: row["grasps"] for name, row in found["by_tilt"].items()} == {
        "0 to 10°": 1,
        "10 to 20°": 1,
        "45 to 90°": 2,
    }
    assert {name: row["grasps"] for name, row in found["by_edge"].items()} == {
        "0 to 0.25 r_G": 2,
        "over 1 r_G": 2,
    }
