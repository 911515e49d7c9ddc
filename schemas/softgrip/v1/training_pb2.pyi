from schemas.softgrip.v1 import tensor_pb2 as _tensor_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Epoch(_message.Message):
    __slots__ = ("epoch", "train_loss", "val_mae", "learning_rate", "train_mae")
    EPOCH_FIELD_NUMBER: _ClassVar[int]
    TRAIN_LOSS_FIELD_NUMBER: _ClassVar[int]
    VAL_MAE_FIELD_NUMBER: _ClassVar[int]
    LEARNING_RATE_FIELD_NUMBER: _ClassVar[int]
    TRAIN_MAE_FIELD_NUMBER: _ClassVar[int]
    epoch: int
    train_loss: float
    val_mae: float
    learning_rate: float
    train_mae: float
    def __init__(self, epoch: _Optional[int] = ..., train_loss: _Optional[float] = ..., val_mae: _Optional[float] = ..., learning_rate: _Optional[float] = ..., train_mae: _Optional[float] = ...) -> None: ...

class TrainingResult(_message.Message):
    __slots__ = ("layers", "channels", "parameters", "best_epoch", "test_mae", "mean_predictor_mae", "baseline_mae", "test_mae_by_class", "test_mae_by_tenth", "calibration", "test_quality", "test_prediction")
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
    def __init__(self, layers: _Optional[int] = ..., channels: _Optional[_Iterable[int]] = ..., parameters: _Optional[int] = ..., best_epoch: _Optional[int] = ..., test_mae: _Optional[float] = ..., mean_predictor_mae: _Optional[float] = ..., baseline_mae: _Optional[_Mapping[str, float]] = ..., test_mae_by_class: _Optional[_Mapping[str, float]] = ..., test_mae_by_tenth: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., calibration: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., test_quality: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ..., test_prediction: _Optional[_Union[_tensor_pb2.Tensor, _Mapping]] = ...) -> None: ...
