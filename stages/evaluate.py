"""Stage 6, evaluate: checkpoint → closed-loop success by level on held-out clutters."""

import os
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from google.protobuf.message import Message

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact
from pipeline.artifacts.sharding import is_current
from pipeline.clutter.levels import clutter_number
from pipeline.config import RunConfig
from pipeline.config.evaluation import PolicyName
from pipeline.errors import ArtifactError
from pipeline.execution import (
    RunFolder,
    StageContext,
    Summary,
    generator,
    progress,
    run_in_order,
    stage_command,
)
from pipeline.messages.evaluation import attempt_message
from pipeline.messages.evaluation_curve import curve_figures, curve_of, curve_scenes
from pipeline.messages.evaluation_results import results_of
from pipeline.messages.objects import catalogue
from pipeline.messages.proposed_contacts import contacts_message, proposed_of
from pipeline.messages.scenes import read_groups, read_scene, read_scenes
from pipeline.messages.trained import rates_for
from pipeline.recording.evaluate import draw_evaluate
from pipeline.recording.results import read_tables
from pipeline.simulation.imperfection import with_imperfection
from pipeline.simulation.picking import run_clutter
from pipeline.simulation.proposed_contacts import propose_contacts
from pipeline.spread import choose_evenly
from pipeline.world.scene import ClutterScene
from schemas.softgrip.v1.evaluation_pb2 import Attempt, ProposedContacts
from stages.graph import EVALUATE, GIVEN_NETWORK, RUNS_DIR, inputs_of

SEEN = "train"  # the split whose families the network has seen
RATED_BY: tuple[PolicyName, ...] = ("closed-loop", "analytic")  # by network and baseline
M = TypeVar("M", bound=Message)


@dataclass(frozen=True)
class ClutterJob:
    """One work item: all attempts of one policy at one clutter; of none, its contacts rated."""

    scene: ClutterScene
    policy: PolicyName | None
    path: Path
    objects: Path
    network: Path
    config: RunConfig
    provenance: Provenance
    scale: float


def build(stage: StageContext) -> Summary:
    """Pick the clutters of a split empty in closed loop; success is judged by physics."""
    scenes = clutters(stage)
    wanted = stage.config.evaluate
    robot, accelerations = wanted.imperfection, wanted.transport.accelerations_m_s2
    some = curve_scenes(scenes, robot.curve_clutters)
    contest = clutter_jobs(stage, scenes, wanted.policies, robot.scale)
    curve = {scale: clutter_jobs(stage, some, robot.curve_policies, scale) for scale in robot.curve}
    # A policy, a clutter and a scale that both ask for are one job.
    jobs = {job.path: job for part in (contest, *curve.values()) for job in part}
    rated = clutter_jobs(stage, rated_scenes(stage), (None,), robot.scale)
    every, limit_s, store = [*jobs.values(), *rated], stage.item_limit_s, stage.store
    done = run_in_order(work, every, stage.workers, stage.executor, limit_s=limit_s, store=store)
    list(progress(done, len(jobs) + len(rated), "evaluate: clutters", "clutter"))
    attempts = made_in(contest, Attempt)
    results = results_of(scenes, wanted.policies, attempts, accelerations)
    tried = {scale: made_in(part, Attempt) for scale, part in curve.items()}
    points = curve_of(some, robot.curve_policies, tried, accelerations)
    items = catalogue(stage.upstream("objects"))
    classes = {name: str(item.shape_class) for name, (item, _) in items.items()}
    contacts = made_in(rated, ProposedContacts)
    proposed = proposed_of(contacts, classes, wanted.precision, wanted.split)
    topics: dict[str, Sequence[Message]] = {"/attempts": attempts, "/imperfection": points}
    topics |= results.topics() | proposed.topics()
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        for topic, messages in topics.items():
            for number, message in enumerate(messages):
                artifact.write(topic, message, log_time_ns=number)
    shutil.rmtree(stage.folder.state("evaluate"))
    return {**results.summary(), "imperfection": curve_figures(points), **proposed.summary()}


def clutters(stage: StageContext) -> list[ClutterScene]:
    """The clutters that [evaluate] names. Raises ArtifactError where there is none."""
    split, first = stage.config.evaluate.split, stage.config.evaluate.clutters_from
    every = [s for s in read_scenes(stage.upstream("scenes")) if s.split == split]
    scenes = [s for s in every if clutter_number(s.scene_id) >= first]
    if not scenes:
        raise ArtifactError(
            f"{stage.upstream('scenes')} holds no {split} clutter from number {first} on",
            f"Give scenes.clutters_per_level.{split} at least {first + 1}",
        )
    return scenes


def clutter_jobs(
    stage: StageContext,
    scenes: list[ClutterScene],
    policies: Sequence[PolicyName | None],
    scale: float,
) -> list[ClutterJob]:
    """Every policy at every clutter, on a robot whose errors have this scale."""
    return [
        ClutterJob(
            scene=scene,
            policy=policy,
            path=stage.folder.state("evaluate")
            / f"{scene.scene_id}.{policy or 'contacts'}.{scale:g}.mcap",
            objects=stage.upstream("objects"),
            network=stage.inputs.get(GIVEN_NETWORK) or stage.upstream("train"),
            config=stage.config,
            provenance=stage.provenance(),
            scale=scale,
        )
        for scene in scenes
        for policy in policies
    ]


def rated_scenes(stage: StageContext) -> list[ClutterScene]:
    """Some clutters a level of the evaluated and of the seen families, equally far apart."""
    wanted, path = stage.config.evaluate, stage.upstream("scenes")
    by_group: dict[tuple[str, int], list[int]] = {}
    for index, group in enumerate(read_groups(path)):
        by_group.setdefault(group, []).append(index)
    return [
        read_scene(path, numbers[index])
        for (split, _), numbers in by_group.items()
        if split in (wanted.split, SEEN)
        for index in choose_evenly(len(numbers), wanted.precision.clutters_per_level)
    ]


def work(job: ClutterJob) -> Path:
    """Make, or keep, what comes of one clutter."""
    if not is_current(job.path, job.provenance.key):
        messages = attempts_at(job, job.policy) if job.policy else contacts_at(job)
        with ArtifactWriter(job.path, job.provenance) as artifact:
            for number, message in enumerate(messages):
                artifact.write("/attempts" if job.policy else "/contacts", message, number)
    return job.path


def attempts_at(job: ClutterJob, policy: PolicyName) -> list[Attempt]:
    """A policy's attempts at a clutter."""
    objects = {name: item for name, (item, _) in catalogue(job.objects).items()}
    scene, config = job.scene, with_imperfection(job.config, job.scale)
    score = rates_for(policy, job.network, config.gripper)
    rng = generator(config.seed, "evaluate", scene.scene_id)
    made = run_clutter(scene, objects, policy, score, config, rng)
    about, judge = (scene.scene_id, scene.level, len(scene.objects)), config.evaluate.judge
    return [
        attempt_message(*about, number, policy, judge, attempt, job.config)
        for number, attempt in enumerate(made)
    ]


def contacts_at(job: ClutterJob) -> list[ProposedContacts]:
    """Contacts in a clutter's pictures, rated and labelled: one message."""
    meshes = {name: item.mesh for name, (item, _) in catalogue(job.objects).items()}
    network, analytic = (rates_for(policy, job.network, job.config.gripper) for policy in RATED_BY)
    rng = generator(job.config.seed, "evaluate contacts", job.scene.scene_id)
    found = propose_contacts(job.scene, meshes, network, analytic, job.config, rng)
    return [contacts_message(job.scene, found)]


def made_in(jobs: Sequence[ClutterJob], kind: type[M]) -> list[M]:
    """All messages of a kind in jobs that are done, in their order."""
    found: list[M] = []
    for job in jobs:
        with open_artifact(job.path) as artifact:
            found += [message for _, message in artifact.messages(kind)]
    return found


if __name__ == "__main__":
    if sys.argv[1:] == ["--table"]:
        finished = RunFolder(RUNS_DIR / os.environ.get("RUN", "default"))
        sys.stdout.write(read_tables(finished.artifact("evaluate")))
    else:
        stage_command(EVALUATE, build, inputs_of, draw=draw_evaluate)
