"""Study, sweep: shards → the GA-CNN family on one budget, Fig. 1, and what its parts buy.

``make sweep`` trains every depth of every channel set, some of them with several seeds, then the
run's own network with and without attention and symmetry. Each network is a work item of its own,
on one thread: finished ones are kept in small files, a killed one goes on within its epoch.
Networks are timed afterwards, one at a time.

What it leaves, for Fig. 1 and the ablation table:

- ``sweep.mcap``: on ``/budget`` one ``SweepBudget`` (samples, epochs, error of the mean predictor);
  on ``/networks`` a ``SweepNetwork`` each: ``group`` "family", "repeat" or "ablation", ``variant``,
  ``layers``, ``channels``, ``seed``, ``parameters``, ``multiply_adds``, ``val_mae`` and its
  standard error ``val_mae_spread``, ``test_mae_single`` (one prediction a grasp),
  ``test_mae_averaged`` (mean over its eight symmetries), ``test_mae`` (the averaged one where it
  was trained with symmetries), ``test_mae_by_class``, ``curve`` (an ``Epoch`` each), ``chosen``
  (one of the family), ``of_run``.
- ``sweep.summary.json``: ``networks``, a list of the same with ``ms_a_grasp`` (PyTorch on the CPU,
  batch 64, two threads), for time is no part of an artifact; ``chosen``, one of them; ``seeds``:
  what another seed changes, and which networks differ by more;
  ``ablation``: variant → each seed's ``test_mae_single`` and ``test_mae_averaged``; ``budget``.
- ``sweep.rrd``: error and time against depth, a curve a channel set.
"""

import shutil
from dataclasses import dataclass
from pathlib import Path

from pipeline.artifacts import ArtifactWriter, Provenance
from pipeline.artifacts.sharding import is_current
from pipeline.config import RunConfig
from pipeline.execution import StageContext, Summary, progress, run_in_order, stage_command
from pipeline.messages.sample_cache import first_samples, first_shards
from pipeline.messages.sweep import (
    budget_message,
    mark_networks,
    network_config_of,
    read_sweep,
    sweep_message,
    sweep_summary,
)
from pipeline.network.family import (
    Member,
    list_members,
    measure_member,
    member_training,
    time_network_ms,
)
from pipeline.network.samples import SPLITS, Samples
from pipeline.network.training import train
from schemas.softgrip.v1.training_pb2 import SweepBudget, SweepNetwork
from stages.graph import SWEEP, inputs_of

TIMED_BATCH = 64  # grasps asked at once, as in a control step
TIMED_THREADS = 2  # cores of the smallest machine that is supported
NETWORKS, BUDGET = "/networks", "/budget"


@dataclass(frozen=True)
class MemberJob:
    """One work item: a member to train; its result goes to ``path``.

    ``shards`` is the index, ``samples`` are those shards of it that are read.
    """

    member: Member
    path: Path
    shards: Path
    samples: tuple[Path, ...]
    config: RunConfig
    provenance: Provenance


def build(stage: StageContext) -> Summary:
    """Train family, repeats and ablation on one budget, time them, mark the chosen one."""
    config = stage.config
    given = given_samples(config, stage.upstream("shards"))
    jobs = member_jobs(stage)
    done = run_in_order(
        train_member,
        jobs,
        stage.workers,
        stage.executor,
        ahead_per_worker=64,
        store=stage.store,
    )
    parts = list(progress(done, len(jobs), "sweep: networks", "network"))
    networks = [network for part in parts for network in read_sweep(part)]
    mark_networks(networks, config.network)
    times_ms = [
        time_network_ms(network_config_of(network), given["test"], TIMED_BATCH, TIMED_THREADS)
        for network in progress(networks, len(networks), "sweep: timing", "network")
    ]
    budget = budget_message(config, given)
    write(stage, networks, budget)
    shutil.rmtree(stage.folder.state("sweep"))
    return sweep_summary(networks, times_ms, budget)


def member_jobs(stage: StageContext) -> list[MemberJob]:
    """Every member of the family, its repeats, then those of the ablation."""
    config, shards = stage.config, stage.upstream("shards")
    wanted = samples_wanted(config)
    samples = [path for split in SPLITS for path in first_shards(shards, split, wanted[split])]
    return [
        MemberJob(
            member=member,
            path=stage.folder.state("sweep") / f"{member.name}.mcap",
            shards=shards,
            samples=tuple(samples),
            config=config,
            provenance=stage.provenance(),
        )
        for member in list_members(config.sweep, config.network, config.seed)
    ]


def samples_wanted(config: RunConfig) -> dict[str, int]:
    """Split to how many of its samples every member gets."""
    held_out = config.sweep.held_out_samples
    return {split: config.sweep.samples if split == "train" else held_out for split in SPLITS}


def given_samples(config: RunConfig, shards: Path) -> dict[str, Samples]:
    """Split to what every member gets of it: its first samples, for splits are shuffled."""
    return {s: first_samples(shards, s, count) for s, count in samples_wanted(config).items()}


def train_member(job: MemberJob) -> Path:
    """Train, or keep, one member."""
    if is_current(job.path, job.provenance.key):
        return job.path
    given = given_samples(job.config, job.shards)
    config = member_training(job.config.train, job.config.sweep, job.member)
    state = job.path.with_suffix("")
    trained = train(
        config,
        job.member.network,
        job.member.seed,
        given["train"].tensors,
        given["val"].tensors,
        state,
        on_epoch=lambda _: None,
    )
    figures = measure_member(job.member, trained, config, given["val"], given["test"])
    with ArtifactWriter(job.path, job.provenance) as artifact:
        artifact.write(NETWORKS, sweep_message(job.member, trained, figures), log_time_ns=0)
    shutil.rmtree(state)
    return job.path


def write(stage: StageContext, networks: list[SweepNetwork], budget: SweepBudget) -> None:
    """The artifact: the budget, then every network with its curve."""
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        artifact.write(BUDGET, budget, log_time_ns=0)
        for number, network in enumerate(networks):
            artifact.write(NETWORKS, network, log_time_ns=number)


if __name__ == "__main__":
    from pipeline.recording.sweep import draw_sweep  # not in workers: they draw nothing

    stage_command(SWEEP, build, inputs_of, draw=draw_sweep)
