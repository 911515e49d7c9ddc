"""A floor's bend is found with objects on it, and not guessed where little floor is seen."""

import numpy as np
import pytest

from pipeline.camera.floor_bend import fit_floor_bend
from pipeline.config.predict import SupportConfig

CONFIG = SupportConfig()
SAG_M = 0.009


def sagging(places: np.ndarray) -> np.ndarray:
    """A floor that lies lowest in its middle."""
    return SAG_M * ((places[:, 0] / 0.3) ** 2 + (places[:, 1] / 0.2) ** 2 - 0.7)


def floor(rng: np.random.Generator, count: int = 4000) -> np.ndarray:
    places = rng.uniform((-0.3, -0.2), (0.3, 0.2), (count, 2))
    return np.column_stack([places, sagging(places) + 0.001 * rng.normal(size=count)])


def test_a_sagging_floor_is_found_under_flat_objects() -> None:
    rng = np.random.default_rng(0)
    points = floor(rng)
    under = (np.abs(points[:, 0] - 0.1) < 0.05) & (np.abs(points[:, 1]) < 0.08)
    points[under, 2] += 0.008  # a booklet
    points[points[:, 0] < -0.22, 2] += 0.05  # a box
    bend = fit_floor_bend(points, np.full(len(points), 0.006), CONFIG)
    assert bend is not None
    places = rng.uniform((-0.2, -0.19), (0.29, 0.19), (500, 2))
    assert np.abs(bend.height_m(places) - sagging(places)).max() < 0.0025


def test_beyond_what_was_seen_a_bend_is_bounded() -> None:
    points = floor(np.random.default_rng(0))
    bend = fit_floor_bend(points, np.full(len(points), 0.006), CONFIG)
    assert bend is not None
    far = np.array([[3.0, 0.0], [0.0, -8.0]])
    assert (bend.height_m(far) <= points[:, 2].max()).all()


def test_terms_that_points_do_not_tell_of_stay_zero() -> None:
    along = np.linspace(-0.3, 0.3, 400)
    points = np.column_stack([along, 1e-4 * np.sin(50 * along), 0.004 * (along / 0.3) ** 2])
    bend = fit_floor_bend(points, np.full(len(points), 0.006), CONFIG)
    assert bend is not None
    assert bend.height_m(np.array([[0.0, 0.3]])) == pytest.approx(0.0, abs=0.002)


def test_a_floor_that_is_hidden_has_no_bend() -> None:
    points = floor(np.random.default_rng(0))
    points[points[:, 0] > -0.1, 2] += 0.05
    assert fit_floor_bend(points, np.full(len(points), 0.006), CONFIG) is None
    assert fit_floor_bend(points[:0], np.empty(0), CONFIG) is None
