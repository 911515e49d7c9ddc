"""Stage 5, train: shards → a trained GA-CNN and its error on objects never seen in training."""

import numpy as np
from loguru import logger

from pipeline.artifacts import ArtifactWriter, publish_bytes
from pipeline.artifacts.sample_messages import Samples
from pipeline.artifacts.training_messages import (
    CHECKPOINT,
    EXPORT,
    TestFigures,
    epoch_message,
    result_message,
)
from pipeline.execution import StageContext, Summary, stage_command
from pipeline.network.baselines import fit_monotone, mean_predictor_mae, seal_ratio
from pipeline.network.checkpoint import save_checkpoint_bytes
from pipeline.network.export import OnnxPredictor, checked_against, export_onnx_bytes
from pipeline.network.figures import (
    calibration,
    error_by_class,
    error_by_quality_bin,
    mean_absolute_error,
)
from pipeline.network.inference import predict
from pipeline.network.samples import GraspTensors
from pipeline.network.training import EpochMetrics, TrainedNetwork, train
from pipeline.recording.recording import recording
from pipeline.recording.train import blueprint, show_training
from stages.graph import TRAIN, inputs_of
from stages.shards import read_split

COMPARED = 512  # test clouds on which the export for control is held against its original
CLASSES = np.array(["basic", "typical", "complex"])


def build(stage: StageContext) -> Summary:
    """Train GA-CNN on the train split, stop by the val split, report on the test split."""
    config, shards = stage.config, stage.upstream("shards")
    splits = {split: read_split(shards, split) for split in ("train", "val", "test")}
    trained = train(
        config.train,
        config.network,
        config.seed,
        tensors(splits["train"]),
        tensors(splits["val"]),
        stage.folder.state("train"),
        tell,
    )
    figures = test_figures(stage, trained, splits["train"], splits["test"])
    publish(stage, trained, figures, splits["test"])
    return summary(stage, trained, figures)


def tensors(samples: Samples) -> GraspTensors:
    """The part of the samples that the network learns from."""
    return GraspTensors(samples.cloud, samples.cloud_mask, samples.quality)


def tell(epoch: EpochMetrics) -> None:
    """One line an epoch."""
    logger.info(
        "train: epoch {:3d}  train |e| {:.4f}  val |e| {:.4f}  rate {:.2e}",
        epoch.epoch + 1,
        epoch.train_mae,
        epoch.val_mae,
        epoch.learning_rate,
    )


def test_figures(
    stage: StageContext, trained: TrainedNetwork, train_set: Samples, test_set: Samples
) -> TestFigures:
    """The network's error on held-out objects, and that of what it has to beat."""
    config, pad = stage.config.train, stage.config.gripper.pad
    quality = test_set.quality
    predicted = predict(
        trained.network,
        test_set.cloud,
        test_set.cloud_mask,
        config.batch_size,
        config.threads,
        average_symmetries=config.augment,
    )
    radius, tolerance = pad.seal_radius_m / pad.radius_m, pad.distance_step_m / pad.radius_m
    ratio = {
        name: seal_ratio(samples.cloud, samples.cloud_mask, radius, tolerance)
        for name, samples in (("train", train_set), ("test", test_set))
    }
    by_seal = fit_monotone(ratio["train"], train_set.quality).predict(ratio["test"])
    return TestFigures(
        quality=quality,
        predicted=predicted,
        mae=mean_absolute_error(predicted, quality),
        mean_predictor_mae=mean_predictor_mae(train_set.quality, quality),
        seal_ratio_mae=mean_absolute_error(by_seal, quality),
        by_class=error_by_class(predicted, quality, CLASSES[test_set.shape_class]),
        by_tenth=[found.mae for found in error_by_quality_bin(predicted, quality)],
        calibration=[
            (found.mean_predicted, found.mean_quality, found.count)
            for found in calibration(predicted, quality)
        ],
    )


def publish(
    stage: StageContext, trained: TrainedNetwork, figures: TestFigures, test_set: Samples
) -> None:
    """Recording, the weights on their own, and the artifact that carries both figures and them."""
    checkpoint = save_checkpoint_bytes(trained.network)
    exported = export_for_control(stage, trained, test_set)
    publish_bytes(stage.folder.path / "train" / CHECKPOINT, checkpoint)
    publish_bytes(stage.folder.path / "train" / EXPORT, exported)
    wanted = stage.config.recording.clouds
    with recording(stage.recording, stage.stage.name, stage.key.digest, blueprint()) as stream:
        show_training(stream, trained.history, figures, test_set, wanted)
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        for epoch in trained.history:
            artifact.write("/epochs", epoch_message(epoch), log_time_ns=epoch.epoch)
        result = result_message(trained, figures)
        artifact.write("/result", result, log_time_ns=len(trained.history))
        artifact.attach(CHECKPOINT, "application/octet-stream", checkpoint)
        artifact.attach(EXPORT, "application/octet-stream", exported)


def export_for_control(stage: StageContext, trained: TrainedNetwork, test_set: Samples) -> bytes:
    """The network as ONNX, held against the original on test clouds."""
    exported = export_onnx_bytes(trained.network)
    config = stage.config.train
    difference = checked_against(
        OnnxPredictor(exported, config.threads),
        trained.network,
        test_set.cloud[:COMPARED],
        test_set.cloud_mask[:COMPARED],
        config.batch_size,
        config.threads,
    )
    logger.info("train: exported for control, largest difference {:.1e}", difference)
    return exported


def summary(stage: StageContext, trained: TrainedNetwork, figures: TestFigures) -> Summary:
    """The stage's headline figures."""
    network = trained.network
    return {
        "parameters": sum(tensor.numel() for tensor in network.parameters()),
        "layers": network.config.layers,
        "channels": list(network.config.channels),
        "epochs": len(trained.history),
        "best_epoch": trained.best_epoch,
        "val_mae": trained.val_mae,
        "test_mae": figures.mae,
        "mean_predictor_mae": figures.mean_predictor_mae,
        "seal_ratio_mae": figures.seal_ratio_mae,
        "test_mae_by_class": figures.by_class,
    }


if __name__ == "__main__":
    stage_command(TRAIN, build, inputs_of)
