from schemas.softgrip.v1 import tensor_pb2 as _tensor_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class GraspBatch(_message.Message):
    __slots__ = ("scene_id", "viewpoint", "level", "split", "object_names", "object_index", "body_id", "world_from_gripper", "quality", "pressure", "wrench", "limit_slack", "limit_names", "weight_summary", "contact_mask", "pad_vertices", "status", "status_names", "iterations", "tilt_rad", "proposal", "proposal_names", "keep_probability", "cloud", "cloud_mask", "touch_height_m", "pictures", "key")
    SCENE_ID_FIELD_NUMBER: _ClassVar[int]
    VIEWPOINT_FIELD_NUMBER: _ClassVar[int]
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    SPLIT_FIELD_NUMBER: _ClassVar[int]
    OBJECT_NAMES_FIELD_NUMBER: _ClassVar[int]
    OBJECT_INDEX_FIELD_NUMBER: _ClassVar[int]
    BODY_ID_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_GRIPPER_FIELD_NUMBER: _ClassVar[int]
    QUALITY_FIELD_NUMBER: _ClassVar[int]
    PRESSURE_FIELD_NUMBER: _ClassVar[int]
    WRENCH_FIELD_NUMBER: _ClassVar[int]
    LIMIT_SLACK_FIELD_NUMBER: _ClassVar[int]
    LIMIT_NAMES_FIELD_NUMBER: _ClassVar[int]
    WEIGHT_SUMMARY_FIELD_NUMBER: _ClassVar[int]
    CONTACT_MASK_FIELD_NUMBER: _ClassVar[int]
    PAD_VERTICES_FIELD_NUMBER: _ClassVar[int]
    STATUS_FIELD_NUMBER: _ClassVar[int]
    STATUS_NAMES_FIELD_NUMBER: _ClassVar[int]
    ITERATIONS_FIELD_NUMBER: _ClassVar[int]
    TILT_RAD_FIELD_NUMBER: _ClassVar[int]
    PROPOSAL_FIELD_NUMBER: _ClassVar[int]
    PROPOSAL_NAMES_FIELD_NUMBER: _ClassVar[int]
    KEEP_PROBABILITY_FIELD_NUMBER: _ClassVar[int]
    CLOUD_FIELD_NUMBER: _ClassVar[int]
    CLOUD_MASK_FIELD_NUMBER: _ClassVar[int]
    TOUCH_HEIGHT_M_FIELD_NUMBER: _ClassVar[int]
    PICTURES_FIELD_NUMBER: _ClassVar[int]
    KEY_FIELD_NUMBER: _ClassVar[int]
    scene_id: str
    viewpoint: str
    level: int
    split: str
    object_names: _containers.RepeatedScalarFieldContainer[str]
    object_index: _tensor_pb2.Tensor
    body_id: _tensor_pb2.Tensor
    world_from_gripper: _tensor_pb2.Tensor
    quality: _tensor_pb2.Tensor
    pressure: _tensor_pb2.Tensor
    wrench: _tensor_pb2.Tensor
    limit_slack: _tensor_pb2.Tensor
    limit_names: _containers.RepeatedScalarFieldContainer[str]
    weight_summary: _tensor_pb2.Tensor
    contact_mask: _tensor_pb2.Tensor
    pad_vertices: int
    status: _tensor_pb2.Tensor
    status_names: _containers.RepeatedScalarFieldContainer[str]
    iterations: _tensor_pb2.Tensor
    tilt_rad: _tensor_pb2.Tensor
    proposal: _tensor_pb2.Tensor
    proposal_names: _containers.RepeatedScalarFieldContainer[str]
    keep_probability: _tensor_pb2.Tensor
    cloud: _tensor_pb2.Tensor
    cloud_mask: _tensor_pb2.Tensor
    touch_height_m: _tensor_pb2.Tensor
    pictures: _tensor_pb2.Tensor
    key: str
    def __init__(self, scene_id: _Optional[str] = ..., viewpoint: _Optional[str] = ..., level: _Optional[int] = ..., split: _Optional[str] = ..., object_names: _Optional[_Iterable[str]] = ..., object_index: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., body_id: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., world_from_gripper: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., quality: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., pressure: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., wrench: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., limit_slack: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., limit_names: _Optional[_Iterable[str]] = ..., weight_summary: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., contact_mask: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., pad_vertices: _Optional[int] = ..., status: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., status_names: _Optional[_Iterable[str]] = ..., iterations: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., tilt_rad: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., proposal: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., proposal_names: _Optional[_Iterable[str]] = ..., keep_probability: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., cloud: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., cloud_mask: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., touch_height_m: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., pictures: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., key: _Optional[str] = ...) -> None: ...

class DrapedPads(_message.Message):
    __slots__ = ("grasp", "height_m", "pressure")
    GRASP_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_M_FIELD_NUMBER: _ClassVar[int]
    PRESSURE_FIELD_NUMBER: _ClassVar[int]
    grasp: _tensor_pb2.Tensor
    height_m: _tensor_pb2.Tensor
    pressure: _tensor_pb2.Tensor
    def __init__(self, grasp: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., height_m: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., pressure: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ...) -> None: ...

class ShardEntry(_message.Message):
    __slots__ = ("path", "sha256", "samples", "split")
    PATH_FIELD_NUMBER: _ClassVar[int]
    SHA256_FIELD_NUMBER: _ClassVar[int]
    SAMPLES_FIELD_NUMBER: _ClassVar[int]
    SPLIT_FIELD_NUMBER: _ClassVar[int]
    path: str
    sha256: str
    samples: int
    split: str
    def __init__(self, path: _Optional[str] = ..., sha256: _Optional[str] = ..., samples: _Optional[int] = ..., split: _Optional[str] = ...) -> None: ...

class ShardIndex(_message.Message):
    __slots__ = ("shards", "samples", "quality_histogram")
    SHARDS_FIELD_NUMBER: _ClassVar[int]
    SAMPLES_FIELD_NUMBER: _ClassVar[int]
    QUALITY_HISTOGRAM_FIELD_NUMBER: _ClassVar[int]
    shards: _containers.RepeatedCompositeFieldContainer[ShardEntry]
    samples: int
    quality_histogram: _tensor_pb2.Tensor
    def __init__(self, shards: _Optional[_Iterable[_Union[ShardEntry, _Mapping]]] = ..., samples: _Optional[int] = ..., quality_histogram: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ...) -> None: ...
