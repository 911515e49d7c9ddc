"""A training's curve and figures → softgrip.v1.Epoch and TrainingResult."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from pipeline.artifacts.tensors import from_tensor, to_tensor
from pipeline.config.learning import NetworkConfig
from pipeline.network.fitted_baselines import MEAN, BaselineErrors
from pipeline.network.samples import Samples
from pipeline.network.training_figures import (
    CLASSES,
    EpochMetrics,
    FineTuning,
    TestFigures,
    error_by_pictures,
)
from schemas.softgrip.v1.training_pb2 import Epoch, TrainingResult
from schemas.softgrip.v1.training_pb2 import FineTuning as FineTuningMessage

CHECKPOINT = "ga_cnn.safetensors"
EXPORT = "ga_cnn.onnx"
BASELINE = "analytic.json"  # the analytic label on the measured cloud, as it was fitted


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


def result_message(
    network: NetworkConfig,
    parameters: int,
    kept: EpochMetrics,
    figures: TestFigures,
    tuned: FineTuning | None,
) -> TrainingResult:
    """The message of a finished training.

    Parameters
    ----------
    network
        Layers and channels of the trained network.
    parameters
        How many numbers it learned.
    kept
        The epoch whose weights it has.
    figures
        Its errors on held-out objects.
    tuned
        What was gained and forgotten where the training began with a trained network.

    Returns
    -------
    The message.
    """
    baselines = figures.baselines
    return TrainingResult(
        layers=network.layers,
        channels=network.channels,
        parameters=parameters,
        best_epoch=kept.epoch,
        test_mae=figures.mae,
        mean_predictor_mae=baselines.balanced[MEAN],
        baseline_mae=baselines.balanced,
        test_mae_by_class=figures.by_class,
        test_mae_by_pictures={name: error for name, (error, _) in figures.by_pictures.items()},
        test_mae_by_tenth=to_tensor(_numbers(figures.by_tenth)),
        calibration=to_tensor(np.array([_numbers(row) for row in figures.calibration])),
        test_quality=to_tensor(figures.quality.astype(np.float32)),
        test_prediction=to_tensor(figures.predicted.astype(np.float32)),
        val_mae=kept.val_mae,
        test_mae_single=figures.mae_single,
        test_count_by_class=figures.count_by_class,
        train_count=figures.train_count,
        val_count=figures.val_count,
        test_mae_as_proposed=figures.mae_as_proposed,
        mean_predictor_mae_as_proposed=baselines.as_proposed.get(MEAN),
        baseline_mae_as_proposed=baselines.as_proposed,
        fine_tuning=FineTuningMessage(**vars(tuned)) if tuned else None,
    )


def fine_tuning_of(message: TrainingResult) -> FineTuning | None:
    """What a training gained and forgot, read back; None where it began with no network."""
    if not message.HasField("fine_tuning"):
        return None
    told = message.fine_tuning
    return FineTuning(
        own_before=told.own_before,
        own_after=told.own_after,
        released_before=told.released_before,
        released_after=told.released_after,
        released_grasps=told.released_grasps,
        learnt_before=told.learnt_before if told.HasField("learnt_before") else None,
        learnt_after=told.learnt_after if told.HasField("learnt_after") else None,
        learnt_grasps=told.learnt_grasps,
    )


def metrics_of(message: Epoch) -> EpochMetrics:
    """The metrics of one epoch, read back."""
    return EpochMetrics(
        epoch=message.epoch,
        train_loss=message.train_loss,
        train_mae=message.train_mae,
        val_mae=message.val_mae,
        learning_rate=message.learning_rate,
        samples=message.samples,
    )


def figures_of(message: TrainingResult, test_set: Samples) -> TestFigures:
    """The figures of a finished training, read back.

    Parameters
    ----------
    message
        Of the training.
    test_set
        The test split that it was measured on; it holds what the message counts by.

    Returns
    -------
    Errors and predictions on the test split.
    """
    predicted = from_tensor(message.test_prediction)
    by_class = dict(message.test_mae_by_class)
    return TestFigures(
        quality=from_tensor(message.test_quality),
        predicted=predicted,
        mae=message.test_mae,
        mae_single=message.test_mae_single,
        mae_as_proposed=_optional(message, "test_mae_as_proposed"),
        baselines=BaselineErrors(
            dict(message.baseline_mae), dict(message.baseline_mae_as_proposed)
        ),
        by_class={name: by_class[name] for name in CLASSES.tolist() if name in by_class},
        by_pictures=error_by_pictures(predicted, test_set),
        first_proposals=int((np.asarray(test_set.proposal_weight) > 0).sum()),
        count_by_class=dict(message.test_count_by_class),
        by_tenth=_absent_as_none(from_tensor(message.test_mae_by_tenth)),
        calibration=[
            (_absent_as_none(row)[0], _absent_as_none(row)[1], int(row[2]))
            for row in from_tensor(message.calibration)
        ],
        train_count=message.train_count,
        val_count=message.val_count,
    )


def _optional(message: TrainingResult, field: str) -> float | None:
    return getattr(message, field) if message.HasField(field) else None


def _absent_as_none(values: Float[np.ndarray, " n"]) -> list[float | None]:
    return [None if math.isnan(value) else float(value) for value in values]


def _numbers(values: Sequence[float | None]) -> Float[np.ndarray, " n"]:
    return np.array([math.nan if value is None else value for value in values], dtype=np.float64)
