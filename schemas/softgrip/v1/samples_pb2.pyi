from schemas.softgrip.v1 import tensor_pb2 as _tensor_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class SampleBatch(_message.Message):
    __slots__ = ("cloud", "cloud_mask", "quality", "object_names", "object_index", "shape_class", "level", "pressure", "proposal_weight", "pictures")
    CLOUD_FIELD_NUMBER: _ClassVar[int]
    CLOUD_MASK_FIELD_NUMBER: _ClassVar[int]
    QUALITY_FIELD_NUMBER: _ClassVar[int]
    OBJECT_NAMES_FIELD_NUMBER: _ClassVar[int]
    OBJECT_INDEX_FIELD_NUMBER: _ClassVar[int]
    SHAPE_CLASS_FIELD_NUMBER: _ClassVar[int]
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    PRESSURE_FIELD_NUMBER: _ClassVar[int]
    PROPOSAL_WEIGHT_FIELD_NUMBER: _ClassVar[int]
    PICTURES_FIELD_NUMBER: _ClassVar[int]
    cloud: _tensor_pb2.Tensor
    cloud_mask: _tensor_pb2.Tensor
    quality: _tensor_pb2.Tensor
    object_names: _containers.RepeatedScalarFieldContainer[str]
    object_index: _tensor_pb2.Tensor
    shape_class: _tensor_pb2.Tensor
    level: _tensor_pb2.Tensor
    pressure: _tensor_pb2.Tensor
    proposal_weight: _tensor_pb2.Tensor
    pictures: _tensor_pb2.Tensor
    def __init__(self, cloud: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., cloud_mask: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., quality: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., object_names: _Optional[_Iterable[str]] = ..., object_index: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., shape_class: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., level: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., pressure: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., proposal_weight: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., pictures: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ...) -> None: ...
