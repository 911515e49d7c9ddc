"""Study, sweep: shards → the GA-CNN family on one budget, Fig. 1, and what its parts buy.

``make sweep`` trains every depth of every channel set, then the run's own network with and without
attention and symmetry. Each network is a work item of its own, on one thread: finished ones are
kept in small files, a killed one goes on within its epoch. Networks are timed afterwards, one at a
time.

What it leaves, for Fig. 1 and the ablation table:

- ``sweep.mcap``: on ``/budget`` one ``SweepBudget`` (samples, epochs, error of the mean predictor);
  on ``/networks`` a ``SweepNetwork`` each: ``group`` "family" or "ablation", ``variant``,
  ``layers``, ``channels``, ``seed``, ``parameters``, ``multiply_adds``, ``val_mae`` and its
  standard error ``val_mae_spread``, ``test_mae_single`` (one prediction a grasp),
  ``test_mae_averaged`` (mean over its eight symmetries), ``test_mae`` (the averaged one where it
  was trained with symmetries), ``test_mae_by_class``, ``curve`` (an ``Epoch`` each), ``chosen``
  (one of the family), ``of_run``.
- ``sweep.summary.json``: ``networks``, a list of the same with ``ms_a_grasp`` (PyTorch on the CPU,
  batch 64, two threads), for time is no part of an artifact; ``chosen``, one of them;
  ``ablation``: variant → each seed's ``test_mae_single`` and ``test_mae_averaged``; ``budget``.
- ``sweep.rrd``: error and time against depth, a curve a channel set.
"""

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf.json_format import MessageToDict

from pipeline.artifacts import ArtifactWriter, Provenance
from pipeline.artifacts.sharding import is_current
from pipeline.config import RunConfig
from pipeline.config.learning import NetworkConfig, TrainConfig
from pipeline.execution import StageContext, Summary, progress, run_in_order, stage_command
from pipeline.messages.sample_cache import cached_split
from pipeline.messages.samples import Samples
from pipeline.messages.sweep import MemberFigures, read_sweep, sweep_message
from pipeline.network.baselines import mean_predictor_mae
from pipeline.network.family import (
    VARIANTS,
    Member,
    chosen_member,
    members,
    multiply_adds,
    standard_error,
)
from pipeline.network.figures import error_by_group, mean_absolute_error
from pipeline.network.ga_cnn import build_network, parameter_count
from pipeline.network.inference import predict
from pipeline.network.timing import milliseconds_a_grasp
from pipeline.network.training import TrainedNetwork, train
from pipeline.recording.recording import recording
from pipeline.recording.sweep import blueprint, show_sweep
from schemas.softgrip.v1.training_pb2 import SweepBudget, SweepNetwork
from stages.graph import SWEEP, inputs_of
from stages.shards import SPLITS
from stages.train import CLASSES, SAMPLES, tensors

TIMED_BATCH = 64
TIMED_THREADS = 2
NETWORKS, BUDGET = "/networks", "/budget"


@dataclass(frozen=True)
class MemberJob:
    """One work item: a member to train; its result goes to ``path``."""

    member: Member
    path: Path
    shards: Path
    cache: Path
    config: RunConfig
    provenance: Provenance


def build(stage: StageContext) -> Summary:
    """Train the family and the ablation on one budget, time them, mark the chosen one."""
    config, pieces = stage.config, stage.folder.state("sweep")
    cache = stage.folder.state(SAMPLES)
    given = {split: budgeted(config, stage.upstream("shards"), cache, split) for split in SPLITS}
    jobs = [
        MemberJob(
            member=member,
            path=pieces / f"{member.name}.mcap",
            shards=stage.upstream("shards"),
            cache=cache,
            config=config,
            provenance=stage.provenance(),
        )
        for member in members(config.sweep, config.network, config.seed)
    ]
    done = run_in_order(train_member, jobs, stage.workers, stage.executor, ahead_per_worker=64)
    parts = list(progress(done, len(jobs), "sweep: networks", "network"))
    networks = [network for part in parts for network in read_sweep(part)]
    mark(networks, config.network)
    waiting = progress(networks, len(networks), "sweep: timing", "network")
    times_ms = [time_ms(network, given["test"]) for network in waiting]
    budget = budget_message(config, given)
    publish(stage, networks, times_ms, budget)
    shutil.rmtree(pieces)
    return summary(networks, times_ms, budget)


def budgeted(config: RunConfig, shards: Path, cache: Path, split: str) -> Samples:
    """What every member gets of a split: its first samples, which are shuffled."""
    sweep = config.sweep
    wanted = sweep.samples if split == "train" else sweep.held_out_samples
    return cached_split(shards, split, cache).take(slice(0, wanted))


def budget_of(config: RunConfig, member: Member) -> TrainConfig:
    """The run's training, cut to the budget; members train side by side, each on one thread."""
    sweep = config.sweep
    cut = {"epochs": sweep.epochs, "patience_epochs": sweep.epochs, "batch_size": sweep.batch_size}
    own = {"threads": 1, "augment": member.augment}
    return config.train.model_copy(update={**cut, **own})


def train_member(job: MemberJob) -> Path:
    """Train, or keep, one member."""
    if is_current(job.path, job.provenance.key):
        return job.path
    given = {split: budgeted(job.config, job.shards, job.cache, split) for split in SPLITS}
    config, state = budget_of(job.config, job.member), job.path.with_suffix("")
    trained = train(
        config,
        job.member.network,
        job.member.seed,
        tensors(given["train"]),
        tensors(given["val"]),
        state,
        on_epoch=lambda _: None,
    )
    figures = member_figures(job.member, trained, config, given["val"], given["test"])
    with ArtifactWriter(job.path, job.provenance) as artifact:
        artifact.write(NETWORKS, sweep_message(job.member, trained, figures), log_time_ns=0)
    shutil.rmtree(state)
    return job.path


def member_figures(
    member: Member, trained: TrainedNetwork, config: TrainConfig, val: Samples, test: Samples
) -> MemberFigures:
    """Error and cost of a trained member."""

    def predicted(samples: Samples, averaged: bool) -> np.ndarray:
        size, threads = config.batch_size, config.threads
        cloud, mask = samples.cloud, samples.cloud_mask
        return predict(trained.network, cloud, mask, size, threads, averaged)

    single, averaged = predicted(test, averaged=False), predicted(test, averaged=True)
    usual = averaged if member.augment else single
    return MemberFigures(
        val_mae=trained.val_mae,
        val_mae_spread=standard_error(np.abs(predicted(val, averaged=False) - val.quality)),
        test_mae=mean_absolute_error(usual, test.quality),
        test_mae_single=mean_absolute_error(single, test.quality),
        test_mae_averaged=mean_absolute_error(averaged, test.quality),
        by_class=error_by_group(usual, test.quality, CLASSES[test.shape_class]),
        parameters=parameter_count(trained.network),
        multiply_adds=multiply_adds(trained.network),
    )


def mark(networks: list[SweepNetwork], of_run: NetworkConfig) -> None:
    """Set ``of_run`` where the size is the run's, and ``chosen`` on one of the family."""
    for network in networks:
        size = (network.layers, tuple(network.channels))
        network.of_run = size == (of_run.layers, of_run.channels)
    family = [network for network in networks if network.group == "family"]
    chosen = chosen_member(
        [network.val_mae for network in family],
        [network.val_mae_spread for network in family],
        [network.multiply_adds for network in family],
    )
    family[chosen].chosen = True


def time_ms(network: SweepNetwork, test: Samples) -> float:
    """Milliseconds a grasp of a network of this make, whose weights change no time."""
    attention = "none" if network.variant == "no attention" else "cbam"
    channels = tuple(network.channels)
    made = build_network(
        NetworkConfig.model_validate(
            {"layers": network.layers, "channels": channels, "attention": attention}
        ),
        seed=0,
    )

    def ask(cloud: np.ndarray, mask: np.ndarray) -> np.ndarray:
        return predict(made, cloud, mask, len(cloud), TIMED_THREADS, average_symmetries=False)

    (time,) = milliseconds_a_grasp(
        ask, test.cloud[:TIMED_BATCH], test.cloud_mask[:TIMED_BATCH], (TIMED_BATCH,)
    ).values()
    return time


def budget_message(config: RunConfig, given: dict[str, Samples]) -> SweepBudget:
    """What every member was given."""
    return SweepBudget(
        train_samples=len(given["train"]),
        val_samples=len(given["val"]),
        test_samples=len(given["test"]),
        epochs=config.sweep.epochs,
        batch_size=config.sweep.batch_size,
        mean_predictor_mae=mean_predictor_mae(given["train"].quality, given["test"].quality),
    )


def publish(
    stage: StageContext, networks: list[SweepNetwork], times_ms: list[float], budget: SweepBudget
) -> None:
    """Recording, then artifact."""
    with recording(stage, blueprint()) as stream:
        show_sweep(stream, networks, times_ms, budget)
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        artifact.write(BUDGET, budget, log_time_ns=0)
        for number, network in enumerate(networks):
            artifact.write(NETWORKS, network, log_time_ns=number)


def summary(networks: list[SweepNetwork], times_ms: list[float], budget: SweepBudget) -> Summary:
    """The study's headline figures."""
    rows = [
        {**plain(network), "ms_a_grasp": time_ms}
        for network, time_ms in zip(networks, times_ms, strict=True)
    ]
    ablation = {
        variant: {
            name: [
                getattr(n, name) for n in networks if (n.group, n.variant) == ("ablation", variant)
            ]
            for name in ("test_mae_single", "test_mae_averaged")
        }
        for variant in VARIANTS
    }
    return {
        "chosen": next(row for row in rows if row["chosen"]),
        "ablation": ablation,
        "budget": plain(budget),
        "networks": rows,
    }


def plain(message: SweepNetwork | SweepBudget) -> dict[str, Any]:
    """A message's values by name, those at their default too; curves stay in the artifact."""
    fields = MessageToDict(
        message, preserving_proto_field_name=True, always_print_fields_with_no_presence=True
    )
    return {
        name: getattr(message, name) if isinstance(value, str | float | int) else value
        for name, value in fields.items()
        if name != "curve"
    }


if __name__ == "__main__":
    stage_command(SWEEP, build, inputs_of)
