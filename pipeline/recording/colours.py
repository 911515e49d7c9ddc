"""Colours that mean the same in every recording, told apart by colour-blind eyes too."""

import numpy as np
from jaxtyping import Float, UInt8

# Okabe and Ito's eight, "Color Universal Design" (2008).
PALETTE = np.array(
    [
        [230, 159, 0],
        [86, 180, 233],
        [0, 158, 115],
        [240, 228, 66],
        [0, 114, 178],
        [213, 94, 0],
        [204, 121, 167],
        [153, 153, 153],
    ],
    dtype=np.uint8,
)
SHAPE_CLASS = {"basic": PALETTE[2], "typical": PALETTE[1], "complex": PALETTE[5]}
SPLIT = {"train": PALETTE[4], "val": PALETTE[0], "test": PALETTE[6]}

# Ends and middle of viridis (van der Walt and Smith, 2015), dark for 0 and bright for 1.
_SCALE = np.array(
    [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]], dtype=np.float64
)


def by_index(index: int) -> UInt8[np.ndarray, " 3"]:
    """A colour for the i-th of several things."""
    return np.asarray(PALETTE[index % len(PALETTE)])


def by_value(value: Float[np.ndarray, " n"]) -> UInt8[np.ndarray, "n 3"]:
    """Colours for values in [0, 1], such as a quality."""
    at = np.clip(np.nan_to_num(value), 0.0, 1.0) * (len(_SCALE) - 1)
    low = np.minimum(at.astype(np.int64), len(_SCALE) - 2)
    part = (at - low)[:, None]
    return np.asarray(_SCALE[low] * (1 - part) + _SCALE[low + 1] * part).astype(np.uint8)
