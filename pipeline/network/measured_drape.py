"""The pad draped on the measured cells: S-1.07 on the organised cloud.

The label depends on where the pad lies on the surface, and a convolution learns that badly: one
high cell holds the pad off all that lies near it. The draped pad is therefore an input of the
network. On the cloud's own grid of square cells the definition of `pipeline.gripper.draping` reads

    z(v) = max over seen u of  z_s(u) - s d(u, v),

with d the octile distance (1 to a neighbour across an edge, √2 across a corner) and s the fall
a cell: Delta_d / Delta_r = 1, so the pad falls as far as it goes sideways. The pad reaches no
further down than H, which bounds how many cells a height is carried.
"""

import math

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional

from pipeline.config.grasps import CELL_SIDE
from pipeline.network.input_channels import NOTHING, REACH, SWEEPS


def draped_gap(z: Float[Tensor, "b h w"], seen: Bool[Tensor, "b h w"]) -> Float[Tensor, "b h w"]:
    """Height of the draped pad above each seen cell, in units of r_G; 0 where unseen.

    Parameters
    ----------
    z
        Heights of the cells in GCS, in units of r_G, shape (b, h, w).
    seen
        Cells that hold a measured point under the pad, shape (b, h, w); others do not hold the pad
        up.

    Returns
    -------
    z(v) - z_s(v) in [0, ``REACH``], shape (b, h, w): 0 in a cell that the pad lies on.
    """
    surface = torch.where(seen, z, NOTHING)
    draped = surface
    for _ in range(SWEEPS):
        draped = torch.maximum(draped, _carried(draped))
    return torch.where(seen, draped - surface, 0.0).clamp(max=REACH)


def _carried(z: Float[Tensor, "b h w"]) -> Float[Tensor, "b h w"]:
    """The height that the highest of the eight neighbours carries to each cell.

    Shifted maxima: forty times as fast on a CPU as max-pooling one channel.
    """
    padded = functional.pad(z, (1, 1, 1, 1), value=NOTHING)
    beside = torch.maximum(padded[:, :, :-2], padded[:, :, 2:])
    corner = torch.maximum(beside[:, :-2], beside[:, 2:])
    above = torch.maximum(padded[:, :-2, 1:-1], padded[:, 2:, 1:-1])
    edge = torch.maximum(beside[:, 1:-1], above)
    return torch.maximum(edge - CELL_SIDE, corner - math.sqrt(2.0) * CELL_SIDE)
