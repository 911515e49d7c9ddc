"""Loads against levers, Coulomb's law and Clarabel's exact cones."""

from dataclasses import replace

import clarabel
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy import sparse

from pipeline.referee.disc import build_disc
from pipeline.referee.load import (
    FRICTION_SIDES,
    Hold,
    contact_wrenches,
    suction_along_normals_n,
    suction_wrench,
    weight_loads,
)
from tests.referee.shapes import sphere

DISC = build_disc(0.025, 0.025 / 16)
COUNT = len(DISC.areas_m2)
VACUUM_PA = 10e3
FORCE_N = VACUUM_PA * DISC.area_m2
UP = np.tile([0.0, 0.0, 1.0], (COUNT, 1))
ALL = np.ones(COUNT, dtype=bool)
FRICTION = 0.5


def flat_hold(touches: np.ndarray = ALL) -> Hold:
    level = np.zeros(COUNT)
    return Hold(
        suction_wrench(DISC, np.full(COUNT, VACUUM_PA), level, ALL),
        contact_wrenches(DISC, touches, level, UP, FRICTION),
        DISC.radius_m,
    )


def farthest_patch_m() -> float:
    """How far the centres of patches reach along -x."""
    total = np.bincount(DISC.patch, DISC.areas_m2)
    return -float((np.bincount(DISC.patch, DISC.areas_m2 * DISC.vertices_xy_m[:, 0]) / total).min())


def test_a_straight_pull_is_vacuum_times_area() -> None:
    assert flat_hold().largest_scale(np.array([0, 0, -1.0, 0, 0, 0])) == pytest.approx(FORCE_N)


@pytest.mark.parametrize("lever_m", [0.0, 0.01, 0.05, 0.2])
def test_a_pull_aside_is_a_lever(lever_m: float) -> None:
    """F = W (1 + d / r): contact pushes back at the far side, r from the centre."""
    load = np.array([0.0, 0.0, -1.0, 0.0, lever_m, 0.0])  # M_y = -x F_z
    reach_m = farthest_patch_m()
    expected = FORCE_N / (1 + lever_m / reach_m)
    assert flat_hold().largest_scale(load) == pytest.approx(expected, rel=1e-6)


def test_without_contact_only_a_central_pull_is_borne() -> None:
    hold = flat_hold(np.zeros(COUNT, dtype=bool))
    assert hold.bears(np.array([0.0, 0.0, -FORCE_N, 0.0, 0.0, 0.0]))
    assert not hold.bears(np.array([0.0, 0.0, -0.9 * FORCE_N, 0.0, 0.0, 0.0]))


@settings(max_examples=30)
@given(
    arrays.arrays(float, (12, 6), elements=st.floats(-1.0, 1.0)),
    st.floats(0.0, 60.0),
    st.sampled_from([np.inf, FORCE_N]),
)
def test_what_balanced_the_last_load_changes_no_verdict(
    steps: np.ndarray, pull_n: float, most_n: float
) -> None:
    """One hold is asked load after load, as while it carries; a new one is asked each by itself."""
    asked = replace(flat_hold(), most_n=most_n)
    unit = np.array([3.0, 3.0, 3.0, 0.1, 0.1, 0.1])
    for load in np.cumsum(steps * unit, axis=0) - pull_n * np.eye(6)[2]:
        assert asked.bears(load) == replace(asked).bears(load)


def test_a_side_force_is_rubbed_against() -> None:
    assert flat_hold().largest_scale(np.eye(6)[0]) == pytest.approx(FRICTION * FORCE_N)


def test_torsion_is_rubbed_against_at_the_rim() -> None:
    reach = np.linalg.norm(_patch_centres(), axis=1).max()
    limit = FRICTION * FORCE_N * reach
    found = flat_hold().largest_scale(np.eye(6)[5])
    assert limit * np.cos(np.pi / FRICTION_SIDES) <= found <= limit * (1 + 1e-9)


def test_pressing_on_is_borne_without_end() -> None:
    hold = flat_hold()
    assert hold.largest_scale(np.array([0, 0, 1.0, 0, 0, 0])) == np.inf
    assert hold.bears(np.array([0, 0, 500.0, 0, 0, 0]))


def test_a_pad_jammed_between_walls_bears_no_more_than_pull_and_friction() -> None:
    """Pushes N on two facing walls rub with μ N: F + μ N, and N is at most what is said."""
    walls = np.array([[1.0, 0, 0, 0, 0, 0], [-1.0, 0, 0, 0, 0, 0]]).T
    rubbing = walls + FRICTION * np.eye(6)[2][:, None]
    pull = np.array([0.0, 0.0, FORCE_N, 0.0, 0.0, 0.0])
    push = np.column_stack([walls, rubbing, -np.eye(6)[2]])
    down = -np.eye(6)[2]
    assert Hold(pull, push, 0.025).largest_scale(down) == np.inf
    bounded = Hold(pull, push, 0.025, 2 * FORCE_N)
    expected = (1 + 2 * FRICTION) * FORCE_N
    assert bounded.largest_scale(down) == pytest.approx(expected)
    assert bounded.bears(0.999 * expected * down)
    assert not bounded.bears(1.001 * expected * down)
    assert bounded.largest_scale(-down) == np.inf


def test_the_bound_does_not_bind_where_the_surface_is_level() -> None:
    free = flat_hold()
    level = np.zeros(COUNT)
    most_n = suction_along_normals_n(DISC, np.full(COUNT, VACUUM_PA), level, ALL)
    assert most_n == pytest.approx(FORCE_N)
    bounded = Hold(free.suction, free.contact, free.radius_m, most_n)
    for load in np.random.default_rng(0).normal(size=(6, 6)):
        load[2] = -abs(load[2])
        assert bounded.largest_scale(load) == pytest.approx(free.largest_scale(load), rel=1e-5)


def test_on_a_slope_the_pull_along_the_normal_is_pressure_times_true_area() -> None:
    slope = 0.4 * DISC.vertices_xy_m[:, 0] - 0.3 * DISC.vertices_xy_m[:, 1]
    found = suction_along_normals_n(DISC, np.full(COUNT, VACUUM_PA), slope, ALL)
    assert found == pytest.approx(FORCE_N * np.sqrt(1.25))


def test_nothing_holds_nothing() -> None:
    hold = Hold(np.zeros(6), np.zeros((6, 0)), DISC.radius_m)
    assert hold.largest_scale(np.array([0, 0, -1.0, 0, 0, 0])) == 0.0
    assert not hold.bears(np.array([0, 0, -1.0, 0, 0, 0]))


@settings(max_examples=40, deadline=None)
@given(arrays.arrays(float, 6, elements=st.floats(-1, 1).map(lambda x: round(x, 3))))
def test_checking_a_load_agrees_with_the_largest(direction: np.ndarray) -> None:
    load = direction * np.array([1, 1, 1, 0.025, 0.025, 0.025])
    if np.abs(direction).max() < 0.1:
        return
    hold = curved_hold()
    largest = hold.largest_scale(load)
    if np.isinf(largest):
        assert hold.bears(1e4 * load)
        return
    assert hold.bears(0.999 * largest * load)
    assert not hold.bears(1.001 * largest * load + 1e-3 * load)


def curved_hold() -> Hold:
    surface = sphere(DISC, 0.05)
    pulls = np.where(np.linalg.norm(DISC.vertices_xy_m, axis=1) < 0.02, VACUUM_PA, 0.0)
    touches = pulls > 0
    return Hold(
        suction_wrench(DISC, pulls, surface.height_m, ALL),
        contact_wrenches(DISC, touches, surface.height_m, surface.normals, FRICTION),
        DISC.radius_m,
    )


@settings(max_examples=10, deadline=None)
@given(arrays.arrays(np.float64, (4, 6), elements=st.floats(-1, 1)))
def test_several_loads_are_borne_up_to_the_least_of_their_scales(loads: np.ndarray) -> None:
    hold = flat_hold()
    each = min(hold.largest_scale(load) for load in loads)
    assert hold.largest_common_scale(loads) == pytest.approx(each, rel=1e-4)


@pytest.mark.parametrize("hold", [flat_hold(), curved_hold()])
def test_where_the_linear_program_gives_up_halving_finds_the_same(hold: Hold) -> None:
    for load in (np.array([0.3, 0, -1, 0.01, 0, 0.002]), np.array([0, 0, -1.0, 0, 0.02, 0])):
        found = hold._scale_by_halving(load)
        assert found == pytest.approx(hold.largest_scale(load), rel=1e-4)
    assert hold._scale_by_halving(np.array([0, 0, 1.0, 0, 0, 0])) == np.inf


@pytest.mark.parametrize("seed", range(6))
def test_pyramids_bear_a_little_less_than_cones(seed: int) -> None:
    """Clarabel with Coulomb's own cones bears as much, to the pyramids' 3.4 %."""
    rng = np.random.default_rng(seed)
    hold = curved_hold()
    load = rng.normal(size=6) * np.array([1, 1, 1, 0.02, 0.02, 0.02])
    load[2] = -abs(load[2])
    exact = _by_cones(hold, load)
    found = hold.largest_scale(load)
    assert exact * np.cos(np.pi / FRICTION_SIDES) * (1 - 1e-6) <= found <= exact * (1 + 1e-6)


def test_an_even_vacuum_does_not_feel_the_walls_of_a_pit() -> None:
    """By the divergence theorem the wrench depends on the rim of what is evacuated alone."""
    r = np.linalg.norm(DISC.vertices_xy_m, axis=1)
    pit = np.where(r < 0.012, -0.02, 0.0) - np.where(
        np.linalg.norm(DISC.vertices_xy_m - [0.005, 0.0], axis=1) < 0.005, 0.01, 0.0
    )
    even = np.full(COUNT, VACUUM_PA)
    with_pit = suction_wrench(DISC, even, pit, ALL)
    without = suction_wrench(DISC, even, np.zeros(COUNT), ALL)
    np.testing.assert_allclose(with_pit[:3], without[:3], atol=1e-9)
    np.testing.assert_allclose(with_pit[3:], without[3:], atol=1e-9)


def test_a_slope_is_pulled_along_its_normal() -> None:
    slope = 0.3
    wrench = suction_wrench(DISC, np.full(COUNT, VACUUM_PA), slope * DISC.vertices_xy_m[:, 0], ALL)
    assert wrench[0] == pytest.approx(-slope * FORCE_N)
    assert wrench[2] == pytest.approx(FORCE_N)
    np.testing.assert_allclose(wrench[3:], 0.0, atol=1e-9 * FORCE_N)


def test_a_kilogram_aside_weighs_and_turns() -> None:
    loads = weight_loads(np.eye(4), np.array([0.02, 0.0, -0.05]), 9.81, 0.0)
    np.testing.assert_allclose(loads, np.tile([0, 0, -9.81, 0, 0.02 * 9.81, 0], (4, 1)), atol=1e-12)


def _patch_centres() -> np.ndarray:
    total = np.bincount(DISC.patch, DISC.areas_m2)
    x, y = (np.bincount(DISC.patch, DISC.areas_m2 * c) / total for c in DISC.vertices_xy_m.T)
    return np.column_stack([x, y])


def _by_cones(hold: Hold, load: np.ndarray) -> float:
    """Largest scale with |friction| ≤ μ push on every patch, by Clarabel."""
    sides = hold.contact.reshape(6, -1, FRICTION_SIDES)
    push = sides.mean(axis=2)  # friction cancels over the sides
    along, across = (sides[:, :, k] - push for k in (0, FRICTION_SIDES // 4))
    patches = push.shape[1]
    scale = np.array([1, 1, 1, 40, 40, 40.0])
    wrench = np.concatenate(
        [np.stack([push, along, across], axis=2).reshape(6, -1), load[:, None]], axis=1
    )
    count = 3 * patches + 1
    equal = sparse.csc_matrix(scale[:, None] * wrench)
    cones = -sparse.eye(count - 1, count, format="csc")
    problem = sparse.vstack([equal, cones]).tocsc()
    right = np.concatenate([-scale * hold.suction, np.zeros(count - 1)])
    cost = np.zeros(count)
    cost[-1] = -1.0
    shapes = [clarabel.ZeroConeT(6), *(clarabel.SecondOrderConeT(3) for _ in range(patches))]
    options = clarabel.DefaultSettings()
    options.verbose = False
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((count, count)), cost, problem, right, shapes, options
    )
    return float(solver.solve().x[-1])
