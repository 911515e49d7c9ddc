"""Sifting decides a problem by a certificate, or leaves it to the interior-point method."""

from dataclasses import dataclass

import numpy as np
import pytest
from jaxtyping import Float, Int

from pipeline.gripper import GraspStatus, QpSolution, QualityProblem
from pipeline.gripper.quality import quality_of
from pipeline.gripper.solvers import certificate, interior_point, newton, sifting, structured
from tests.gripper.solvers.test_solvers import PAD, from_heights, made_up


@dataclass
class Sifted:
    """What `sift_into` makes of some problems."""

    matrices: Float[np.ndarray, "batch 4 most"]
    counts: Int[np.ndarray, " batch"]
    forces: Float[np.ndarray, " batch"]
    weights: Float[np.ndarray, "batch most"]
    status: Int[np.ndarray, " batch"]
    iterations: Int[np.ndarray, " batch"]
    rows: Float[np.ndarray, "batch 4 room"]
    columns: Int[np.ndarray, "batch room"]
    left: Int[np.ndarray, " batch"]
    centres: Float[np.ndarray, "batch 4"]
    sums: Float[np.ndarray, " batch"]
    bounded: np.ndarray


def setting(
    problem: QualityProblem,
) -> tuple[Float[np.ndarray, " 4"], Float[np.ndarray, " 4"], Float[np.ndarray, " 4"], float]:
    force = problem.vacuum_force
    return problem.lower / force, problem.upper / force, problem.target, problem.scale


def sifted(problems: list[QualityProblem]) -> Sifted:
    counts = np.array([problem.wrench_matrix.shape[1] for problem in problems])
    batch, most, room = len(problems), int(counts.max()), newton.ROOM
    made = Sifted(
        np.zeros((batch, 4, most)),
        counts,
        np.array([problem.vacuum_force for problem in problems]),
        np.ones((batch, most)),
        np.zeros(batch, dtype=np.int64),
        np.zeros(batch, dtype=np.int64),
        np.empty((batch, 4, room)),
        np.empty((batch, room), dtype=np.int64),
        np.zeros(batch, dtype=np.int64),
        np.empty((batch, 4)),
        np.empty(batch),
        np.empty((batch, 4), dtype=np.bool_),
    )
    for matrix, problem, count in zip(made.matrices, problems, counts, strict=True):
        matrix[:, :count] = problem.wrench_matrix
    rest = (made.rows, made.columns, made.left, made.centres, made.sums, made.bounded)
    given = (made.matrices, made.counts, made.forces, *setting(problems[0]))
    sifting.sift_into(*given, 0.1, 100, made.weights, made.status, made.iterations, *rest)
    return made


@pytest.fixture(scope="module")
def pads() -> list[QualityProblem]:
    """Pads on a plane, on cylinders and saddles that lean, and across edges."""
    x, y = PAD.vertices_xy_m.T
    rng = np.random.default_rng(3)
    heights = [np.zeros(len(x))]
    for bend in (2.0, 4.0, 8.0):
        for _ in range(8):
            lean = rng.normal(scale=0.15, size=2)
            heights.append(lean[0] * x + lean[1] * y - bend * (x**2 - rng.uniform(-1, 1) * y**2))
    heights += [np.where(x < at, 0.0, -np.inf) for at in (-0.01, 0.0, 0.015)]
    return from_heights(np.array(heights))


def by_interior_point(problem: QualityProblem) -> tuple[GraspStatus, float]:
    """Status and q by the interior-point method with all triangles, and no sifting."""
    rows = problem.wrench_matrix / problem.vacuum_force
    n = rows.shape[1]
    v, status, steps = np.zeros((1, n)), np.zeros(1, np.int64), np.zeros(1, np.int64)
    interior_point.solve_into(
        0.1 * (rows - rows.mean(axis=1, keepdims=True))[None],
        np.array([n]),
        rows.sum(axis=1)[None],
        np.zeros(1),
        np.ones((1, 4), dtype=np.bool_),
        np.array([problem.vacuum_force]),
        *setting(problem),
        100,
        np.ones(1, dtype=np.bool_),
        v,
        np.empty((1, 5)),
        status,
        steps,
    )
    solved = QpSolution(1.0 + 0.1 * v[0], GraspStatus(int(status[0])), int(steps[0]))
    return solved.status, quality_of(problem, solved)


def test_pads_are_decided_in_each_way(pads: list[QualityProblem]) -> None:
    """At once where the best wrench is reached, by a certificate, or with few triangles left."""
    made = sifted(pads)
    assert set(made.status) >= {interior_point.SOLVED, newton.SIFTED}
    assert made.status[0] == interior_point.SOLVED  # the plane
    few = made.status == newton.SIFTED
    assert (made.left[few] <= newton.ROOM).all()
    assert (made.left[few] < 0.5 * made.counts[few]).all()


def test_the_answer_is_that_of_the_interior_point_method_alone(pads: list[QualityProblem]) -> None:
    for problem in pads:
        ours = structured.solve(problem)
        status, q = by_interior_point(problem)
        assert ours.status is status
        assert quality_of(problem, ours) == pytest.approx(q, abs=1e-6)


def test_infeasible_problems_that_sifting_names_are_infeasible() -> None:
    problems = [made_up(seed) for seed in range(60)]
    named = np.flatnonzero(sifted(problems).status == interior_point.INFEASIBLE)
    assert len(named) > 3
    for i in named:
        assert by_interior_point(problems[i])[0] is GraspStatus.INFEASIBLE


def test_triangles_at_the_wrong_bound_are_not_certified(pads: list[QualityProblem]) -> None:
    """The same few triangles' answer is refused where multipliers ask for the other bound."""
    made = sifted(pads)
    found, multipliers = np.zeros((len(pads), newton.ROOM)), np.empty((len(pads), 5))
    verdict, steps = np.zeros((2, len(pads)), dtype=np.int64)
    interior_point.solve_into(
        made.rows,
        made.left,
        made.centres,
        made.sums,
        made.bounded,
        made.forces,
        *setting(pads[0]),
        100,
        made.status == newton.SIFTED,
        found,
        multipliers,
        verdict,
        steps,
    )
    for sign in (1.0, -1.0):
        status = made.status.copy()
        certificate.certify_into(
            made.matrices,
            made.counts,
            made.forces,
            *setting(pads[0])[2:],
            0.1,
            100,
            made.columns,
            made.left,
            found,
            sign * multipliers,
            verdict,
            steps,
            made.weights.copy(),
            status,
            made.iterations.copy(),
        )
        certified = status[made.status == newton.SIFTED] == interior_point.SOLVED
        assert certified.mean() > 0.7 if sign > 0 else not certified.any()


def test_weights_have_the_same_bytes_in_any_batch(pads: list[QualityProblem]) -> None:
    made = sifted(pads)
    together, status, steps = made.weights * 0, made.status * 0, made.iterations * 0
    given = (made.matrices, made.counts, made.forces, *setting(pads[0]), 0.1, 100)
    structured.solve_into(*given, together, status, steps)
    for i, problem in enumerate(pads):
        alone = structured.solve(problem)
        assert (alone.status, alone.iterations) == (status[i], steps[i])
        assert alone.weights.tobytes() == together[i, : made.counts[i]].tobytes()
