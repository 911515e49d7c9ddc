from schemas.softgrip.v1 import tensor_pb2 as _tensor_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Epoch(_message.Message):
    __slots__ = ("epoch", "train_loss", "val_mae", "learning_rate", "train_mae", "samples")
    EPOCH_FIELD_NUMBER: _ClassVar[int]
    TRAIN_LOSS_FIELD_NUMBER: _ClassVar[int]
    VAL_MAE_FIELD_NUMBER: _ClassVar[int]
    LEARNING_RATE_FIELD_NUMBER: _ClassVar[int]
    TRAIN_MAE_FIELD_NUMBER: _ClassVar[int]
    SAMPLES_FIELD_NUMBER: _ClassVar[int]
    epoch: int
    train_loss: float
    val_mae: float
    learning_rate: float
    train_mae: float
    samples: int
    def __init__(self, epoch: _Optional[int] = ..., train_loss: _Optional[float] = ..., val_mae: _Optional[float] = ..., learning_rate: _Optional[float] = ..., train_mae: _Optional[float] = ..., samples: _Optional[int] = ...) -> None: ...

class TrainingResult(_message.Message):
    __slots__ = ("layers", "channels", "parameters", "best_epoch", "test_mae", "mean_predictor_mae", "baseline_mae", "test_mae_by_class", "test_mae_by_tenth", "calibration", "test_quality", "test_prediction", "val_mae", "test_mae_single", "test_count_by_class", "train_count", "val_count", "test_mae_as_proposed", "mean_predictor_mae_as_proposed", "baseline_mae_as_proposed", "test_mae_by_pictures", "fine_tuning")
    class BaselineMaeEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: float
        def __init__(self, key: _Optional[str] = ..., value: _Optional[float] = ...) -> None: ...
    class TestMaeByClassEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: float
        def __init__(self, key: _Optional[str] = ..., value: _Optional[float] = ...) -> None: ...
    class TestCountByClassEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: int
        def __init__(self, key: _Optional[str] = ..., value: _Optional[int] = ...) -> None: ...
    class BaselineMaeAsProposedEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: float
        def __init__(self, key: _Optional[str] = ..., value: _Optional[float] = ...) -> None: ...
    class TestMaeByPicturesEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: float
        def __init__(self, key: _Optional[str] = ..., value: _Optional[float] = ...) -> None: ...
    LAYERS_FIELD_NUMBER: _ClassVar[int]
    CHANNELS_FIELD_NUMBER: _ClassVar[int]
    PARAMETERS_FIELD_NUMBER: _ClassVar[int]
    BEST_EPOCH_FIELD_NUMBER: _ClassVar[int]
    TEST_MAE_FIELD_NUMBER: _ClassVar[int]
    MEAN_PREDICTOR_MAE_FIELD_NUMBER: _ClassVar[int]
    BASELINE_MAE_FIELD_NUMBER: _ClassVar[int]
    TEST_MAE_BY_CLASS_FIELD_NUMBER: _ClassVar[int]
    TEST_MAE_BY_TENTH_FIELD_NUMBER: _ClassVar[int]
    CALIBRATION_FIELD_NUMBER: _ClassVar[int]
    TEST_QUALITY_FIELD_NUMBER: _ClassVar[int]
    TEST_PREDICTION_FIELD_NUMBER: _ClassVar[int]
    VAL_MAE_FIELD_NUMBER: _ClassVar[int]
    TEST_MAE_SINGLE_FIELD_NUMBER: _ClassVar[int]
    TEST_COUNT_BY_CLASS_FIELD_NUMBER: _ClassVar[int]
    TRAIN_COUNT_FIELD_NUMBER: _ClassVar[int]
    VAL_COUNT_FIELD_NUMBER: _ClassVar[int]
    TEST_MAE_AS_PROPOSED_FIELD_NUMBER: _ClassVar[int]
    MEAN_PREDICTOR_MAE_AS_PROPOSED_FIELD_NUMBER: _ClassVar[int]
    BASELINE_MAE_AS_PROPOSED_FIELD_NUMBER: _ClassVar[int]
    TEST_MAE_BY_PICTURES_FIELD_NUMBER: _ClassVar[int]
    FINE_TUNING_FIELD_NUMBER: _ClassVar[int]
    layers: int
    channels: _containers.RepeatedScalarFieldContainer[int]
    parameters: int
    best_epoch: int
    test_mae: float
    mean_predictor_mae: float
    baseline_mae: _containers.ScalarMap[str, float]
    test_mae_by_class: _containers.ScalarMap[str, float]
    test_mae_by_tenth: _tensor_pb2.Tensor
    calibration: _tensor_pb2.Tensor
    test_quality: _tensor_pb2.Tensor
    test_prediction: _tensor_pb2.Tensor
    val_mae: float
    test_mae_single: float
    test_count_by_class: _containers.ScalarMap[str, int]
    train_count: int
    val_count: int
    test_mae_as_proposed: float
    mean_predictor_mae_as_proposed: float
    baseline_mae_as_proposed: _containers.ScalarMap[str, float]
    test_mae_by_pictures: _containers.ScalarMap[str, float]
    fine_tuning: FineTuning
    def __init__(self, layers: _Optional[int] = ..., channels: _Optional[_Iterable[int]] = ..., parameters: _Optional[int] = ..., best_epoch: _Optional[int] = ..., test_mae: _Optional[float] = ..., mean_predictor_mae: _Optional[float] = ..., baseline_mae: _Optional[_Mapping[str, float]] = ..., test_mae_by_class: _Optional[_Mapping[str, float]] = ..., test_mae_by_tenth: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., calibration: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., test_quality: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., test_prediction: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., val_mae: _Optional[float] = ..., test_mae_single: _Optional[float] = ..., test_count_by_class: _Optional[_Mapping[str, int]] = ..., train_count: _Optional[int] = ..., val_count: _Optional[int] = ..., test_mae_as_proposed: _Optional[float] = ..., mean_predictor_mae_as_proposed: _Optional[float] = ..., baseline_mae_as_proposed: _Optional[_Mapping[str, float]] = ..., test_mae_by_pictures: _Optional[_Mapping[str, float]] = ..., fine_tuning: _Optional[_Union[FineTuning, _Mapping]] = ...) -> None: ...

class FineTuning(_message.Message):
    __slots__ = ("own_before", "own_after", "released_before", "released_after", "released_grasps", "learnt_before", "learnt_after", "learnt_grasps")
    OWN_BEFORE_FIELD_NUMBER: _ClassVar[int]
    OWN_AFTER_FIELD_NUMBER: _ClassVar[int]
    RELEASED_BEFORE_FIELD_NUMBER: _ClassVar[int]
    RELEASED_AFTER_FIELD_NUMBER: _ClassVar[int]
    RELEASED_GRASPS_FIELD_NUMBER: _ClassVar[int]
    LEARNT_BEFORE_FIELD_NUMBER: _ClassVar[int]
    LEARNT_AFTER_FIELD_NUMBER: _ClassVar[int]
    LEARNT_GRASPS_FIELD_NUMBER: _ClassVar[int]
    own_before: float
    own_after: float
    released_before: float
    released_after: float
    released_grasps: int
    learnt_before: float
    learnt_after: float
    learnt_grasps: int
    def __init__(self, own_before: _Optional[float] = ..., own_after: _Optional[float] = ..., released_before: _Optional[float] = ..., released_after: _Optional[float] = ..., released_grasps: _Optional[int] = ..., learnt_before: _Optional[float] = ..., learnt_after: _Optional[float] = ..., learnt_grasps: _Optional[int] = ...) -> None: ...

class SweepNetwork(_message.Message):
    __slots__ = ("group", "variant", "layers", "channels", "seed", "parameters", "multiply_adds", "val_mae", "val_mae_spread", "test_mae", "test_mae_single", "test_mae_averaged", "test_mae_by_class", "best_epoch", "curve", "chosen", "of_run")
    class TestMaeByClassEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: float
        def __init__(self, key: _Optional[str] = ..., value: _Optional[float] = ...) -> None: ...
    GROUP_FIELD_NUMBER: _ClassVar[int]
    VARIANT_FIELD_NUMBER: _ClassVar[int]
    LAYERS_FIELD_NUMBER: _ClassVar[int]
    CHANNELS_FIELD_NUMBER: _ClassVar[int]
    SEED_FIELD_NUMBER: _ClassVar[int]
    PARAMETERS_FIELD_NUMBER: _ClassVar[int]
    MULTIPLY_ADDS_FIELD_NUMBER: _ClassVar[int]
    VAL_MAE_FIELD_NUMBER: _ClassVar[int]
    VAL_MAE_SPREAD_FIELD_NUMBER: _ClassVar[int]
    TEST_MAE_FIELD_NUMBER: _ClassVar[int]
    TEST_MAE_SINGLE_FIELD_NUMBER: _ClassVar[int]
    TEST_MAE_AVERAGED_FIELD_NUMBER: _ClassVar[int]
    TEST_MAE_BY_CLASS_FIELD_NUMBER: _ClassVar[int]
    BEST_EPOCH_FIELD_NUMBER: _ClassVar[int]
    CURVE_FIELD_NUMBER: _ClassVar[int]
    CHOSEN_FIELD_NUMBER: _ClassVar[int]
    OF_RUN_FIELD_NUMBER: _ClassVar[int]
    group: str
    variant: str
    layers: int
    channels: _containers.RepeatedScalarFieldContainer[int]
    seed: int
    parameters: int
    multiply_adds: int
    val_mae: float
    val_mae_spread: float
    test_mae: float
    test_mae_single: float
    test_mae_averaged: float
    test_mae_by_class: _containers.ScalarMap[str, float]
    best_epoch: int
    curve: _containers.RepeatedCompositeFieldContainer[Epoch]
    chosen: bool
    of_run: bool
    def __init__(self, group: _Optional[str] = ..., variant: _Optional[str] = ..., layers: _Optional[int] = ..., channels: _Optional[_Iterable[int]] = ..., seed: _Optional[int] = ..., parameters: _Optional[int] = ..., multiply_adds: _Optional[int] = ..., val_mae: _Optional[float] = ..., val_mae_spread: _Optional[float] = ..., test_mae: _Optional[float] = ..., test_mae_single: _Optional[float] = ..., test_mae_averaged: _Optional[float] = ..., test_mae_by_class: _Optional[_Mapping[str, float]] = ..., best_epoch: _Optional[int] = ..., curve: _Optional[_Iterable[_Union[Epoch, _Mapping]]] = ..., chosen: _Optional[bool] = ..., of_run: _Optional[bool] = ...) -> None: ...

class SweepBudget(_message.Message):
    __slots__ = ("train_samples", "val_samples", "test_samples", "epochs", "batch_size", "mean_predictor_mae")
    TRAIN_SAMPLES_FIELD_NUMBER: _ClassVar[int]
    VAL_SAMPLES_FIELD_NUMBER: _ClassVar[int]
    TEST_SAMPLES_FIELD_NUMBER: _ClassVar[int]
    EPOCHS_FIELD_NUMBER: _ClassVar[int]
    BATCH_SIZE_FIELD_NUMBER: _ClassVar[int]
    MEAN_PREDICTOR_MAE_FIELD_NUMBER: _ClassVar[int]
    train_samples: int
    val_samples: int
    test_samples: int
    epochs: int
    batch_size: int
    mean_predictor_mae: float
    def __init__(self, train_samples: _Optional[int] = ..., val_samples: _Optional[int] = ..., test_samples: _Optional[int] = ..., epochs: _Optional[int] = ..., batch_size: _Optional[int] = ..., mean_predictor_mae: _Optional[float] = ...) -> None: ...
