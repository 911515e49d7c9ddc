from schemas.softgrip.v1 import tensor_pb2 as _tensor_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class LeftOut(_message.Message):
    __slots__ = ("reason", "contacts")
    REASON_FIELD_NUMBER: _ClassVar[int]
    CONTACTS_FIELD_NUMBER: _ClassVar[int]
    reason: str
    contacts: int
    def __init__(self, reason: _Optional[str] = ..., contacts: _Optional[int] = ...) -> None: ...

class RankedGrasps(_message.Message):
    __slots__ = ("frames", "ranking", "radius_m", "quality_min", "world_from_contact", "camera_from_contact", "quality", "roughness_m", "pixel", "instance", "world_from_support", "left_out")
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    RANKING_FIELD_NUMBER: _ClassVar[int]
    RADIUS_M_FIELD_NUMBER: _ClassVar[int]
    QUALITY_MIN_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_CONTACT_FIELD_NUMBER: _ClassVar[int]
    CAMERA_FROM_CONTACT_FIELD_NUMBER: _ClassVar[int]
    QUALITY_FIELD_NUMBER: _ClassVar[int]
    ROUGHNESS_M_FIELD_NUMBER: _ClassVar[int]
    PIXEL_FIELD_NUMBER: _ClassVar[int]
    INSTANCE_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_SUPPORT_FIELD_NUMBER: _ClassVar[int]
    LEFT_OUT_FIELD_NUMBER: _ClassVar[int]
    frames: _containers.RepeatedScalarFieldContainer[str]
    ranking: str
    radius_m: float
    quality_min: float
    world_from_contact: _tensor_pb2.Tensor
    camera_from_contact: _tensor_pb2.Tensor
    quality: _tensor_pb2.Tensor
    roughness_m: _tensor_pb2.Tensor
    pixel: _tensor_pb2.Tensor
    instance: _tensor_pb2.Tensor
    world_from_support: _tensor_pb2.Tensor
    left_out: _containers.RepeatedCompositeFieldContainer[LeftOut]
    def __init__(self, frames: _Optional[_Iterable[str]] = ..., ranking: _Optional[str] = ..., radius_m: _Optional[float] = ..., quality_min: _Optional[float] = ..., world_from_contact: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., camera_from_contact: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., quality: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., roughness_m: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., pixel: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., instance: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., world_from_support: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., left_out: _Optional[_Iterable[_Union[LeftOut, _Mapping]]] = ...) -> None: ...
