"""A training's curve and figures → softgrip.v1.Epoch and TrainingResult."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from pipeline.artifacts.tensors import to_tensor
from pipeline.network.held_out import TestFigures
from pipeline.network.resuming import EpochMetrics
from pipeline.network.training import TrainedNetwork
from schemas.softgrip.v1.training_pb2 import Epoch, TrainingResult

CHECKPOINT = "ga_cnn.safetensors"
EXPORT = "ga_cnn.onnx"


def epoch_message(metrics: EpochMetrics) -> Epoch:
    """The message of one epoch."""
    return Epoch(
        epoch=metrics.epoch,
        train_loss=metrics.train_loss,
        train_mae=metrics.train_mae,
        val_mae=metrics.val_mae,
        learning_rate=metrics.learning_rate,
        samples=metrics.samples,
    )


def result_message(trained: TrainedNetwork, figures: TestFigures) -> TrainingResult:
    """The message of a finished training."""
    config = trained.network.config
    return TrainingResult(
        layers=config.layers,
        channels=config.channels,
        parameters=sum(tensor.numel() for tensor in trained.network.parameters()),
        best_epoch=trained.best_epoch,
        test_mae=figures.mae,
        mean_predictor_mae=figures.mean_predictor_mae,
        baseline_mae={"mean": figures.mean_predictor_mae, "seal_ratio": figures.seal_ratio_mae},
        test_mae_by_class=figures.by_class,
        test_mae_by_pictures={name: error for name, (error, _) in figures.by_pictures.items()},
        test_mae_by_tenth=to_tensor(_numbers(figures.by_tenth)),
        calibration=to_tensor(np.array([_numbers(row) for row in figures.calibration])),
        test_quality=to_tensor(figures.quality.astype(np.float32)),
        test_prediction=to_tensor(figures.predicted.astype(np.float32)),
        val_mae=trained.val_mae,
        test_mae_single=figures.mae_single,
        test_count_by_class=figures.count_by_class,
        train_count=figures.train_count,
        val_count=figures.val_count,
        test_mae_as_proposed=figures.mae_as_proposed,
        mean_predictor_mae_as_proposed=figures.mean_predictor_mae_as_proposed,
    )


def _numbers(values: Sequence[float | None]) -> Float[np.ndarray, " n"]:
    return np.array([math.nan if value is None else value for value in values], dtype=np.float64)
