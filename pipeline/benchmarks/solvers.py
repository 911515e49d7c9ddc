"""The quality QP: milliseconds a problem, every solver on the same problems."""

import numpy as np
from jaxtyping import Bool, Float

from pipeline.benchmarks.clock import seconds_of
from pipeline.config.grasps import GripperConfig, SolverName
from pipeline.gripper.contact import contact_of
from pipeline.gripper.draping import contact_vertices, drape_reference
from pipeline.gripper.pad import Pad
from pipeline.gripper.problem import QualityProblem
from pipeline.gripper.quality import quality_problem
from pipeline.gripper.solvers import SOLVERS
from pipeline.labelling.heights import pad_heights
from pipeline.labelling.poses import ROUND
from pipeline.labelling.sampling import Candidates
from pipeline.world.raycasting import RayScene

PROBLEMS: dict[SolverName, int] = {"structured": 2000, "piqp-sparse": 200, "piqp-dense": 12}


def figures(problems: list[QualityProblem]) -> dict[str, object]:
    """The production solver against PIQP, sparse and dense, on the same problems, shuffled."""
    shuffled = list(problems)
    np.random.default_rng(2).shuffle(shuffled)
    times = milliseconds(shuffled, PROBLEMS)
    return {
        "qp_ms": {name: round(value, 4) for name, value in times.items()},
        "qp_speedup_vs_dense_piqp": round(times["piqp-dense"] / times["structured"], 1),
        "qp_speedup_vs_sparse_piqp": round(times["piqp-sparse"] / times["structured"], 1),
    }


def problems_under(
    pad: Pad,
    config: GripperConfig,
    surfaces: RayScene,
    candidates: Candidates,
    clearance_m: float,
) -> list[QualityProblem]:
    """The QPs of the candidates that touch anything.

    Parameters
    ----------
    pad
        The pad in GCS.
    config
        Contact physics and the QP.
    surfaces
        The scene's true surfaces.
    candidates
        On bodies of that scene.
    clearance_m
        Height of the rays' origins above the contact.

    Returns
    -------
    A problem a candidate, in their order, less those that touch nothing.
    """
    problems: list[QualityProblem] = []
    for start in range(0, len(candidates), ROUND):
        rows = slice(start, start + ROUND)
        frames = candidates.world_from_contact[rows]
        heights, below = pad_heights(frames, surfaces, pad, clearance_m)
        on_target = below == candidates.body_id[rows, None]
        problems += problems_of(pad, config, heights, on_target)
    return problems


def problems_of(
    pad: Pad,
    config: GripperConfig,
    heights_m: Float[np.ndarray, "n v"],
    on_target: Bool[np.ndarray, "n v"],
) -> list[QualityProblem]:
    """The QPs of the grasps that touch anything."""
    problems = []
    for heights, target in zip(heights_m, on_target, strict=True):
        draped = drape_reference(pad, heights)
        contact = contact_of(pad, draped, contact_vertices(pad, draped, heights, target))
        if contact.triangles.size:
            problems.append(quality_problem(pad, config, contact))
    return problems


def milliseconds(problems: list[QualityProblem], few: dict[SolverName, int]) -> dict[str, float]:
    """Milliseconds a problem by solver, on its first ``few[solver]`` problems, one call each."""
    figures: dict[str, float] = {}
    for name, count in few.items():
        chosen = problems[:count]
        solve = SOLVERS[name]
        solve(chosen[0])

        def solve_all(solve=solve, chosen=chosen) -> None:  # type: ignore[no-untyped-def]
            for problem in chosen:
                solve(problem)

        figures[name] = 1e3 * seconds_of(solve_all, 2) / len(chosen)
    return figures
