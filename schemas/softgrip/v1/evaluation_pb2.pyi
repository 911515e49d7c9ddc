from schemas.softgrip.v1 import tensor_pb2 as _tensor_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Attempt(_message.Message):
    __slots__ = ("scene_id", "level", "attempt", "outcome", "cause", "target", "candidates", "predicted_quality", "reached_quality", "seal_pressure", "lifted_height_m", "duration_s", "world_from_gripper", "reached_pose", "time_s", "gripper_path", "object_paths", "base_wrench", "states", "policy", "candidate_poses", "candidate_quality", "corrections", "pictures", "regrasps", "joint_path", "seals", "carried_m_s2", "borne_n", "weight_n", "pressure", "seen", "contacts", "judge", "pad_radius_m", "ceilings_n", "target_body")
    SCENE_ID_FIELD_NUMBER: _ClassVar[int]
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    ATTEMPT_FIELD_NUMBER: _ClassVar[int]
    OUTCOME_FIELD_NUMBER: _ClassVar[int]
    CAUSE_FIELD_NUMBER: _ClassVar[int]
    TARGET_FIELD_NUMBER: _ClassVar[int]
    CANDIDATES_FIELD_NUMBER: _ClassVar[int]
    PREDICTED_QUALITY_FIELD_NUMBER: _ClassVar[int]
    REACHED_QUALITY_FIELD_NUMBER: _ClassVar[int]
    SEAL_PRESSURE_FIELD_NUMBER: _ClassVar[int]
    LIFTED_HEIGHT_M_FIELD_NUMBER: _ClassVar[int]
    DURATION_S_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_GRIPPER_FIELD_NUMBER: _ClassVar[int]
    REACHED_POSE_FIELD_NUMBER: _ClassVar[int]
    TIME_S_FIELD_NUMBER: _ClassVar[int]
    GRIPPER_PATH_FIELD_NUMBER: _ClassVar[int]
    OBJECT_PATHS_FIELD_NUMBER: _ClassVar[int]
    BASE_WRENCH_FIELD_NUMBER: _ClassVar[int]
    STATES_FIELD_NUMBER: _ClassVar[int]
    POLICY_FIELD_NUMBER: _ClassVar[int]
    CANDIDATE_POSES_FIELD_NUMBER: _ClassVar[int]
    CANDIDATE_QUALITY_FIELD_NUMBER: _ClassVar[int]
    CORRECTIONS_FIELD_NUMBER: _ClassVar[int]
    PICTURES_FIELD_NUMBER: _ClassVar[int]
    REGRASPS_FIELD_NUMBER: _ClassVar[int]
    JOINT_PATH_FIELD_NUMBER: _ClassVar[int]
    SEALS_FIELD_NUMBER: _ClassVar[int]
    CARRIED_M_S2_FIELD_NUMBER: _ClassVar[int]
    BORNE_N_FIELD_NUMBER: _ClassVar[int]
    WEIGHT_N_FIELD_NUMBER: _ClassVar[int]
    PRESSURE_FIELD_NUMBER: _ClassVar[int]
    SEEN_FIELD_NUMBER: _ClassVar[int]
    CONTACTS_FIELD_NUMBER: _ClassVar[int]
    JUDGE_FIELD_NUMBER: _ClassVar[int]
    PAD_RADIUS_M_FIELD_NUMBER: _ClassVar[int]
    CEILINGS_N_FIELD_NUMBER: _ClassVar[int]
    TARGET_BODY_FIELD_NUMBER: _ClassVar[int]
    scene_id: str
    level: int
    attempt: int
    outcome: str
    cause: str
    target: str
    candidates: int
    predicted_quality: float
    reached_quality: float
    seal_pressure: float
    lifted_height_m: float
    duration_s: float
    world_from_gripper: _tensor_pb2.Tensor
    reached_pose: _tensor_pb2.Tensor
    time_s: _tensor_pb2.Tensor
    gripper_path: _tensor_pb2.Tensor
    object_paths: _tensor_pb2.Tensor
    base_wrench: _tensor_pb2.Tensor
    states: _containers.RepeatedScalarFieldContainer[str]
    policy: str
    candidate_poses: _tensor_pb2.Tensor
    candidate_quality: _tensor_pb2.Tensor
    corrections: int
    pictures: _containers.RepeatedCompositeFieldContainer[DepthPicture]
    regrasps: int
    joint_path: _tensor_pb2.Tensor
    seals: int
    carried_m_s2: float
    borne_n: float
    weight_n: float
    pressure: _tensor_pb2.Tensor
    seen: _containers.RepeatedCompositeFieldContainer[DepthPicture]
    contacts: _containers.RepeatedCompositeFieldContainer[TriedContact]
    judge: str
    pad_radius_m: float
    ceilings_n: _tensor_pb2.Tensor
    target_body: int
    def __init__(self, scene_id: _Optional[str] = ..., level: _Optional[int] = ..., attempt: _Optional[int] = ..., outcome: _Optional[str] = ..., cause: _Optional[str] = ..., target: _Optional[str] = ..., candidates: _Optional[int] = ..., predicted_quality: _Optional[float] = ..., reached_quality: _Optional[float] = ..., seal_pressure: _Optional[float] = ..., lifted_height_m: _Optional[float] = ..., duration_s: _Optional[float] = ..., world_from_gripper: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., reached_pose: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., time_s: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., gripper_path: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., object_paths: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., base_wrench: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., states: _Optional[_Iterable[str]] = ..., policy: _Optional[str] = ..., candidate_poses: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., candidate_quality: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., corrections: _Optional[int] = ..., pictures: _Optional[_Iterable[_Union[DepthPicture, _Mapping]]] = ..., regrasps: _Optional[int] = ..., joint_path: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., seals: _Optional[int] = ..., carried_m_s2: _Optional[float] = ..., borne_n: _Optional[float] = ..., weight_n: _Optional[float] = ..., pressure: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., seen: _Optional[_Iterable[_Union[DepthPicture, _Mapping]]] = ..., contacts: _Optional[_Iterable[_Union[TriedContact, _Mapping]]] = ..., judge: _Optional[str] = ..., pad_radius_m: _Optional[float] = ..., ceilings_n: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., target_body: _Optional[int] = ...) -> None: ...

class TriedContact(_message.Message):
    __slots__ = ("world_from_contact", "predicted_quality", "held", "lifted", "cloud", "cloud_mask", "pictures")
    WORLD_FROM_CONTACT_FIELD_NUMBER: _ClassVar[int]
    PREDICTED_QUALITY_FIELD_NUMBER: _ClassVar[int]
    HELD_FIELD_NUMBER: _ClassVar[int]
    LIFTED_FIELD_NUMBER: _ClassVar[int]
    CLOUD_FIELD_NUMBER: _ClassVar[int]
    CLOUD_MASK_FIELD_NUMBER: _ClassVar[int]
    PICTURES_FIELD_NUMBER: _ClassVar[int]
    world_from_contact: _tensor_pb2.Tensor
    predicted_quality: float
    held: bool
    lifted: bool
    cloud: _tensor_pb2.Tensor
    cloud_mask: _tensor_pb2.Tensor
    pictures: int
    def __init__(self, world_from_contact: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., predicted_quality: _Optional[float] = ..., held: _Optional[bool] = ..., lifted: _Optional[bool] = ..., cloud: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., cloud_mask: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., pictures: _Optional[int] = ...) -> None: ...

class ProposedContacts(_message.Message):
    __slots__ = ("scene_id", "level", "split", "object_names", "world_from_contact", "object_index", "quality", "tilt_rad", "edge_rg", "value", "predicted", "worst", "worst_cloud", "worst_cloud_without_noise")
    class ValueEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: _tensor_pb2.Tensor
        def __init__(self, key: _Optional[str] = ..., value: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ...) -> None: ...
    class PredictedEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: _tensor_pb2.Tensor
        def __init__(self, key: _Optional[str] = ..., value: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ...) -> None: ...
    SCENE_ID_FIELD_NUMBER: _ClassVar[int]
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    SPLIT_FIELD_NUMBER: _ClassVar[int]
    OBJECT_NAMES_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_CONTACT_FIELD_NUMBER: _ClassVar[int]
    OBJECT_INDEX_FIELD_NUMBER: _ClassVar[int]
    QUALITY_FIELD_NUMBER: _ClassVar[int]
    TILT_RAD_FIELD_NUMBER: _ClassVar[int]
    EDGE_RG_FIELD_NUMBER: _ClassVar[int]
    VALUE_FIELD_NUMBER: _ClassVar[int]
    PREDICTED_FIELD_NUMBER: _ClassVar[int]
    WORST_FIELD_NUMBER: _ClassVar[int]
    WORST_CLOUD_FIELD_NUMBER: _ClassVar[int]
    WORST_CLOUD_WITHOUT_NOISE_FIELD_NUMBER: _ClassVar[int]
    scene_id: str
    level: int
    split: str
    object_names: _containers.RepeatedScalarFieldContainer[str]
    world_from_contact: _tensor_pb2.Tensor
    object_index: _tensor_pb2.Tensor
    quality: _tensor_pb2.Tensor
    tilt_rad: _tensor_pb2.Tensor
    edge_rg: _tensor_pb2.Tensor
    value: _containers.MessageMap[str, _tensor_pb2.Tensor]
    predicted: _containers.MessageMap[str, _tensor_pb2.Tensor]
    worst: _tensor_pb2.Tensor
    worst_cloud: _tensor_pb2.Tensor
    worst_cloud_without_noise: _tensor_pb2.Tensor
    def __init__(self, scene_id: _Optional[str] = ..., level: _Optional[int] = ..., split: _Optional[str] = ..., object_names: _Optional[_Iterable[str]] = ..., world_from_contact: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., object_index: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., quality: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., tilt_rad: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., edge_rg: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., value: _Optional[_Mapping[str, _tensor_pb2.Tensor]] = ..., predicted: _Optional[_Mapping[str, _tensor_pb2.Tensor]] = ..., worst: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., worst_cloud: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., worst_cloud_without_noise: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ...) -> None: ...

class RankedPrecision(_message.Message):
    __slots__ = ("ranking", "split", "scenes", "average_precision", "by_threshold", "judged")
    class ByThresholdEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: float
        def __init__(self, key: _Optional[str] = ..., value: _Optional[float] = ...) -> None: ...
    RANKING_FIELD_NUMBER: _ClassVar[int]
    SPLIT_FIELD_NUMBER: _ClassVar[int]
    SCENES_FIELD_NUMBER: _ClassVar[int]
    AVERAGE_PRECISION_FIELD_NUMBER: _ClassVar[int]
    BY_THRESHOLD_FIELD_NUMBER: _ClassVar[int]
    JUDGED_FIELD_NUMBER: _ClassVar[int]
    ranking: str
    split: str
    scenes: int
    average_precision: float
    by_threshold: _containers.ScalarMap[str, float]
    judged: float
    def __init__(self, ranking: _Optional[str] = ..., split: _Optional[str] = ..., scenes: _Optional[int] = ..., average_precision: _Optional[float] = ..., by_threshold: _Optional[_Mapping[str, float]] = ..., judged: _Optional[float] = ...) -> None: ...

class DepthPicture(_message.Message):
    __slots__ = ("camera", "depth_mm", "intrinsics", "world_from_camera", "step", "left_px", "top_px", "whole_width_px", "whole_height_px")
    CAMERA_FIELD_NUMBER: _ClassVar[int]
    DEPTH_MM_FIELD_NUMBER: _ClassVar[int]
    INTRINSICS_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_CAMERA_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    LEFT_PX_FIELD_NUMBER: _ClassVar[int]
    TOP_PX_FIELD_NUMBER: _ClassVar[int]
    WHOLE_WIDTH_PX_FIELD_NUMBER: _ClassVar[int]
    WHOLE_HEIGHT_PX_FIELD_NUMBER: _ClassVar[int]
    camera: str
    depth_mm: _tensor_pb2.Tensor
    intrinsics: _tensor_pb2.Tensor
    world_from_camera: _tensor_pb2.Tensor
    step: int
    left_px: int
    top_px: int
    whole_width_px: int
    whole_height_px: int
    def __init__(self, camera: _Optional[str] = ..., depth_mm: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., intrinsics: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., world_from_camera: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., step: _Optional[int] = ..., left_px: _Optional[int] = ..., top_px: _Optional[int] = ..., whole_width_px: _Optional[int] = ..., whole_height_px: _Optional[int] = ...) -> None: ...

class LevelResult(_message.Message):
    __slots__ = ("level", "attempts", "lifted", "objects", "clutters", "cleared", "success_rate", "interval_low", "interval_high", "failures", "policy", "seconds_a_pick", "picks_an_hour", "seals", "lifted_at_first_seal", "carried", "imperfection_scale", "liftable", "attempts_at_liftable", "lifted_unforeseen")
    class FailuresEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: int
        def __init__(self, key: _Optional[str] = ..., value: _Optional[int] = ...) -> None: ...
    class CarriedEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: int
        def __init__(self, key: _Optional[str] = ..., value: _Optional[int] = ...) -> None: ...
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    ATTEMPTS_FIELD_NUMBER: _ClassVar[int]
    LIFTED_FIELD_NUMBER: _ClassVar[int]
    OBJECTS_FIELD_NUMBER: _ClassVar[int]
    CLUTTERS_FIELD_NUMBER: _ClassVar[int]
    CLEARED_FIELD_NUMBER: _ClassVar[int]
    SUCCESS_RATE_FIELD_NUMBER: _ClassVar[int]
    INTERVAL_LOW_FIELD_NUMBER: _ClassVar[int]
    INTERVAL_HIGH_FIELD_NUMBER: _ClassVar[int]
    FAILURES_FIELD_NUMBER: _ClassVar[int]
    POLICY_FIELD_NUMBER: _ClassVar[int]
    SECONDS_A_PICK_FIELD_NUMBER: _ClassVar[int]
    PICKS_AN_HOUR_FIELD_NUMBER: _ClassVar[int]
    SEALS_FIELD_NUMBER: _ClassVar[int]
    LIFTED_AT_FIRST_SEAL_FIELD_NUMBER: _ClassVar[int]
    CARRIED_FIELD_NUMBER: _ClassVar[int]
    IMPERFECTION_SCALE_FIELD_NUMBER: _ClassVar[int]
    LIFTABLE_FIELD_NUMBER: _ClassVar[int]
    ATTEMPTS_AT_LIFTABLE_FIELD_NUMBER: _ClassVar[int]
    LIFTED_UNFORESEEN_FIELD_NUMBER: _ClassVar[int]
    level: int
    attempts: int
    lifted: int
    objects: int
    clutters: int
    cleared: int
    success_rate: float
    interval_low: float
    interval_high: float
    failures: _containers.ScalarMap[str, int]
    policy: str
    seconds_a_pick: float
    picks_an_hour: float
    seals: int
    lifted_at_first_seal: int
    carried: _containers.ScalarMap[str, int]
    imperfection_scale: float
    liftable: int
    attempts_at_liftable: int
    lifted_unforeseen: int
    def __init__(self, level: _Optional[int] = ..., attempts: _Optional[int] = ..., lifted: _Optional[int] = ..., objects: _Optional[int] = ..., clutters: _Optional[int] = ..., cleared: _Optional[int] = ..., success_rate: _Optional[float] = ..., interval_low: _Optional[float] = ..., interval_high: _Optional[float] = ..., failures: _Optional[_Mapping[str, int]] = ..., policy: _Optional[str] = ..., seconds_a_pick: _Optional[float] = ..., picks_an_hour: _Optional[float] = ..., seals: _Optional[int] = ..., lifted_at_first_seal: _Optional[int] = ..., carried: _Optional[_Mapping[str, int]] = ..., imperfection_scale: _Optional[float] = ..., liftable: _Optional[int] = ..., attempts_at_liftable: _Optional[int] = ..., lifted_unforeseen: _Optional[int] = ...) -> None: ...

class Comparison(_message.Message):
    __slots__ = ("policy", "baseline", "clutters", "success_rate", "baseline_success_rate", "p_paired", "p_fisher")
    POLICY_FIELD_NUMBER: _ClassVar[int]
    BASELINE_FIELD_NUMBER: _ClassVar[int]
    CLUTTERS_FIELD_NUMBER: _ClassVar[int]
    SUCCESS_RATE_FIELD_NUMBER: _ClassVar[int]
    BASELINE_SUCCESS_RATE_FIELD_NUMBER: _ClassVar[int]
    P_PAIRED_FIELD_NUMBER: _ClassVar[int]
    P_FISHER_FIELD_NUMBER: _ClassVar[int]
    policy: str
    baseline: str
    clutters: int
    success_rate: float
    baseline_success_rate: float
    p_paired: float
    p_fisher: float
    def __init__(self, policy: _Optional[str] = ..., baseline: _Optional[str] = ..., clutters: _Optional[int] = ..., success_rate: _Optional[float] = ..., baseline_success_rate: _Optional[float] = ..., p_paired: _Optional[float] = ..., p_fisher: _Optional[float] = ...) -> None: ...
