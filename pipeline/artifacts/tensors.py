"""NumPy arrays to softgrip.v1.Tensor and back."""

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from google.protobuf.message import Message

from pipeline.errors import ArtifactError, ContentError
from schemas.softgrip.v1.tensor_pb2 import Tensor

DTYPES = ("b1", "u1", "u2", "u4", "u8", "i1", "i2", "i4", "i8", "f2", "f4", "f8")
MOST_SIDES = 8  # twice as many as any tensor of ours has
LONGEST_SIDE = 2**40  # even of an empty array


def to_tensor(array: np.ndarray) -> Tensor:
    """Pack an array as little-endian bytes in C order.

    Parameters
    ----------
    array
        Any shape.

    Returns
    -------
    The message.

    Raises
    ------
    ArtifactError
        The dtype is not one of ``DTYPES``.
    """
    dtype = array.dtype.str[1:]
    if dtype not in DTYPES:
        raise ArtifactError(
            f"An array of dtype {array.dtype} cannot be stored", f"Use one of {', '.join(DTYPES)}"
        )
    little = np.ascontiguousarray(array, dtype=np.dtype("<" + dtype))
    return Tensor(dtype=dtype, shape=array.shape, data=little.tobytes())


def from_tensor(tensor: Tensor) -> np.ndarray:
    """View a tensor's bytes as an array, without a copy.

    Parameters
    ----------
    tensor
        The message.

    Returns
    -------
    A read-only array of the declared shape and dtype.

    Raises
    ------
    ContentError
        Unknown dtype, or the bytes do not fill the declared shape.
    """
    if tensor.dtype not in DTYPES:
        raise ContentError(f"Tensor of unknown dtype '{tensor.dtype}'")
    dtype = np.dtype("<" + tensor.dtype)
    shape = tuple(tensor.shape)
    declared = math.prod(shape) * dtype.itemsize
    if len(shape) > MOST_SIDES or max(shape, default=0) > LONGEST_SIDE:
        raise ContentError(f"Tensor of {len(shape)} sides, the longest {max(shape, default=0)}")
    if declared != len(tensor.data):
        raise ContentError(
            f"Tensor of shape {shape} and dtype {tensor.dtype} declares {declared} bytes "
            f"and holds {len(tensor.data)}"
        )
    return np.frombuffer(tensor.data, dtype=dtype).reshape(shape)


def set_tensors(
    message: Message, arrays: Mapping[str, np.ndarray], stored_as: Mapping[str, str]
) -> None:
    """Fill several tensors of a message, each converted to its dtype.

    Parameters
    ----------
    message
        The message to fill.
    arrays
        Field → array, for all fields of ``stored_as``; others are ignored.
    stored_as
        Field → dtype, such as ``f4``.
    """
    for name, dtype in stored_as.items():
        getattr(message, name).CopyFrom(to_tensor(arrays[name].astype(dtype)))


def tensors_of(
    message: Message,
    stored_as: Mapping[str, str],
    shapes: Mapping[str, str],
    unless_there: Mapping[str, float] = MappingProxyType({}),
) -> dict[str, np.ndarray]:
    """Read several tensors of a message and check their dtypes and shapes.

    Parameters
    ----------
    message
        The message.
    stored_as
        Field → dtype, such as ``f4``.
    shapes
        Field → sides such as ``"n g g 3"``; a letter is one length wherever it stands.
    unless_there
        Field that files of an older program lack → value that fills the array instead.

    Returns
    -------
    Field → read-only array as stored; fields that were filled are writable.

    Raises
    ------
    ContentError
        One has another dtype or shape.
    """
    arrays: dict[str, np.ndarray] = {}
    lengths: dict[str, int] = {}
    absent = [name for name in unless_there if not message.HasField(name)]
    for name, dtype in stored_as.items():
        if name in absent:
            continue
        array = arrays[name] = from_tensor(getattr(message, name))
        sides = shapes[name].split()
        fits = array.ndim == len(sides) and all(
            length == (int(side) if side.isdigit() else lengths.setdefault(side, length))
            for side, length in zip(sides, array.shape, strict=True)
        )
        if not fits or array.dtype != np.dtype("<" + dtype):
            raise ContentError(
                f"Tensor '{name}' is {array.dtype.str[1:]} of shape {array.shape}, "
                f"expected {dtype} of ({', '.join(sides)}) with {lengths or 'any length'}"
            )
    for name in absent:
        sides = shapes[name].split()
        shape = [int(side) if side.isdigit() else lengths[side] for side in sides]
        arrays[name] = np.full(shape, unless_there[name], dtype=np.dtype("<" + stored_as[name]))
    return arrays
