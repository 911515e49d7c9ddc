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
    """Solver → milliseconds a problem, on the first ``few[solver]`` problems, one call each."""
    figures: dict[str, float] = {}
    for name, count in few.items():
        chosen = problems[:count]
        solve = SOLVERS[name]
        solve(chosen[0])

        def all_of_them(solve=solve, chosen=chosen) -> None:  # type: ignore[no-untyped-def]
            for problem in chosen:
                solve(problem)

        figures[name] = 1e3 * seconds_of(all_of_them, 2) / len(chosen)
    return figures
