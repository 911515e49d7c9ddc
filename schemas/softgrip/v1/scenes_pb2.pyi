from schemas.softgrip.v1 import tensor_pb2 as _tensor_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class PlacedObject(_message.Message):
    __slots__ = ("object_name", "body_id", "world_from_object", "gap_m")
    OBJECT_NAME_FIELD_NUMBER: _ClassVar[int]
    BODY_ID_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_OBJECT_FIELD_NUMBER: _ClassVar[int]
    GAP_M_FIELD_NUMBER: _ClassVar[int]
    object_name: str
    body_id: int
    world_from_object: _tensor_pb2.Tensor
    gap_m: float
    def __init__(self, object_name: _Optional[str] = ..., body_id: _Optional[int] = ..., world_from_object: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., gap_m: _Optional[float] = ...) -> None: ...

class Viewpoint(_message.Message):
    __slots__ = ("name", "width_px", "height_px", "intrinsics", "world_from_camera", "sensor", "near_m", "far_m")
    NAME_FIELD_NUMBER: _ClassVar[int]
    WIDTH_PX_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_PX_FIELD_NUMBER: _ClassVar[int]
    INTRINSICS_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_CAMERA_FIELD_NUMBER: _ClassVar[int]
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    NEAR_M_FIELD_NUMBER: _ClassVar[int]
    FAR_M_FIELD_NUMBER: _ClassVar[int]
    name: str
    width_px: int
    height_px: int
    intrinsics: _tensor_pb2.Tensor
    world_from_camera: _tensor_pb2.Tensor
    sensor: str
    near_m: float
    far_m: float
    def __init__(self, name: _Optional[str] = ..., width_px: _Optional[int] = ..., height_px: _Optional[int] = ..., intrinsics: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., world_from_camera: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., sensor: _Optional[str] = ..., near_m: _Optional[float] = ..., far_m: _Optional[float] = ...) -> None: ...

class Scene(_message.Message):
    __slots__ = ("scene_id", "level", "shape_class", "distribution", "split", "seed", "objects", "contacts", "settle_time_s", "renderer", "viewpoints", "attempts", "key", "generator")
    SCENE_ID_FIELD_NUMBER: _ClassVar[int]
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    SHAPE_CLASS_FIELD_NUMBER: _ClassVar[int]
    DISTRIBUTION_FIELD_NUMBER: _ClassVar[int]
    SPLIT_FIELD_NUMBER: _ClassVar[int]
    SEED_FIELD_NUMBER: _ClassVar[int]
    OBJECTS_FIELD_NUMBER: _ClassVar[int]
    CONTACTS_FIELD_NUMBER: _ClassVar[int]
    SETTLE_TIME_S_FIELD_NUMBER: _ClassVar[int]
    RENDERER_FIELD_NUMBER: _ClassVar[int]
    VIEWPOINTS_FIELD_NUMBER: _ClassVar[int]
    ATTEMPTS_FIELD_NUMBER: _ClassVar[int]
    KEY_FIELD_NUMBER: _ClassVar[int]
    GENERATOR_FIELD_NUMBER: _ClassVar[int]
    scene_id: str
    level: int
    shape_class: str
    distribution: str
    split: str
    seed: int
    objects: _containers.RepeatedCompositeFieldContainer[PlacedObject]
    contacts: _tensor_pb2.Tensor
    settle_time_s: float
    renderer: str
    viewpoints: _containers.RepeatedCompositeFieldContainer[Viewpoint]
    attempts: int
    key: str
    generator: str
    def __init__(self, scene_id: _Optional[str] = ..., level: _Optional[int] = ..., shape_class: _Optional[str] = ..., distribution: _Optional[str] = ..., split: _Optional[str] = ..., seed: _Optional[int] = ..., objects: _Optional[_Iterable[_Union[PlacedObject, _Mapping]]] = ..., contacts: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., settle_time_s: _Optional[float] = ..., renderer: _Optional[str] = ..., viewpoints: _Optional[_Iterable[_Union[Viewpoint, _Mapping]]] = ..., attempts: _Optional[int] = ..., key: _Optional[str] = ..., generator: _Optional[str] = ...) -> None: ...
