"""Each equation of the supplement by what follows from it alone, on contacts worked out by hand.

Numbers are written out, so that an equation computed otherwise fails here by its number. Steps of
Algorithm 1 have their tests beside what takes them (tests/labelling, tests/sensing).
"""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linprog

from pipeline.config import GripperConfig
from pipeline.gripper import GraspStatus, build_pad, label
from pipeline.gripper.contact import Contact, contact_of, pressure_of
from pipeline.gripper.draping import contact_vertices, drape
from pipeline.gripper.problem import QpSolution, QualityProblem
from pipeline.gripper.quality import quality_of, quality_problem
from pipeline.gripper.solvers import SOLVERS
from pipeline.gripper.wrench import vacuum_force, wrench_matrix
from tests.gripper.surfaces import everywhere, plane, tilted

ROOT = Path(__file__).resolve().parents[2]
CONFIG = GripperConfig()  # mu = 0.5, sigma_W = 0.1, s = ln 100
PAD = build_pad(CONFIG.pad)  # r_v = 20 mm, r_G = 25 mm

Vector = tuple[float, float, float]

AXES: list[Vector] = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]


def unit(n_x: float, n_y: float = 0.0) -> Vector:
    """A unit normal out of the object."""
    return n_x, n_y, math.sqrt(1.0 - n_x**2 - n_y**2)


def contact(
    normals: list[Vector],
    shares: list[float],
    centres: list[tuple[float, float]] | None = None,
    pressure: float = 1.0,
) -> Contact:
    """A contact of some triangles: areas are shares of A^G, centres are in units of r_G."""
    at = np.array(centres or [(0.0, 0.0)] * len(normals))
    return Contact(
        triangles=np.arange(len(normals)),
        areas_m2=PAD.area_m2 * np.array(shares),
        normals=np.array(normals),
        centres_m=PAD.radius_m * np.column_stack([at, np.zeros(len(at))]),
        pressure=pressure,
    )


def solved(touching: Contact) -> tuple[QualityProblem, QpSolution]:
    problem = quality_problem(PAD, CONFIG, touching)
    return problem, SOLVERS[CONFIG.solver](problem)


def can_be_met(touching: Contact) -> bool:
    status = solved(touching)[1].status
    assert status in (GraspStatus.SOLVED, GraspStatus.INFEASIBLE)
    return status is GraspStatus.SOLVED


SLANTED = contact([(0.48, 0.36, 0.8)], [0.1], [(0.4, -0.2)], pressure=0.5)


def test_eq_1_forces_lie_along_the_axes_of_gcs() -> None:
    along = [wrench_matrix(PAD, contact([n], [1.0]), 0.0)[:3, 0] for n in AXES]
    np.testing.assert_allclose(along, np.eye(3), atol=1e-15)


def test_eq_2_pressure_is_the_square_of_the_sealed_share_of_reg_v() -> None:
    radius = np.linalg.norm(PAD.vertices_xy_m[PAD.triangles], axis=2).max(axis=1)
    inner = np.flatnonzero(radius < 0.0101)  # a disc of 10 mm: a quarter of Reg.V
    assert pressure_of(PAD, inner) == pytest.approx(1 / 16, rel=1e-12)
    rim = np.flatnonzero(~PAD.in_seal_region)
    assert pressure_of(PAD, np.concatenate([inner, rim])) == pytest.approx(1 / 16, rel=1e-12)
    assert pressure_of(PAD, np.flatnonzero(PAD.in_seal_region)) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(("mu", "f_x"), [(0.0, 0.024), (0.5, 0.036), (1.0, 0.048)])
def test_eq_3_f_x(mu: float, f_x: float) -> None:
    assert wrench_matrix(PAD, SLANTED, mu)[0, 0] == pytest.approx(f_x, rel=1e-12)


@pytest.mark.parametrize(("mu", "f_y"), [(0.0, 0.018), (0.5, 0.027), (1.0, 0.036)])
def test_eq_4_f_y(mu: float, f_y: float) -> None:
    assert wrench_matrix(PAD, SLANTED, mu)[1, 0] == pytest.approx(f_y, rel=1e-12)


@pytest.mark.parametrize("mu", [0.0, 0.5, 1.0])
def test_eq_5_f_z_does_not_depend_on_friction(mu: float) -> None:
    assert wrench_matrix(PAD, SLANTED, mu)[2, 0] == pytest.approx(0.04, rel=1e-12)


def test_eq_6_the_torque_is_the_arm_cross_the_tangential_force() -> None:
    # 0.4 * 0.027 - (-0.2) * 0.036, in units of A^G r_G
    assert wrench_matrix(PAD, SLANTED, 0.5)[3, 0] == pytest.approx(0.018, rel=1e-12)


def test_eq_7_the_vacuum_force_is_over_the_deformed_area() -> None:
    touching = contact([unit(0.0), unit(0.6)], [0.1, 0.2], pressure=0.5)
    assert vacuum_force(PAD, touching) == pytest.approx(0.15, rel=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_eq_8_f_x_stays_within_its_share_of_f_v(sign: int) -> None:
    """(1 + mu) n_x against sqrt(3)/3 mu: n_x up to 0.19245."""
    assert can_be_met(contact([unit(sign * 0.192)], [0.5]))
    assert not can_be_met(contact([unit(sign * 0.193)], [0.5]))


@pytest.mark.parametrize("sign", [1, -1])
def test_eq_9_f_y_stays_within_its_share_of_f_v(sign: int) -> None:
    assert can_be_met(contact([unit(0.0, sign * 0.192)], [0.5]))
    assert not can_be_met(contact([unit(0.0, sign * 0.193)], [0.5]))


def test_eq_10_f_z_is_at_most_f_v() -> None:
    """More weight on the larger triangle would pull with 0.53 and be nearer to the target."""
    problem, solution = solved(contact([unit(0.0), unit(0.0)], [0.4, 0.1]))
    assert solution.status is GraspStatus.SOLVED
    assert (problem.wrench_matrix @ solution.weights)[2] == pytest.approx(0.5, abs=1e-7)
    assert not can_be_met(contact([(0.0, 0.0, -1.0)], [0.5]))  # F_z below nothing


@pytest.mark.parametrize("sign", [1, -1])
def test_eq_11_the_torque_stays_within_its_share_of_r_g_f_v(sign: int) -> None:
    """Two pulls in opposite directions at +-0.9 r_G: 0.9 (1 + mu) n_y up to sqrt(3)/3 mu."""

    def couple(n_y: float) -> Contact:
        normals = [unit(0.0, sign * n_y), unit(0.0, -sign * n_y)]
        return contact(normals, [0.25, 0.25], [(0.9, 0.0), (-0.9, 0.0)])

    assert can_be_met(couple(0.2136))
    assert not can_be_met(couple(0.2141))


def test_eq_12_the_weights_sum_to_their_number() -> None:
    """All weights at 1.005 would pull with F_v and be nearer to the target."""
    _, solution = solved(contact([unit(0.1), unit(-0.1)], [0.25, 0.25]))
    assert solution.status is GraspStatus.SOLVED
    assert solution.weights.sum() == pytest.approx(2.0, abs=1e-9)


def test_eq_13_no_weight_leaves_one_by_more_than_sigma() -> None:
    """The first triangle pulls aside three times as much: it gets as little as it may."""
    _, solution = solved(contact([unit(0.3), unit(-0.1)], [0.25, 0.25]))
    assert solution.status is GraspStatus.SOLVED
    np.testing.assert_allclose(solution.weights, [0.9, 1.1], atol=1e-6)


@pytest.mark.parametrize("angle_rad", [0.0, 0.05, 0.15, 0.19, 0.2, 0.25, 0.5])
def test_eq_14_an_answer_exists_where_a_linear_program_finds_one(angle_rad: float) -> None:
    """All limits as rows L W <= l and J W = n, written here from the equations."""
    heights = tilted(PAD, angle_rad)
    draped = drape(PAD, heights[None])[0]
    touching = contact_of(PAD, draped, contact_vertices(PAD, draped, heights, everywhere(PAD)))
    pull = touching.pressure * touching.areas_m2
    n_x, n_y, n_z = touching.normals.T
    side = 1.5 * pull * np.array([n_x, n_y])
    torque = touching.centres_m[:, 0] * side[1] - touching.centres_m[:, 1] * side[0]
    limit = math.sqrt(3) / 3 * 0.5 * pull.sum()
    rows = np.array([*side, torque / 0.025, -side[0], -side[1], -torque / 0.025])
    rows = np.array([*rows, pull * n_z, -pull * n_z]) / pull.sum()
    bounds = np.array([*[limit] * 6, pull.sum(), 0.0]) / pull.sum()
    count = len(pull)
    program = linprog(
        np.zeros(count),
        A_ub=rows,
        b_ub=bounds,
        A_eq=np.ones((1, count)),
        b_eq=[count],
        bounds=(0.9, 1.1),
    )
    found = label(PAD, CONFIG, heights, everywhere(PAD))
    assert (found.status is GraspStatus.SOLVED) == (program.status == 0)


def test_step_12_quality_falls_by_the_distance_to_a_full_seal() -> None:
    """s = ln 100: half of the target wrench missing is a tenth, all of it a hundredth."""
    full = label(PAD, CONFIG, plane(PAD), everywhere(PAD))
    assert full.q == pytest.approx(1.0, abs=1e-6)
    for share, q in ((0.5, 0.1), (0.25, 10**-1.5)):
        problem, solution = solved(contact([unit(0.0)], [share]))
        assert quality_of(problem, solution) == pytest.approx(q, rel=1e-6)


@pytest.mark.parametrize(
    "name",
    [
        *(f"Eq. ({number})" for number in range(1, 15)),
        *(f"S-1.{number:02d}" for number in range(1, 16)),
        *("A-1", "A-2", "A-3", "Table I", "Desample", "Disturb"),
    ],
)
def test_a_search_for_its_number_finds_it_as_readme_says(name: str) -> None:
    assert "named in the code" in (ROOT / "README.md").read_text()
    sources = [*(ROOT / "pipeline").rglob("*.py"), *(ROOT / "stages").glob("*.py")]
    assert any(name in path.read_text() for path in sources)
