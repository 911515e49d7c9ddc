"""Arrays that raise ValueError when they are written to."""

import numpy as np
from jaxtyping import Shaped


def read_only(array: Shaped[np.ndarray, "..."]) -> Shaped[np.ndarray, "..."]:
    """A view of the same data that cannot be written to; the array itself stays as it was."""
    view = array.view()
    view.setflags(write=False)
    return view
