"""From a sample's cloud to the network's input, the same for training and for control.

**Symmetry.** The quality of a grasp depends on the surface's shape around the approach axis, seen
from the pad: it does not change

- when the cloud moves along the axis: draping (S-1.07) follows the surface wherever it lies. The
  input is *canonical* in this: z is measured from the surface at the middle of the pad, exactly;
- when the cloud turns about the axis or is mirrored in a plane through it: the pad is round, and
  Eq. (8)-(11) bound |F_x|, |F_y| and |T_z| alike in both senses. This is exact for a continuous
  pad under the eight turns and mirrors that map the square onto itself; for angles between
  quarter turns Eq. (8) and (9), a box and not a disk, make it approximate, and so does the pad's
  grid of 45 sectors. The eight are also those that map the cells of the grid onto cells, so
  training may draw one per sample at no loss, and prediction may average over them.

**Grid.** ``cloud[i, j]`` is the point measured in the cell of row i and column j: y grows with the
row, x grows with the column, both about equally spaced over a square around the contact.
"""

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from pipeline.config.grasps import CELL_SIDE
from pipeline.network.input_channels import (
    CHANNELS,
    CONTACT_GAP,
    PAD_RADIUS,
    REFERENCE_PART,
    Z_FINE_LIMIT,
    Z_LIMIT,
    Channels,
)
from pipeline.network.measured_drape import draped_gap


def network_input(
    cloud: Float[Tensor, "b h w 3"], mask: Bool[Tensor, "b h w"], channels: Channels = CHANNELS
) -> Float[Tensor, "b c h w"]:
    """Canonical input of GA-CNN.

    Parameters
    ----------
    cloud
        Points in GCS, in units of r_G; unseen cells may hold anything finite or not.
    mask
        Cells that hold a measured point.
    channels
        One of ``KNOWN_CHANNELS``: a network's own.

    Returns
    -------
    Channels in single precision, zero in unseen cells:

    - ``x``, ``y`` as measured; ``x_in_cell``, ``y_in_cell`` how far they are off the cell's
      middle, ±1 at its border, which tells where in the cell an edge runs;
    - ``z`` from the reference height, bounded to ±1.2 (H / r_G); ``z_fine`` the same bounded to
      ±0.16 and stretched to ±1;
    - ``radius``, the distance from the axis; ``seen``, 1;
    - ``pad_gap``, how far the pad draped on the cloud stays above (see `measured_drape`), in units
      of the fine channel, and ``pad_contact``, 1 where it touches; 0 where there is no pad.
      ``gap`` and ``contact`` are of a pad as large as the grid.
    """
    seen = mask.unsqueeze(-1)
    points = torch.where(seen, cloud.float(), 0.0)
    x, y, z = points.unbind(-1)
    z = torch.where(mask, z - reference_height(z, mask)[:, None, None], 0.0)
    radius = torch.sqrt(x * x + y * y)
    found = {
        "x": x,
        "y": y,
        "z": z.clamp(-Z_LIMIT, Z_LIMIT),
        "z_fine": z.clamp(-Z_FINE_LIMIT, Z_FINE_LIMIT) / Z_FINE_LIMIT,
        "radius": radius,
        "seen": mask.float(),
    }
    if "x_in_cell" in channels:
        middles = (torch.arange(z.shape[1], device=z.device) - (z.shape[1] - 1) / 2) * CELL_SIDE
        found["x_in_cell"] = torch.where(mask, (x - middles) / (CELL_SIDE / 2), 0.0)
        found["y_in_cell"] = torch.where(mask, (y - middles[:, None]) / (CELL_SIDE / 2), 0.0)
    for gap, contact, under in (
        ("pad_gap", "pad_contact", mask & (radius <= PAD_RADIUS)),
        ("gap", "contact", mask),
    ):
        if gap in channels:
            height = draped_gap(z, under)
            found[gap] = height / Z_FINE_LIMIT
            found[contact] = (under & (height <= CONTACT_GAP)).float()
    return torch.stack([found[name] for name in channels], dim=1)


def reference_height(z: Float[Tensor, "b h w"], mask: Bool[Tensor, "b h w"]) -> Float[Tensor, " b"]:
    """Median z of the cells seen in the middle third; of all seen cells where it is empty; or 0.

    A median, so that a small hole under the middle of the pad does not move it. Between two
    middle values the lower is taken: a measured one, whatever the order of the cells.
    """
    h, w = z.shape[1:]
    rows = slice(h // REFERENCE_PART, h - h // REFERENCE_PART)
    columns = slice(w // REFERENCE_PART, w - w // REFERENCE_PART)
    middle = _masked_median(z[:, rows, columns].flatten(1), mask[:, rows, columns].flatten(1))
    empty = ~mask[:, rows, columns].flatten(1).any(dim=1)
    if bool(empty.any()):
        middle = torch.where(empty, _masked_median(z.flatten(1), mask.flatten(1)), middle)
    return middle


def apply_symmetry(
    inputs: Float[Tensor, "b c h w"], elements: Int[Tensor, " b"], channels: Channels = CHANNELS
) -> Float[Tensor, "b c h w"]:
    """Turn and mirror canonical inputs, each by its own element of the square's symmetries.

    Element g < 4 turns the cloud by g quarter turns from x towards y; element 4 + g first mirrors
    it (x becomes -x) and then turns. Exact: cells are moved, x and y exchanged or negated.

    Parameters
    ----------
    inputs
        Canonical inputs on a square grid, shape (b, c, h, w) with h = w.
    elements
        Integers in [0, 8), shape (b,).
    channels
        Names of the c channels, one of ``KNOWN_CHANNELS``.

    Returns
    -------
    The turned and mirrored inputs, shape (b, c, h, w).
    """
    b, c, h, w = inputs.shape
    sources, matrices = _symmetry_tables(h, inputs.device)
    index = sources[elements][:, None, :].expand(b, c, h * w)
    moved = inputs.flatten(2).gather(2, index)
    vectors = channels.index("z")  # what stands before are pairs of components
    pairs = moved[:, :vectors].reshape(b, vectors // 2, 2, h * w)
    turned = torch.einsum("bij,bpjk->bpik", matrices[elements], pairs).flatten(1, 2)
    moved = torch.cat((turned, moved[:, vectors:]), dim=1)
    return moved.reshape(b, c, h, w)


def turn_batch(
    inputs: Float[Tensor, "b c h w"], element: int, channels: Channels = CHANNELS
) -> Float[Tensor, "b c h w"]:
    """Turn and mirror a whole batch by one element (see `apply_symmetry`), as a network reads it.

    Parameters
    ----------
    inputs
        Canonical inputs on a square grid, shape (b, c, h, w) with h = w.
    element
        In [0, 8); 0 leaves the inputs as they are.
    channels
        Names of the c channels, one of ``KNOWN_CHANNELS``.

    Returns
    -------
    The turned and mirrored inputs, shape (b, c, h, w), in memory with channels last.
    """
    if element:
        elements = torch.full((len(inputs),), element, device=inputs.device)
        inputs = apply_symmetry(inputs, elements, channels)
    return inputs.contiguous(memory_format=torch.channels_last)


def inverse_symmetry(elements: Int[Tensor, " b"]) -> Int[Tensor, " b"]:
    """Element that undoes each, shape (b,): the opposite turn; a mirrored one undoes itself."""
    return torch.where(elements < 4, (4 - elements) % 4, elements)


def _masked_median(values: Float[Tensor, "b n"], mask: Bool[Tensor, "b n"]) -> Float[Tensor, " b"]:
    """Lower median of each row's masked values; 0 where there is none."""
    ordered = torch.where(mask, values, torch.inf).sort(dim=1).values
    counts = mask.sum(dim=1)
    picked = ordered.gather(1, ((counts - 1).clamp(min=0) // 2)[:, None]).squeeze(1)
    return torch.where(counts > 0, picked, 0.0)


def _symmetry_tables(
    side: int, device: torch.device
) -> tuple[Int[Tensor, "8 cells"], Float[Tensor, "8 2 2"]]:
    """For each element: the cell each output cell is read from, and its 2×2 matrix on (x, y)."""
    cells = torch.arange(side * side, device=device).reshape(side, side)
    mirror = torch.tensor([[-1.0, 0.0], [0.0, 1.0]], device=device)
    quarter_turn = torch.tensor([[0.0, -1.0], [1.0, 0.0]], device=device)
    sources, matrices = [], []
    for mirrored in (False, True):
        # Columns run along x; with y along the rows, dims (1, 0) turn from x towards y.
        grid = cells.flip(1) if mirrored else cells
        matrix = mirror if mirrored else torch.eye(2, device=device)
        for turns in range(4):
            sources.append(torch.rot90(grid, turns, dims=(1, 0)).flatten())
            matrices.append(matrix)
            matrix = quarter_turn @ matrix
    return torch.stack(sources), torch.stack(matrices)
