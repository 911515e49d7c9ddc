"""Stage 5, train: shards → a trained GA-CNN and its error on objects never seen in training.

On several GPUs, or several processes of one machine: ``make train RANKS=2``, which is
``torchrun --nproc-per-node=2 -m -- stages.train --run NAME``. All processes train, the first does
the rest.
"""

from collections import Counter
from functools import partial, update_wrapper

import numpy as np
from jaxtyping import Float
from loguru import logger

from pipeline.artifacts import ArtifactWriter, publish_bytes
from pipeline.execution import StageContext, Summary, stage_command
from pipeline.messages.sample_cache import cached_split
from pipeline.messages.samples import Samples
from pipeline.messages.training import (
    CHECKPOINT,
    EXPORT,
    TestFigures,
    epoch_message,
    result_message,
)
from pipeline.network.baselines import (
    fit_monotone,
    mean_predictor_mae,
    seal_ratio,
    weighted_mean_predictor_mae,
)
from pipeline.network.checkpoint import save_checkpoint_bytes
from pipeline.network.control_inference import ControlPredictor, checked_against
from pipeline.network.export import export_onnx_bytes
from pipeline.network.figures import (
    calibration,
    error_by_group,
    error_by_quality_bin,
    mean_absolute_error,
    weighted_error,
)
from pipeline.network.inference import predict
from pipeline.network.parallel import ALONE, Ranks, joined_ranks
from pipeline.network.resuming import EpochMetrics
from pipeline.network.samples import GraspTensors
from pipeline.network.timing import milliseconds_a_grasp
from pipeline.network.training import TrainedNetwork, chosen_device, train
from pipeline.recording.recording import recording
from pipeline.recording.train import blueprint, show_training
from stages.graph import TRAIN, inputs_of

COMPARED = 512  # test clouds on which the export for control is held against its original
CLASSES = np.array(["basic", "typical", "complex"])
SAMPLES = "samples"  # folder of the decoded shards, in the run's state


def build(stage: StageContext, ranks: Ranks = ALONE) -> Summary:
    """Train GA-CNN on the train split, stop by the val split, report on the test split."""
    config = stage.config
    train_set, val_set, test_set = (split_of(stage, name) for name in ("train", "val", "test"))
    on_gpu = chosen_device(config.train.device, ranks).type == "cuda"
    trained = train(
        config.train,
        config.network,
        config.seed,
        tensors(train_set),
        tensors(val_set),
        stage.folder.state("train"),
        tell,
        ranks,
        # On a CPU readers would take the cores that train.
        loader_workers=max(stage.workers // ranks.count, 1) if on_gpu else 0,
        show_progress=True,
    )
    if not ranks.first:
        return {}
    figures = test_figures(stage, trained, train_set, val_set, test_set)
    exported = export_for_control(stage, trained, test_set)
    publish(stage, trained, figures, exported, test_set)
    return summary(stage, trained, figures, ranks, inference_ms(stage, trained, exported, test_set))


def split_of(stage: StageContext, split: str) -> Samples:
    """A split's samples, decoded from its shards once and mapped from there."""
    return cached_split(stage.upstream("shards"), split, stage.folder.state(SAMPLES))


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
    stage: StageContext,
    trained: TrainedNetwork,
    train_set: Samples,
    val_set: Samples,
    test_set: Samples,
) -> TestFigures:
    """The network's error on held-out objects, and that of what it has to beat."""
    config, pad = stage.config.train, stage.config.gripper.pad
    quality, shape_class = np.asarray(test_set.quality), CLASSES[test_set.shape_class]
    single, averaged = (
        predict(
            trained.network,
            test_set.cloud,
            test_set.cloud_mask,
            config.batch_size,
            config.threads,
            average_symmetries=averaging,
        )
        for averaging in (False, True)
    )
    predicted = averaged if config.augment else single
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
        mae_single=mean_absolute_error(single, quality),
        mae_as_proposed=weighted_error(predicted, quality, test_set.proposal_weight),
        mean_predictor_mae=mean_predictor_mae(train_set.quality, quality),
        mean_predictor_mae_as_proposed=weighted_mean_predictor_mae(
            train_set.quality, train_set.proposal_weight, quality, test_set.proposal_weight
        ),
        seal_ratio_mae=mean_absolute_error(by_seal, quality),
        by_class=error_by_group(predicted, quality, shape_class),
        by_pictures=error_by_pictures(predicted, test_set),
        first_proposals=int((np.asarray(test_set.proposal_weight) > 0).sum()),
        count_by_class=dict(Counter(shape_class.tolist())),
        by_tenth=[found.mae for found in error_by_quality_bin(predicted, quality)],
        calibration=[
            (found.mean_predicted, found.mean_quality, found.count)
            for found in calibration(predicted, quality)
        ],
        train_count=len(train_set),
        val_count=len(val_set),
    )


def error_by_pictures(
    predicted: Float[np.ndarray, " n"], test_set: Samples
) -> dict[str, tuple[float, int]]:
    """Error and samples by how many pictures their clouds were cut from."""
    counts = Counter(np.asarray(test_set.pictures).tolist())
    errors = error_by_group(predicted, np.asarray(test_set.quality), np.asarray(test_set.pictures))
    return {
        f"{pictures} picture{'s' if pictures > 1 else ''}": (errors[str(pictures)], count)
        for pictures, count in sorted(counts.items())
    }


def export_for_control(stage: StageContext, trained: TrainedNetwork, test_set: Samples) -> bytes:
    """The network as ONNX, held against the original on test clouds."""
    exported = export_onnx_bytes(trained.network)
    config = stage.config.train
    difference = checked_against(
        ControlPredictor(exported, config.threads),
        trained.network,
        test_set.cloud[:COMPARED],
        test_set.cloud_mask[:COMPARED],
        config.batch_size,
        config.threads,
    )
    logger.info("train: exported for control, largest difference {:.1e}", difference)
    return exported


def publish(
    stage: StageContext,
    trained: TrainedNetwork,
    figures: TestFigures,
    exported: bytes,
    test_set: Samples,
) -> None:
    """Recording, the weights on their own, and the artifact that carries both figures and them."""
    checkpoint = save_checkpoint_bytes(trained.network)
    publish_bytes(stage.folder.path / "train" / CHECKPOINT, checkpoint)
    publish_bytes(stage.folder.path / "train" / EXPORT, exported)
    wanted = stage.config.recording.clouds
    with recording(stage, blueprint()) as stream:
        show_training(stream, trained.history, figures, test_set, wanted)
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        for epoch in trained.history:
            artifact.write("/epochs", epoch_message(epoch), log_time_ns=epoch.epoch)
        result = result_message(trained, figures)
        artifact.write("/result", result, log_time_ns=len(trained.history))
        artifact.attach(CHECKPOINT, "application/octet-stream", checkpoint)
        artifact.attach(EXPORT, "application/octet-stream", exported)


def inference_ms(
    stage: StageContext, trained: TrainedNetwork, exported: bytes, test_set: Samples
) -> dict[str, dict[str, float]]:
    """Runtime → batch size → milliseconds a grasp on the CPU, on ``train.threads`` threads."""
    threads = stage.config.train.threads
    runtimes = {
        "openvino": ControlPredictor(exported, threads).predict,
        "pytorch": lambda cloud, mask: predict(
            trained.network, cloud, mask, len(cloud), threads, average_symmetries=False
        ),
    }
    return {
        name: milliseconds_a_grasp(run, test_set.cloud, test_set.cloud_mask)
        for name, run in runtimes.items()
    }


def summary(
    stage: StageContext,
    trained: TrainedNetwork,
    figures: TestFigures,
    ranks: Ranks,
    inference: dict[str, dict[str, float]],
) -> Summary:
    """The stage's headline figures."""
    network = trained.network
    return {
        "parameters": sum(tensor.numel() for tensor in network.parameters()),
        "layers": network.config.layers,
        "channels": list(network.config.channels),
        "samples": {
            "train": figures.train_count,
            "val": figures.val_count,
            "test": len(figures.quality),
        },
        "epochs": len(trained.history),
        "best_epoch": trained.best_epoch,
        "stopped_early": trained.stopped_early,
        "val_mae": trained.val_mae,
        "test_mae": figures.mae,
        "test_mae_single": figures.mae_single,
        "test_mae_as_proposed": figures.mae_as_proposed,
        "mean_predictor_mae": figures.mean_predictor_mae,
        "mean_predictor_mae_as_proposed": figures.mean_predictor_mae_as_proposed,
        "seal_ratio_mae": figures.seal_ratio_mae,
        "test_mae_by_class": figures.by_class,
        "test_mae_by_pictures": {name: e for name, (e, _) in figures.by_pictures.items()},
        "test_mae_by_tenth_of_q": figures.by_tenth,
        "device": chosen_device(stage.config.train.device, ranks).type,
        "processes": ranks.count,
        "waiting_for_data_share": trained.waiting_share,
        "preparing_inputs_share": trained.preparing_share,
        "inference_ms_a_grasp": inference,
    }


def main() -> None:
    """The stage's command, in every process that torchrun started."""
    with joined_ranks() as ranks:
        together = update_wrapper(partial(build, ranks=ranks), build)
        stage_command(TRAIN, together, inputs_of, ranks.rank)


if __name__ == "__main__":
    main()
