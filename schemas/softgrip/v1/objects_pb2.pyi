from schemas.softgrip.v1 import tensor_pb2 as _tensor_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class TriangleMesh(_message.Message):
    __slots__ = ("vertices_m", "faces")
    VERTICES_M_FIELD_NUMBER: _ClassVar[int]
    FACES_FIELD_NUMBER: _ClassVar[int]
    vertices_m: _tensor_pb2.Tensor
    faces: _tensor_pb2.Tensor
    def __init__(self, vertices_m: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., faces: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ...) -> None: ...

class CatalogueObject(_message.Message):
    __slots__ = ("name", "split", "source", "source_sha256", "unit", "unit_origin", "repairs", "scale", "extent_m", "area_m2", "volume_m3", "nsvr", "shape_class", "mass_kg", "inertia_kg_m2", "mesh", "convex_parts", "material", "stretch", "family", "copies", "key")
    NAME_FIELD_NUMBER: _ClassVar[int]
    SPLIT_FIELD_NUMBER: _ClassVar[int]
    SOURCE_FIELD_NUMBER: _ClassVar[int]
    SOURCE_SHA256_FIELD_NUMBER: _ClassVar[int]
    UNIT_FIELD_NUMBER: _ClassVar[int]
    UNIT_ORIGIN_FIELD_NUMBER: _ClassVar[int]
    REPAIRS_FIELD_NUMBER: _ClassVar[int]
    SCALE_FIELD_NUMBER: _ClassVar[int]
    EXTENT_M_FIELD_NUMBER: _ClassVar[int]
    AREA_M2_FIELD_NUMBER: _ClassVar[int]
    VOLUME_M3_FIELD_NUMBER: _ClassVar[int]
    NSVR_FIELD_NUMBER: _ClassVar[int]
    SHAPE_CLASS_FIELD_NUMBER: _ClassVar[int]
    MASS_KG_FIELD_NUMBER: _ClassVar[int]
    INERTIA_KG_M2_FIELD_NUMBER: _ClassVar[int]
    MESH_FIELD_NUMBER: _ClassVar[int]
    CONVEX_PARTS_FIELD_NUMBER: _ClassVar[int]
    MATERIAL_FIELD_NUMBER: _ClassVar[int]
    STRETCH_FIELD_NUMBER: _ClassVar[int]
    FAMILY_FIELD_NUMBER: _ClassVar[int]
    COPIES_FIELD_NUMBER: _ClassVar[int]
    KEY_FIELD_NUMBER: _ClassVar[int]
    name: str
    split: str
    source: str
    source_sha256: str
    unit: str
    unit_origin: str
    repairs: _containers.RepeatedScalarFieldContainer[str]
    scale: float
    extent_m: float
    area_m2: float
    volume_m3: float
    nsvr: float
    shape_class: str
    mass_kg: float
    inertia_kg_m2: _tensor_pb2.Tensor
    mesh: TriangleMesh
    convex_parts: _containers.RepeatedCompositeFieldContainer[TriangleMesh]
    material: str
    stretch: _tensor_pb2.Tensor
    family: str
    copies: _containers.RepeatedScalarFieldContainer[str]
    key: str
    def __init__(self, name: _Optional[str] = ..., split: _Optional[str] = ..., source: _Optional[str] = ..., source_sha256: _Optional[str] = ..., unit: _Optional[str] = ..., unit_origin: _Optional[str] = ..., repairs: _Optional[_Iterable[str]] = ..., scale: _Optional[float] = ..., extent_m: _Optional[float] = ..., area_m2: _Optional[float] = ..., volume_m3: _Optional[float] = ..., nsvr: _Optional[float] = ..., shape_class: _Optional[str] = ..., mass_kg: _Optional[float] = ..., inertia_kg_m2: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., mesh: _Optional[_Union[TriangleMesh, _Mapping]] = ..., convex_parts: _Optional[_Iterable[_Union[TriangleMesh, _Mapping]]] = ..., material: _Optional[str] = ..., stretch: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., family: _Optional[str] = ..., copies: _Optional[_Iterable[str]] = ..., key: _Optional[str] = ...) -> None: ...

class RefusedMesh(_message.Message):
    __slots__ = ("source", "reason", "remedy")
    SOURCE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    REMEDY_FIELD_NUMBER: _ClassVar[int]
    source: str
    reason: str
    remedy: str
    def __init__(self, source: _Optional[str] = ..., reason: _Optional[str] = ..., remedy: _Optional[str] = ...) -> None: ...
