"""Clouds of planes with holes whose quality is known: samples to train on in seconds."""

import numpy as np

from pipeline.network.samples import GraspTensors

CELLS = 24
HALF_SIDE = 1.2  # in units of r_G
SEAL_RADIUS = 0.8  # r_v / r_G


def grid_xy(half_side: float = HALF_SIDE) -> tuple[np.ndarray, np.ndarray]:
    """x (grows with the column) and y (grows with the row) of the cells' centres."""
    step = 2 * half_side / CELLS
    centres = (np.arange(CELLS) + 0.5) * step - half_side
    x, y = np.meshgrid(centres, centres)
    return x, y


def planes_with_holes(count: int, seed: int) -> GraspTensors:
    """Tilted planes, each with a round hole; quality = (sealed share of Reg.V)², as in Eq. (2)."""
    rng = np.random.default_rng(seed)
    x, y = grid_xy()
    in_seal = np.hypot(x, y) <= SEAL_RADIUS
    cloud = np.empty((count, CELLS, CELLS, 3), dtype=np.float16)
    mask = np.empty((count, CELLS, CELLS), dtype=np.bool_)
    quality = np.empty(count, dtype=np.float32)
    for index in range(count):
        slope = rng.uniform(-0.2, 0.2, 2)
        centre = rng.uniform(-1.2, 1.2, 2)
        hole = np.hypot(x - centre[0], y - centre[1]) < rng.uniform(0.1, 1.0)
        z = slope[0] * x + slope[1] * y + rng.uniform(-0.5, 0.5) - 0.6 * hole
        z += rng.normal(0.0, 0.01, z.shape)
        cloud[index] = np.stack((x, y, z), axis=-1)
        # Half of the holes are deep enough that nothing is seen in them.
        mask[index] = ~hole if rng.random() < 0.5 else True
        quality[index] = (1.0 - hole[in_seal].mean()) ** 2
    return GraspTensors(cloud=cloud, mask=mask, quality=quality)
