from schemas.softgrip.v1 import tensor_pb2 as _tensor_pb2
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class CloudBatch(_message.Message):
    __slots__ = ("cells", "mask", "points", "height_bytes", "in_cell", "height_step", "in_cell_step", "cell_side")
    CELLS_FIELD_NUMBER: _ClassVar[int]
    MASK_FIELD_NUMBER: _ClassVar[int]
    POINTS_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_BYTES_FIELD_NUMBER: _ClassVar[int]
    IN_CELL_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_STEP_FIELD_NUMBER: _ClassVar[int]
    IN_CELL_STEP_FIELD_NUMBER: _ClassVar[int]
    CELL_SIDE_FIELD_NUMBER: _ClassVar[int]
    cells: int
    mask: _tensor_pb2.Tensor
    points: _tensor_pb2.Tensor
    height_bytes: _tensor_pb2.Tensor
    in_cell: _tensor_pb2.Tensor
    height_step: float
    in_cell_step: float
    cell_side: float
    def __init__(self, cells: _Optional[int] = ..., mask: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., points: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., height_bytes: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., in_cell: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., height_step: _Optional[float] = ..., in_cell_step: _Optional[float] = ..., cell_side: _Optional[float] = ...) -> None: ...
