"""Labels in bulk: Algorithm 1, S-1.07 - S-1.12, compiled, many grasps a call.

The same computation as `quality.label_reference`, which stays its oracle. It runs as
kernels over a block of grasps: draping, then contact with pressure and wrench matrix, then
the QP, then the label. Workspaces belong to the block, so nothing is allocated per grasp.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.config.grasps import GripperConfig
from pipeline.gripper.compiled import compiled
from pipeline.gripper.draping import drape_into
from pipeline.gripper.limits import wrench_limit_ratios
from pipeline.gripper.pad import Pad
from pipeline.gripper.problem import GraspStatus
from pipeline.gripper.quality import GraspQuality, WeightSummary, label_reference, target_wrench
from pipeline.gripper.solvers.structured import solve_into

# Grasps whose wrench matrices (36 kB each) are held at a time: they stay in the L2 cache.
BLOCK = 16

_INFEASIBLE = int(GraspStatus.INFEASIBLE)
_NO_CONTACT = int(GraspStatus.NO_CONTACT)


@dataclass(frozen=True)
class LabelBatch:
    """`GraspQuality` of many grasps, one row a grasp.

    Attributes
    ----------
    q
        Grasp quality in [0, 1], S-1.12, shape (batch,).
    pressure
        p of Eq. (2) [1], shape (batch,).
    wrench
        GW, dimensionless, shape (batch, 4).
    slacks
        Slack of each limit of Eq. (8)-(11), as in `limits.limit_slacks`, shape (batch, 8).
    weights
        Least, greatest and root-mean-square deviation from 1 of W, shape (batch, 3).
    contact
        Whether each vertex of the pad is in contact with the target, shape (batch, vertices).
    touch_height_m
        Highest point of the scene under the pad [m], shape (batch,); -inf over nothing.
    status
        Values of `GraspStatus`, shape (batch,).
    iterations
        The solver's iterations, shape (batch,).
    """

    q: Float[np.ndarray, " batch"]
    pressure: Float[np.ndarray, " batch"]
    wrench: Float[np.ndarray, "batch 4"]
    slacks: Float[np.ndarray, "batch 8"]
    weights: Float[np.ndarray, "batch 3"]
    contact: Bool[np.ndarray, "batch vertices"]
    touch_height_m: Float[np.ndarray, " batch"]
    status: Int[np.ndarray, " batch"]
    iterations: Int[np.ndarray, " batch"]

    def __len__(self) -> int:
        return len(self.q)

    def take(self, chosen: Int[np.ndarray, " k"]) -> "LabelBatch":
        """The grasps at the given indices."""
        return LabelBatch(*(getattr(self, field.name)[chosen] for field in fields(self)))

    @staticmethod
    def join(parts: Sequence["LabelBatch"]) -> "LabelBatch":
        """Join several batches, in their order; at least one."""
        return LabelBatch(
            *(
                np.concatenate([getattr(part, field.name) for part in parts])
                for field in fields(LabelBatch)
            )
        )

    def __getitem__(self, index: int) -> GraspQuality:
        """One grasp of the batch."""
        return GraspQuality(
            q=float(self.q[index]),
            pressure=float(self.pressure[index]),
            wrench=self.wrench[index],
            slacks=self.slacks[index],
            weights=WeightSummary(*(float(value) for value in self.weights[index])),
            contact=self.contact[index],
            touch_height_m=float(self.touch_height_m[index]),
            status=GraspStatus(int(self.status[index])),
            iterations=int(self.iterations[index]),
        )


def label(
    pad: Pad,
    config: GripperConfig,
    heights_m: Float[np.ndarray, " vertices"],
    on_target: Bool[np.ndarray, " vertices"],
) -> GraspQuality:
    """Label one grasp; see `label_batch`."""
    return label_batch(pad, config, heights_m[None], on_target[None])[0]


def label_batch(
    pad: Pad,
    config: GripperConfig,
    heights_m: Float[np.ndarray, "batch vertices"],
    on_target: Bool[np.ndarray, "batch vertices"],
) -> LabelBatch:
    """Label many grasps with the solver that `config` names.

    Parameters
    ----------
    pad
        The pad in GCS.
    config
        Physics and solver.
    heights_m
        z_s, height of the scene under each vertex along z of each grasp's own GCS, from any
        origin [m], shape (batch, vertices); NaN or -inf where nothing is below.
    on_target
        Whether the object to be grasped lies under a vertex, shape (batch, vertices).

    Returns
    -------
    The labels, one row a grasp.

    Notes
    -----
    Compiled for the structured solver; any other runs the reference, grasp by grasp. So does PIQP
    where the structured solver ends in rounding and gives no number.
    """
    heights = np.ascontiguousarray(heights_m, dtype=np.float64)
    target_mask = np.ascontiguousarray(on_target, dtype=np.bool_)
    batch = empty_batch(len(heights), len(pad.vertices_xy_m))
    if config.solver != "structured":
        for row in range(len(heights)):
            _store(batch, row, label_reference(pad, config, heights[row], target_mask[row]))
        return batch
    lower, upper = wrench_limit_ratios(config.friction)
    target = target_wrench()
    size = min(BLOCK, max(len(heights), 1))
    draped = np.empty((size, len(pad.vertices_xy_m)))
    matrices = np.empty((size, 4, len(pad.triangles)))
    weights = np.empty((size, len(pad.triangles)))
    counts = np.empty(size, dtype=np.int64)
    forces = np.empty(size)
    for start in range(0, len(heights), size):
        rows = slice(start, min(start + size, len(heights)))
        used = rows.stop - start
        drape_into(
            heights[rows],
            pad.edges,
            pad.config.distance_step_m,
            pad.config.altitude_m,
            draped[:used],
        )
        assemble_into(
            heights[rows],
            target_mask[rows],
            draped[:used],
            pad.vertices_xy_m,
            pad.triangles,
            pad.areas_m2,
            pad.in_seal_region,
            pad.seal_area_m2,
            pad.area_m2,
            pad.radius_m,
            pad.config.contact_tolerance_m,
            config.friction,
            batch.contact[rows],
            batch.touch_height_m[rows],
            batch.pressure[rows],
            matrices[:used],
            counts[:used],
            forces[:used],
        )
        solve_into(
            matrices[:used],
            counts[:used],
            forces[:used],
            lower,
            upper,
            target,
            config.quality_scale,
            config.weight_spread,
            config.max_iterations,
            weights[:used],
            batch.status[rows],
            batch.iterations[rows],
        )
        _conclude_into(
            matrices[:used],
            counts[:used],
            forces[:used],
            weights[:used],
            lower,
            upper,
            target,
            config.quality_scale,
            batch.status[rows],
            batch.q[rows],
            batch.wrench[rows],
            batch.slacks[rows],
            batch.weights[rows],
        )
    # Problems a thousandfold off the usual scale may end the structured solver in rounding.
    for row in np.flatnonzero(~np.isfinite(batch.q)).tolist():
        careful = config.model_copy(update={"solver": "piqp-dense"})
        _store(batch, row, label_reference(pad, careful, heights[row], target_mask[row]))
    return batch


def empty_batch(rows: int, vertices: int) -> LabelBatch:
    """A batch of zeros for kernels to write into."""
    return LabelBatch(
        q=np.zeros(rows),
        pressure=np.zeros(rows),
        wrench=np.zeros((rows, 4)),
        slacks=np.zeros((rows, 8)),
        weights=np.zeros((rows, 3)),
        contact=np.zeros((rows, vertices), dtype=np.bool_),
        touch_height_m=np.zeros(rows),
        status=np.zeros(rows, dtype=np.int64),
        iterations=np.zeros(rows, dtype=np.int64),
    )


def _store(batch: LabelBatch, row: int, one: GraspQuality) -> None:
    batch.q[row] = one.q
    batch.pressure[row] = one.pressure
    batch.wrench[row] = one.wrench
    batch.slacks[row] = one.slacks
    batch.weights[row] = (one.weights.least, one.weights.greatest, one.weights.rms_deviation)
    batch.contact[row] = one.contact
    batch.touch_height_m[row] = one.touch_height_m
    batch.status[row] = int(one.status)
    batch.iterations[row] = one.iterations


@compiled
def assemble_into(
    heights: Float[np.ndarray, "batch vertices"],
    on_target: Bool[np.ndarray, "batch vertices"],
    draped: Float[np.ndarray, "batch vertices"],
    vertices_xy: Float[np.ndarray, "vertices 2"],
    triangles: Int[np.ndarray, "triangles 3"],
    areas: Float[np.ndarray, " triangles"],
    in_seal_region: Bool[np.ndarray, " triangles"],
    seal_area: float,
    pad_area: float,
    pad_radius: float,
    tolerance: float,
    friction: float,
    contact: Bool[np.ndarray, "batch vertices"],
    touch_height: Float[np.ndarray, " batch"],
    pressure: Float[np.ndarray, " batch"],
    matrices: Float[np.ndarray, "batch 4 triangles"],
    counts: Int[np.ndarray, " batch"],
    forces: Float[np.ndarray, " batch"],
) -> None:
    """S-1.08 - S-1.10: contact, p of Eq. (2), G of Eq. (3)-(6) and F_v of Eq. (7).

    As vertices move along z alone, A n_z is the undeformed area of a triangle, and
    A n_x, A n_y are it times minus the slope of the draped triangle.
    """
    for row in range(heights.shape[0]):
        z = draped[row]
        top = -np.inf
        for v in range(z.size):
            height = heights[row, v]
            hit = np.isfinite(height)
            if hit:
                top = max(top, height)
            contact[row, v] = hit and on_target[row, v] and z[v] - height <= tolerance
        touch_height[row] = top
        count = 0
        sealed = 0.0
        force = 0.0
        matrix = matrices[row]
        for t in range(triangles.shape[0]):
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            if not (contact[row, a] and contact[row, b] and contact[row, c]):
                continue
            if in_seal_region[t]:
                sealed += areas[t]
            x_1 = vertices_xy[b, 0] - vertices_xy[a, 0]
            y_1 = vertices_xy[b, 1] - vertices_xy[a, 1]
            z_1 = z[b] - z[a]
            x_2 = vertices_xy[c, 0] - vertices_xy[a, 0]
            y_2 = vertices_xy[c, 1] - vertices_xy[a, 1]
            z_2 = z[c] - z[a]
            area_n_x = 0.5 * (y_1 * z_2 - z_1 * y_2)
            area_n_y = 0.5 * (z_1 * x_2 - x_1 * z_2)
            area_n_z = areas[t]
            force += np.sqrt(area_n_x * area_n_x + area_n_y * area_n_y + area_n_z * area_n_z)
            c_x = (vertices_xy[a, 0] + vertices_xy[b, 0] + vertices_xy[c, 0]) / 3.0
            c_y = (vertices_xy[a, 1] + vertices_xy[b, 1] + vertices_xy[c, 1]) / 3.0
            f_x = (1.0 + friction) * area_n_x
            f_y = (1.0 + friction) * area_n_y
            matrix[0, count] = f_x
            matrix[1, count] = f_y
            matrix[2, count] = area_n_z
            matrix[3, count] = (c_x * f_y - c_y * f_x) / pad_radius
            count += 1
        p = min(sealed / seal_area, 1.0) ** 2
        for r in range(4):
            for j in range(count):
                matrix[r, j] *= p / pad_area
        counts[row] = count
        pressure[row] = p
        forces[row] = p * force / pad_area


@compiled
def _conclude_into(
    matrices: Float[np.ndarray, "batch 4 triangles"],
    counts: Int[np.ndarray, " batch"],
    forces: Float[np.ndarray, " batch"],
    weights: Float[np.ndarray, "batch triangles"],
    lower: Float[np.ndarray, " 4"],
    upper: Float[np.ndarray, " 4"],
    target: Float[np.ndarray, " 4"],
    scale: float,
    status: Int[np.ndarray, " batch"],
    q: Float[np.ndarray, " batch"],
    wrench: Float[np.ndarray, "batch 4"],
    slacks: Float[np.ndarray, "batch 8"],
    summary: Float[np.ndarray, "batch 3"],
) -> None:
    """S-1.12: GW, its slacks, the summary of W, and q."""
    for row in range(counts.size):
        n = counts[row]
        if n == 0:
            status[row] = _NO_CONTACT
            continue
        w = weights[row]
        least = np.inf
        greatest = -np.inf
        squares = 0.0
        for j in range(n):
            least = min(least, w[j])
            greatest = max(greatest, w[j])
            squares += (w[j] - 1.0) ** 2
        summary[row, 0] = least
        summary[row, 1] = greatest
        summary[row, 2] = np.sqrt(squares / n)
        # Four sums side by side: each adds in the order of the triangles, none waits for another.
        x = y = z = turn = 0.0
        for j in range(n):
            x += matrices[row, 0, j] * w[j]
            y += matrices[row, 1, j] * w[j]
            z += matrices[row, 2, j] * w[j]
            turn += matrices[row, 3, j] * w[j]
        wrench[row, 0], wrench[row, 1], wrench[row, 2], wrench[row, 3] = x, y, z, turn
        distance = 0.0
        for r in range(4):
            value = wrench[row, r]
            slacks[row, r] = forces[row] * upper[r] - value
            slacks[row, 4 + r] = value - forces[row] * lower[r]
            distance += (value - target[r]) ** 2
        q[row] = 0.0 if status[row] == _INFEASIBLE else np.exp(-scale * np.sqrt(distance))
