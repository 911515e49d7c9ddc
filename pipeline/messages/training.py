"""A training's curve and figures → softgrip.v1.Epoch and TrainingResult."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pipeline.artifacts.tensors import to_tensor
from pipeline.network.resuming import EpochMetrics
from pipeline.network.training import TrainedNetwork
from schemas.softgrip.v1.training_pb2 import Epoch, TrainingResult

CHECKPOINT = "ga_cnn.safetensors"
EXPORT = "ga_cnn.onnx"


@dataclass(frozen=True)
class TestFigures:
    """The network on held-out objects.

    quality, predicted : (n,) q and q-hat. mae : mean |q-hat - q| of Supplement IV.
    mae_single : the same without averaging over the symmetries. count_by_class : samples.
    mae_as_proposed, mean_predictor_mae_as_proposed : over grasps as the first round draws them
    (`Samples.proposal_weight`), where labels are not balanced; None where that is unknown.
    train_count, val_count : samples that the network learned from and was chosen by.
    mean_predictor_mae, seal_ratio_mae : of the baselines. by_class : class name → error.
    by_pictures : "1 picture", "3 pictures", ... that clouds were cut from → error, samples.
    first_proposals : samples of the first round, those that ``mae_as_proposed`` is over.
    by_tenth : error by tenth of q, None where empty.
    calibration : by tenth of q-hat: mean q-hat, mean q (None where empty), count.
    """

    __test__ = False  # not a test case, whatever its name

    quality: Float[np.ndarray, " n"]
    predicted: Float[np.ndarray, " n"]
    mae: float
    mae_single: float
    mae_as_proposed: float | None
    mean_predictor_mae: float
    mean_predictor_mae_as_proposed: float | None
    seal_ratio_mae: float
    by_class: dict[str, float]
    by_pictures: dict[str, tuple[float, int]]
    first_proposals: int
    count_by_class: dict[str, int]
    by_tenth: Sequence[float | None]
    calibration: Sequence[tuple[float | None, float | None, int]]
    train_count: int
    val_count: int


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
