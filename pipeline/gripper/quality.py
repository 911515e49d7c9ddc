"""Grasp quality: from contact to the QP of Eq. (14), and from its optimum to q (S-1.12)."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from pipeline.config.grasps import GripperConfig
from pipeline.gripper.contact import Contact, contact_of
from pipeline.gripper.draping import contact_vertices, drape_reference
from pipeline.gripper.limits import limit_slacks, wrench_limits
from pipeline.gripper.pad import Pad
from pipeline.gripper.problem import GraspStatus, QpSolution, QualityProblem
from pipeline.gripper.solvers import SOLVERS
from pipeline.gripper.wrench import vacuum_force, wrench_matrix


@dataclass(frozen=True)
class WeightSummary:
    """W in three numbers: its extremes and its root-mean-square deviation from 1.

    The optimum GW is unique, W is not: which of its optima stands here is the solver's choice.
    """

    least: float
    greatest: float
    rms_deviation: float


@dataclass(frozen=True)
class GraspQuality:
    """The label of one grasp and what it rests on.

    Attributes
    ----------
    q
        Grasp quality in [0, 1]; 0 if infeasible or without contact.
    pressure
        p of Eq. (2) [1].
    wrench
        GW, dimensionless; at W = 1 where `status` is INFEASIBLE.
    slacks
        Room to each limit of Eq. (8)-(11), as in `limits.limit_slacks`.
    weights
        Summary of W.
    contact
        Which vertices of the pad are in contact with the target.
    touch_height_m
        Highest point of the scene under the pad, along z of the frame that the heights came in:
        there the flat pad touches first, and there is the origin of GCS. -inf over nothing.
    status, iterations
        The solver's.
    """

    q: float
    pressure: float
    wrench: Float[np.ndarray, " 4"]
    slacks: Float[np.ndarray, " 8"]
    weights: WeightSummary
    contact: Bool[np.ndarray, " vertices"]
    touch_height_m: float
    status: GraspStatus
    iterations: int


def target_wrench() -> Float[np.ndarray, " 4"]:
    """Lambda of S-1.12: the wrench of a full flat seal."""
    return np.array([0.0, 0.0, 1.0, 0.0])


def quality_problem(pad: Pad, config: GripperConfig, contact: Contact) -> QualityProblem:
    """Set up Eq. (14) for the contact triangles (S-1.09 - S-1.11)."""
    force = vacuum_force(pad, contact)
    lower, upper = wrench_limits(force, config.friction)
    return QualityProblem(
        wrench_matrix=wrench_matrix(pad, contact, config.friction),
        vacuum_force=force,
        lower=lower,
        upper=upper,
        target=target_wrench(),
        scale=config.quality_scale,
        weight_spread=config.weight_spread,
        max_iterations=config.max_iterations,
    )


def quality_of(problem: QualityProblem, solution: QpSolution) -> float:
    """q = exp(-|s (G W* - Lambda)|), S-1.12; 0 if the limits cannot be met."""
    if solution.status is GraspStatus.INFEASIBLE:
        return 0.0
    wrench = problem.wrench_matrix @ solution.weights
    return math.exp(-problem.scale * float(np.linalg.norm(wrench - problem.target)))


def triangle_pressure(
    pad: Pad,
    config: GripperConfig,
    draped_m: Float[np.ndarray, " vertices"],
    vertex_contact: Bool[np.ndarray, " vertices"],
) -> Float[np.ndarray, " triangles"]:
    """Pull on each triangle of a draped pad per area, over that of a full seal: p w_j [1].

    p is that of Eq. (2), w_j the optimum of Eq. (14). Where no W keeps the limits, w_j is 1.

    Parameters
    ----------
    pad
        The pad in GCS.
    config
        Physics and solver.
    draped_m
        z(v) of S-1.07, from any origin [m], shape (vertices,).
    vertex_contact
        Which vertices are in contact with the target, shape (vertices,).

    Returns
    -------
    p w_j of each triangle, shape (triangles,); 0 where a triangle is not in contact.
    """
    pressure = np.zeros(len(pad.triangles))
    contact = contact_of(pad, draped_m, vertex_contact)
    if contact.triangles.size:
        solution = SOLVERS[config.solver](quality_problem(pad, config, contact))
        pressure[contact.triangles] = contact.pressure * solution.weights
    return pressure


def label_reference(
    pad: Pad,
    config: GripperConfig,
    heights_m: Float[np.ndarray, " vertices"],
    on_target: Bool[np.ndarray, " vertices"],
) -> GraspQuality:
    """Algorithm 1, S-1.07 - S-1.12, step by step with the solver that `config` names.

    Parameters
    ----------
    pad
        The pad in GCS.
    config
        Physics and solver.
    heights_m
        z_s, height of the scene under each vertex along z of GCS, from any origin [m], shape
        (vertices,); NaN or -inf where nothing is below.
    on_target
        Whether the object to be grasped lies under a vertex, shape (vertices,).

    Returns
    -------
    The label.
    """
    draped = drape_reference(pad, heights_m)
    vertex_contact = contact_vertices(pad, draped, heights_m, on_target)
    finite = heights_m[np.isfinite(heights_m)]
    touch_height = float(finite.max()) if finite.size else -math.inf
    contact = contact_of(pad, draped, vertex_contact)
    if not contact.triangles.size:
        return GraspQuality(
            q=0.0,
            pressure=0.0,
            wrench=np.zeros(4),
            slacks=np.zeros(8),
            weights=WeightSummary(0.0, 0.0, 0.0),
            contact=vertex_contact,
            touch_height_m=touch_height,
            status=GraspStatus.NO_CONTACT,
            iterations=0,
        )
    problem = quality_problem(pad, config, contact)
    solution = SOLVERS[config.solver](problem)
    wrench = problem.wrench_matrix @ solution.weights
    deviation = solution.weights - 1.0
    return GraspQuality(
        q=quality_of(problem, solution),
        pressure=contact.pressure,
        wrench=wrench,
        slacks=limit_slacks(wrench, problem.lower, problem.upper),
        weights=WeightSummary(
            least=float(solution.weights.min()),
            greatest=float(solution.weights.max()),
            rms_deviation=float(np.sqrt(np.mean(deviation**2))),
        ),
        contact=vertex_contact,
        touch_height_m=touch_height,
        status=solution.status,
        iterations=solution.iterations,
    )
