"""Stage 5, train: shards → a trained GA-CNN and its error on objects never seen in training.

On several GPUs, or several processes of one machine: ``make train RANKS=2``, which is
``torchrun --nproc-per-node=2 -m -- stages.train --run NAME``. All processes train, the first does
the rest.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial, update_wrapper

from loguru import logger

from pipeline.artifacts import ArtifactWriter, publish_bytes
from pipeline.artifacts.named_inputs import ATTEMPTS, STARTING_NETWORK, TEACHERS, inputs_under
from pipeline.execution import StageContext, Summary, stage_command
from pipeline.execution.further_runs import check_further_runs
from pipeline.execution.training_samples import TrainingSet, open_training_set, readers_ahead
from pipeline.messages.sample_cache import cached_split
from pipeline.messages.training import (
    BASELINE,
    CHECKPOINT,
    EXPORT,
    epoch_message,
    result_message,
)
from pipeline.network.checkpoint import save_checkpoint_bytes
from pipeline.network.control_inference import ControlPredictor
from pipeline.network.devices import choose_device
from pipeline.network.export import check_export, export_onnx_bytes
from pipeline.network.fine_tuning import measure_fine_tuning, starting_network
from pipeline.network.fitted_baselines import fit_baselines
from pipeline.network.ga_cnn import parameter_count
from pipeline.network.held_out import measure_held_out
from pipeline.network.interpolation import choose_between
from pipeline.network.parallel import ALONE, Ranks, join_ranks
from pipeline.network.samples import Samples
from pipeline.network.sources import baseline_to_json
from pipeline.network.teachers import teaching_network
from pipeline.network.timing import runtimes_ms_a_grasp
from pipeline.network.training import TrainedNetwork, train
from pipeline.network.training_figures import EpochMetrics, TestFigures
from pipeline.recording.train import draw_train
from schemas.softgrip.v1.training_pb2 import TrainingResult
from stages.graph import TRAIN, further_runs, inputs_of

COMPARED = 512  # test clouds on which the export for control is held against its original
SAMPLES = "samples"  # folder of the decoded shards, in the run's state


def build(stage: StageContext, ranks: Ranks = ALONE) -> Summary:
    """Train GA-CNN on the train split, stop by the val split, report on the test split."""
    config = stage.config
    train_set = training_set(stage)
    shards, cache = stage.upstream("shards"), stage.folder.state(SAMPLES)
    val_set, test_set = (cached_split(shards, name, cache) for name in ("val", "test"))
    begun = stage.inputs.get(STARTING_NETWORK)
    wanted = (config.network, config.seed)
    start = starting_network(begun.read_bytes(), str(begun), *wanted) if begun else None
    paths = inputs_under(stage.inputs, TEACHERS)
    teachers = [teaching_network(path.read_bytes(), str(path)) for path in paths]
    # On a CPU readers would take the cores that train.
    on_gpu = choose_device(config.train.device, ranks).type == "cuda"
    readers = max(stage.workers // ranks.count, 1) if on_gpu else 0
    trained = train(
        config.train,
        config.network,
        config.seed,
        train_set.learned,
        val_set.tensors,
        stage.folder.state("train"),
        print_epoch,
        ranks,
        loader_workers=readers_ahead(readers, config.train.batch_size, val_set),
        show_progress=True,
        start=start,
        teachers=teachers,
    )
    if not ranks.first:
        return {}
    told: Summary = {}
    if start and any(config.train.start_shares):
        chosen = choose_between(start, trained.network, config.train, train_set.learned, val_set)
        trained = replace(trained, network=chosen.network, val_mae=chosen.val_mae)
        told = chosen.headline()
    network = trained.network
    fitted = fit_baselines(train_set.fitted, config.gripper, config.train.baseline_samples)
    figures = measure_held_out(network, config.train, fitted, train_set.count, val_set, test_set)
    tuned = measure_fine_tuning(start, network, config.train, test_set.tensors) if start else None
    exported, predictor = export_for_control(stage, trained, test_set)
    checkpoint = save_checkpoint_bytes(network)
    attached = {
        CHECKPOINT: checkpoint,
        EXPORT: exported,
        BASELINE: baseline_to_json(fitted.analytic).encode(),
    }
    for name, data in attached.items():
        publish_bytes(stage.folder.path / "train" / name, data)
    parameters, kept = parameter_count(network), trained.history[trained.kept_epoch]
    result = result_message(config.network, parameters, kept, figures, tuned)
    write(stage, trained, result, attached)
    inference = runtimes_ms_a_grasp(
        *(network, predictor, test_set.cloud, test_set.cloud_mask),
        *(config.train.threads, config.train.timed_batches),
    )
    told |= (tuned.headline() if tuned else {}) | {"inference_ms_a_grasp": inference}
    return summary(stage, trained, figures, ranks) | told


def training_set(stage: StageContext) -> TrainingSet:
    """The train split, opened before anything is decoded; further runs' and tried contacts too."""
    attempts = inputs_under(stage.inputs, ATTEMPTS)
    cache = stage.folder.state(SAMPLES)
    if further := further_runs(stage.folder, stage.config.train.further_runs):
        check_further_runs(stage.upstream("objects"), stage.config, further)
    indices = [stage.upstream("shards"), *(run.artifact("shards") for run in further)]
    return open_training_set(stage.config, indices, cache, attempts)


def print_epoch(epoch: EpochMetrics) -> None:
    """Print one line about an epoch."""
    logger.info(
        "train: epoch {:3d}  train |e| {:.4f}  val |e| {:.4f}  rate {:.2e}",
        epoch.epoch + 1,
        epoch.train_mae,
        epoch.val_mae,
        epoch.learning_rate,
    )


def export_for_control(
    stage: StageContext, trained: TrainedNetwork, test_set: Samples
) -> tuple[bytes, ControlPredictor]:
    """The network as ONNX and as control runs it, held against the original on test clouds."""
    exported = export_onnx_bytes(trained.network, stage.config.sensing.grid_cells)
    config = stage.config.train
    predictor = ControlPredictor(exported, config.threads)
    difference = check_export(
        predictor,
        trained.network,
        test_set.cloud[:COMPARED],
        test_set.cloud_mask[:COMPARED],
        config.batch_size,
        config.threads,
    )
    logger.info("train: exported for control, largest difference {:.1e}", difference)
    return exported, predictor


def write(
    stage: StageContext,
    trained: TrainedNetwork,
    result: TrainingResult,
    attached: Mapping[str, bytes],
) -> None:
    """The artifact, which carries curve, figures, weights and the fitted baseline."""
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        for epoch in trained.history:
            artifact.write("/epochs", epoch_message(epoch), log_time_ns=epoch.epoch)
        artifact.write("/result", result, log_time_ns=len(trained.history))
        for name, data in attached.items():
            artifact.attach(name, "application/octet-stream", data)


def summary(
    stage: StageContext, trained: TrainedNetwork, figures: TestFigures, ranks: Ranks
) -> Summary:
    """The stage's headline figures."""
    network = trained.network
    return {
        "parameters": parameter_count(network),
        "layers": network.config.layers,
        "channels": list(network.config.channels),
        "samples": {
            "train": figures.train_count,
            "val": figures.val_count,
            "test": len(figures.quality),
        },
        "epochs": len(trained.history),
        "kept_epoch": trained.kept_epoch,
        "stopped_early": trained.stopped_early,
        "val_mae": trained.val_mae,
        **figures.headline(),
        "device": choose_device(stage.config.train.device, ranks).type,
        "processes": ranks.count,
        "waiting_for_data_share": trained.waiting_share,
        "preparing_inputs_share": trained.preparing_share,
    }


def main() -> None:
    """The stage's command, in every process that torchrun started."""
    with join_ranks() as ranks:
        together = update_wrapper(partial(build, ranks=ranks), build)
        stage_command(TRAIN, together, inputs_of, ranks.rank, draw_train)


if __name__ == "__main__":
    main()
