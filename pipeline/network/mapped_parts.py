"""Parts of mapped files as values that travel between processes: the file's name and the place."""

import mmap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True)
class MappedPart:
    """An array within a file.

    Attributes
    ----------
    path
        The file.
    offset
        Where the array begins [bytes].
    dtype
        Of its numbers, as NumPy writes it.
    shape
        Of the array.
    """

    path: Path
    offset: int
    dtype: str
    shape: tuple[int, ...]

    def opened(self) -> np.memmap:
        """The array, mapped; writing to it changes no file."""
        return np.memmap(self.path, self.dtype, "c", self.offset, self.shape)


def mapped_part(array: np.ndarray) -> MappedPart | None:
    """Where an array lies in a file; None where it is in memory, or not in one piece.

    Parameters
    ----------
    array
        Mapped by NumPy, or a piece of such an array, or any other.

    Returns
    -------
    The place.
    """
    if not isinstance(array, np.memmap) or array.filename is None:
        return None
    whole: Any = array
    while isinstance(whole.base, np.ndarray):
        whole = whole.base
    if not isinstance(whole.base, mmap.mmap) or not array.flags.c_contiguous or not array.size:
        return None
    # A piece keeps the offset of the array that it was cut from; addresses tell its own.
    begins = np.frombuffer(whole.base, np.uint8).ctypes.data
    mapped_from = array.offset - array.offset % mmap.ALLOCATIONGRANULARITY
    offset = mapped_from + array.ctypes.data - begins
    return MappedPart(Path(array.filename), offset, array.dtype.str, array.shape)
