"""NumPy arrays in and out of softgrip.v1.Tensor."""

import math

import numpy as np

from pipeline.errors import ArtifactError
from schemas.softgrip.v1.tensor_pb2 import Tensor

DTYPES = ("b1", "u1", "u2", "u4", "u8", "i1", "i2", "i4", "i8", "f2", "f4", "f8")


def to_tensor(array: np.ndarray) -> Tensor:
    """Pack an array as little-endian bytes in C order.

    Raises
    ------
    ArtifactError : the dtype is not one of ``DTYPES``.
    """
    dtype = array.dtype.str[1:]
    if dtype not in DTYPES:
        raise ArtifactError(
            f"An array of dtype {array.dtype} cannot be stored", f"Use one of {', '.join(DTYPES)}"
        )
    little = np.ascontiguousarray(array, dtype=np.dtype("<" + dtype))
    return Tensor(dtype=dtype, shape=array.shape, data=little.tobytes())


def from_tensor(tensor: Tensor) -> np.ndarray:
    """A read-only view of the tensor's bytes; no copy, no loop.

    Raises
    ------
    ArtifactError : unknown dtype, or the bytes do not fill the declared shape.
    """
    if tensor.dtype not in DTYPES:
        raise ArtifactError(
            f"Tensor of unknown dtype '{tensor.dtype}'", "The file is damaged: make it again"
        )
    dtype = np.dtype("<" + tensor.dtype)
    shape = tuple(tensor.shape)
    declared = math.prod(shape) * dtype.itemsize
    if declared != len(tensor.data):
        raise ArtifactError(
            f"Tensor of shape {shape} and dtype {tensor.dtype} declares {declared} bytes "
            f"and holds {len(tensor.data)}",
            "The file is damaged: make it again",
        )
    return np.frombuffer(tensor.data, dtype=dtype).reshape(shape)
