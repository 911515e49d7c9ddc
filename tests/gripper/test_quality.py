"""Quality against truths that can be written down: Eq. (2)-(14)."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad

from pipeline.config import GripperConfig, PadConfig
from pipeline.gripper import GraspStatus, Pad, build_pad, label, label_batch, label_reference
from pipeline.gripper.contact import Contact, contact_of
from pipeline.gripper.draping import contact_vertices, drape
from pipeline.gripper.quality import quality_of, quality_problem, triangle_pressure
from pipeline.gripper.solvers import structured
from pipeline.gripper.wrench import vacuum_force, wrench_matrix
from tests.gripper.surfaces import cylinder, everywhere, plane, sphere, tilted

CONFIG = GripperConfig()
PAD = build_pad(CONFIG.pad)
SCALE = math.log(100.0)


def contact_on(pad: Pad, heights: np.ndarray) -> Contact:
    draped = drape(pad, heights[None])[0]
    return contact_of(pad, draped, contact_vertices(pad, draped, heights, everywhere(pad)))


def extreme_sum(values: np.ndarray, spread: float) -> float:
    """Greatest sum of w_j values_j under Eq. (12) and (13): half up, half down."""
    ordered = np.sort(values)
    half = len(values) // 2
    gain = ordered[len(values) - half :].sum() - ordered[:half].sum()
    return float(values.sum() + spread * gain)


def test_a_plane_is_a_perfect_seal() -> None:
    result = label(PAD, CONFIG, plane(PAD), everywhere(PAD))
    assert result.status is GraspStatus.SOLVED
    assert result.pressure == pytest.approx(1.0, abs=1e-12)
    assert result.q == pytest.approx(1.0, abs=1e-6)
    np.testing.assert_allclose(result.wrench, [0, 0, 1, 0], atol=1e-7)


@pytest.mark.parametrize("rings_open", [1, 3, 7])
def test_a_hole_of_known_area_leaves_p_and_q_in_closed_form(rings_open: int) -> None:
    heights = plane(PAD)
    heights[: 1 + rings_open * PAD.sectors] = -np.inf
    result = label(PAD, CONFIG, heights, everywhere(PAD))
    # Triangles with a vertex over the hole reach out to the ring after it.
    hole = (PAD.ring_radii_m[rings_open] / 0.020) ** 2
    pressure = (1 - hole) ** 2
    assert result.pressure == pytest.approx(pressure, rel=1e-12)
    # Flat: G W has F_z alone, at most F_v by Eq. (10), which is below 1.
    force = pressure * (1 - hole * (0.020 / 0.025) ** 2)
    assert result.q == pytest.approx(math.exp(-SCALE * (1 - force)), abs=1e-7)
    assert result.wrench[2] == pytest.approx(force, abs=1e-7)


def test_a_half_plane_loses_the_overhanging_half() -> None:
    x = PAD.vertices_xy_m[:, 0]
    heights = np.where(x >= -1e-12, 0.0, np.nan)
    result = label(PAD, CONFIG, heights, everywhere(PAD))
    # 45 sectors: those at -88 .. +88 degrees, 22 whole ones, lie over the half-plane.
    covered = 22 / 45
    assert result.pressure == pytest.approx(covered**2, rel=1e-9)
    assert result.wrench[2] == pytest.approx(covered**3, abs=1e-7)


def test_the_gap_between_flush_boxes_a_neighbour_touches_but_does_not_seal() -> None:
    x = PAD.vertices_xy_m[:, 0]
    heights = np.where(np.abs(x - 0.0061) < 0.0005, -np.inf, 0.0)
    alone = label(PAD, CONFIG, np.where(x < 0.0061, heights, -np.inf), everywhere(PAD))
    beside = label(PAD, CONFIG, heights, x < 0.0061)
    both = label(PAD, CONFIG, heights, everywhere(PAD))
    assert beside.pressure == pytest.approx(alone.pressure, rel=1e-12)
    assert beside.q == pytest.approx(alone.q, abs=1e-7)
    assert both.q > beside.q
    assert not beside.contact[x > 0.0061].any()


@pytest.mark.parametrize("radius_m", [0.04, 0.08, 0.3])
@pytest.mark.parametrize("shape", ["sphere", "cylinder"])
def test_area_and_wrench_of_curved_surfaces_by_quadrature(shape: str, radius_m: float) -> None:
    fine = build_pad(
        PadConfig(radius_step_rg=0.02, rotation_step_rad=2 * math.pi / 180, distance_step_rg=0.4)
    )
    heights = sphere(fine, radius_m) if shape == "sphere" else cylinder(fine, radius_m)
    contact = contact_on(fine, heights)
    assert len(contact.triangles) == len(fine.triangles)

    def stretch(r: float, angle: float) -> float:
        """Area of the surface over area of its projection, 1 / n_z."""
        across = r if shape == "sphere" else r * math.cos(angle)
        return radius_m / math.sqrt(radius_m**2 - across**2)

    area, _ = dblquad(lambda r, a: r * stretch(r, a), 0, 2 * math.pi, 0, 0.025)
    # The grid is an inscribed polygon of chords: both errors fall with its step squared.
    assert contact.areas_m2.sum() == pytest.approx(area, rel=1e-3)
    force = vacuum_force(fine, contact)
    assert force == pytest.approx(area / (math.pi * 0.025**2), rel=1e-3)
    # One quadrant of the pad, where symmetry cancels nothing: f_x and tau_z of Eq. (3), (6).
    matrix = wrench_matrix(fine, contact, 0.5)
    quadrant = (contact.centres_m[:, :2] > 0).all(axis=1)

    def pull_x(r: float, angle: float) -> float:
        return 1.5 * r * math.cos(angle) / radius_m * stretch(r, angle)

    def pull_y(r: float, angle: float) -> float:
        bend = r * math.sin(angle) / radius_m * stretch(r, angle)
        return 1.5 * bend if shape == "sphere" else 0.0

    def torque(r: float, angle: float) -> float:
        return r * math.cos(angle) * pull_y(r, angle) - r * math.sin(angle) * pull_x(r, angle)

    whole = math.pi * 0.025**2
    f_x, _ = dblquad(lambda r, a: r * pull_x(r, a), 0, math.pi / 2, 0, 0.025)
    tau, _ = dblquad(lambda r, a: r * torque(r, a), 0, math.pi / 2, 0, 0.025)
    found = matrix[:, quadrant].sum(axis=1)
    assert found[0] == pytest.approx(f_x / whole, rel=2e-3)
    assert found[3] == pytest.approx(tau / (whole * 0.025), rel=2e-3, abs=1e-4)
    assert matrix.sum(axis=1) == pytest.approx([0, 0, 1, 0], abs=1e-9)


@pytest.mark.parametrize(
    ("pad_config", "equal_areas"),
    [
        (PadConfig(), False),
        (PadConfig(radius_step_rg=1.2, seal_radius_rg=1, distance_step_rg=1.2), True),
    ],
)
def test_the_tilt_at_which_eq_8_cannot_be_met(pad_config: PadConfig, equal_areas: bool) -> None:
    """|F_x| = (1+mu) p tan(a) S and F_v = p A / cos(a), with S = sum w_j A0_j.

    Eq. (8) can be met up to sin(a) = (sqrt(3)/3) mu / (1+mu) * A / min S; where all
    triangles have one area, S = A whatever W.
    """
    pad = build_pad(pad_config)
    config = GripperConfig(pad=pad_config)
    area = pad.area_m2
    least = -extreme_sum(-pad.areas_m2, config.weight_spread)
    sine = math.sqrt(3) / 3 * 0.5 / 1.5 * area / least
    if equal_areas:
        assert least == pytest.approx(area, rel=1e-12)
    limit = math.asin(sine)
    under = label(pad, config, tilted(pad, limit - 1e-6), everywhere(pad))
    over = label(pad, config, tilted(pad, limit + 1e-6), everywhere(pad))
    assert under.pressure == pytest.approx(1.0)
    assert over.pressure == pytest.approx(1.0)
    assert under.status is GraspStatus.SOLVED
    assert under.q > 0.2
    assert over.status is GraspStatus.INFEASIBLE
    assert over.q == 0.0
    assert over.slacks.min() < 0.0


def test_contact_outside_the_seal_region_holds_nothing() -> None:
    heights = plane(PAD)
    heights[: 1 + 10 * PAD.sectors] = -np.inf
    result = label(PAD, CONFIG, heights, everywhere(PAD))
    assert result.status is GraspStatus.SOLVED
    assert result.pressure == 0.0
    assert result.q == pytest.approx(0.01, rel=1e-12)


def test_a_single_contact_triangle_is_solved_by_hand() -> None:
    heights = np.full(586, -np.inf)
    heights[PAD.triangles[0]] = 0.0
    result = label(PAD, CONFIG, heights, everywhere(PAD))
    share = PAD.areas_m2[0] / PAD.seal_area_m2
    force = share**2 * PAD.areas_m2[0] / PAD.area_m2
    assert result.wrench[2] == pytest.approx(force, rel=1e-9)
    assert result.weights.least == result.weights.greatest == 1.0


def bumpy(seed: int, pad: Pad) -> np.ndarray:
    """A random smooth surface with a random edge, well off the pad's symmetry."""
    rng = np.random.default_rng(seed)
    x, y = (pad.vertices_xy_m / pad.radius_m).T
    a = rng.normal(scale=[2e-3, 2e-3, 2e-3, 2e-3, 2e-3, 5e-4])
    heights = a[0] * x + a[1] * y + a[2] * x * y - abs(a[3]) * x**2 - abs(a[4]) * y**2
    heights = heights + a[5] * np.sin(5 * x + 3 * y)
    heights[x * rng.normal() + y * rng.normal() > 0.4 + rng.random()] = -np.inf
    return np.asarray(heights)


def turned(heights: np.ndarray, pad: Pad, sectors: int) -> np.ndarray:
    """The scene turned about z by whole sectors."""
    disk = heights[1:].reshape(pad.rings, pad.sectors)
    return np.concatenate([heights[:1], np.roll(disk, sectors, axis=1).ravel()])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 44), st.floats(-2, 2))
def test_turning_the_scene_by_sectors_and_lifting_it_change_nothing(
    seed: int, sectors: int, lift_m: float
) -> None:
    heights = bumpy(seed, PAD)
    before = label(PAD, CONFIG, heights, everywhere(PAD))
    after = label(PAD, CONFIG, heights + lift_m, everywhere(PAD))
    assert after.status is before.status
    assert after.q == pytest.approx(before.q, abs=1e-6)
    assert after.pressure == pytest.approx(before.pressure, rel=1e-12)
    assert after.touch_height_m == pytest.approx(before.touch_height_m + lift_m, abs=1e-12)
    round_z = label(PAD, CONFIG, turned(heights, PAD, sectors), everywhere(PAD))
    assert round_z.pressure == pytest.approx(before.pressure, rel=1e-12)
    np.testing.assert_array_equal(turned(before.contact, PAD, sectors), round_z.contact)
    # Eq. (8) and (9) bound a square, which a turn maps onto itself by quarters alone:
    # q is the same wherever neither binds.
    sideways = [0, 1, 4, 5]
    if min(before.slacks[sideways].min(), round_z.slacks[sideways].min()) > 1e-4:
        assert round_z.q == pytest.approx(before.q, abs=1e-6)


QUARTERS = PadConfig(rotation_step_rad=math.pi / 16)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_quarter_turn_about_z_permutes_f_x_and_f_y(seed: int) -> None:
    pad = build_pad(QUARTERS)
    config = GripperConfig(pad=QUARTERS)
    heights = bumpy(seed, pad)
    before = label(pad, config, heights, everywhere(pad))
    after = label(pad, config, turned(heights, pad, pad.sectors // 4), everywhere(pad))
    assert after.status is before.status
    assert after.q == pytest.approx(before.q, abs=1e-6)
    if before.status is GraspStatus.SOLVED:
        f_x, f_y, f_z, t_z = before.wrench
        np.testing.assert_allclose(after.wrench, [-f_y, f_x, f_z, t_z], atol=1e-4)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.2, 20.0))
@example(seed=0, factor=1.3116142406590432)  # metres, rounded, gave this pad one ring more
def test_scaling_scene_and_pad_together_changes_nothing(seed: int, factor: float) -> None:
    scaled = CONFIG.pad.model_copy(update={"radius_m": CONFIG.pad.radius_m * factor})
    heights = bumpy(seed, PAD)
    before = label(PAD, CONFIG, heights, everywhere(PAD))
    pad = build_pad(scaled)
    after = label(pad, CONFIG.model_copy(update={"pad": scaled}), heights * factor, everywhere(pad))
    assert after.status is before.status
    assert after.q == pytest.approx(before.q, abs=1e-6)
    np.testing.assert_array_equal(after.contact, before.contact)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_renaming_contact_triangles_changes_nothing(seed: int) -> None:
    contact = contact_on(PAD, bumpy(seed, PAD))
    order = np.random.default_rng(seed).permutation(len(contact.triangles))
    renamed = Contact(
        contact.triangles[order],
        contact.areas_m2[order],
        contact.normals[order],
        contact.centres_m[order],
        contact.pressure,
    )
    problems = [quality_problem(PAD, CONFIG, one) for one in (contact, renamed)]
    answers = [structured.solve(problem) for problem in problems]
    assert answers[0].status is answers[1].status
    q = [quality_of(problem, answer) for problem, answer in zip(problems, answers, strict=True)]
    assert q[0] == pytest.approx(q[1], abs=1e-6)


def pressure_on(pad: Pad, heights: np.ndarray) -> np.ndarray:
    draped = drape(pad, heights[None])[0]
    touching = contact_vertices(pad, draped, heights, everywhere(pad))
    return triangle_pressure(pad, CONFIG, draped, touching)


def test_every_triangle_of_a_plane_pulls_with_p() -> None:
    # Every W whose F_z is 1 is optimal there; the solver's lies in their midst.
    np.testing.assert_allclose(pressure_on(PAD, plane(PAD)), 1.0, atol=1e-3)
    assert not pressure_on(PAD, np.full(586, -np.inf)).any()


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(1, 585), max_size=40))
def test_the_pull_of_flat_triangles_adds_up_to_f_z(holes: list[int]) -> None:
    heights = plane(PAD)
    heights[holes] = -np.inf
    result = label(PAD, CONFIG, heights, everywhere(PAD))
    pressure = pressure_on(PAD, heights)
    touching = result.contact[PAD.triangles].all(axis=1)
    assert not pressure[~touching].any()
    assert pressure @ PAD.areas_m2 / PAD.area_m2 == pytest.approx(result.wrench[2], abs=1e-6)
    deviation = np.abs(pressure[touching] - result.pressure)
    assert (deviation <= CONFIG.weight_spread * result.pressure + 1e-9).all()


def test_the_compiled_batch_is_the_reference_in_every_field() -> None:
    heights = np.stack([bumpy(seed, PAD) for seed in range(60)] + [np.full(586, np.nan)])
    rng = np.random.default_rng(0)
    on_target = rng.random(heights.shape) < 0.995
    batch = label_batch(PAD, CONFIG, heights, on_target)
    statuses = set()
    for row in range(len(batch)):
        fast = batch[row]
        slow = label_reference(PAD, CONFIG, heights[row], on_target[row])
        statuses.add(slow.status)
        assert fast.status is slow.status
        assert fast.q == pytest.approx(slow.q, abs=1e-9)
        assert fast.pressure == pytest.approx(slow.pressure, rel=1e-12)
        np.testing.assert_allclose(fast.wrench, slow.wrench, atol=1e-9)
        np.testing.assert_allclose(fast.slacks, slow.slacks, atol=1e-9)
        np.testing.assert_array_equal(fast.contact, slow.contact)
        assert fast.touch_height_m == slow.touch_height_m
    assert statuses == {GraspStatus.SOLVED, GraspStatus.INFEASIBLE, GraspStatus.NO_CONTACT}


def test_labels_do_not_depend_on_how_they_are_batched() -> None:
    heights = np.stack([bumpy(seed, PAD) for seed in range(37)])
    on_target = np.ones(heights.shape, dtype=np.bool_)
    together = label_batch(PAD, CONFIG, heights, on_target)
    apart = [label(PAD, CONFIG, one, mask) for one, mask in zip(heights, on_target, strict=True)]
    assert [one.q for one in apart] == together.q.tolist()
    np.testing.assert_array_equal(np.stack([one.wrench for one in apart]), together.wrench)


def test_a_problem_far_off_the_usual_scale_has_the_answer_of_another_solver() -> None:
    """Where the structured solver ends in rounding, as it may here, PIQP answers in its place."""
    pad_config = PadConfig(rotation_step_rad=0.0495 * math.pi)
    far_off = {
        "pad": pad_config,
        "friction": 5e-4,
        "weight_spread": 1e-4,
        "quality_scale": SCALE / 1000,
    }
    pad = build_pad(pad_config)
    heights = sphere(pad, 2.4 * pad.radius_m)
    found = label(pad, GripperConfig(**far_off), heights, everywhere(pad))
    other = label(pad, GripperConfig(**far_off, solver="clarabel"), heights, everywhere(pad))
    assert found.q == pytest.approx(other.q, abs=1e-6)
