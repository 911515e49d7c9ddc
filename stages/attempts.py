"""The work items of stage evaluate: one policy at one clutter, or a clutter's contacts rated."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from google.protobuf.message import Message

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact
from pipeline.artifacts.sharding import is_current
from pipeline.config import RunConfig
from pipeline.config.evaluation import PolicyName
from pipeline.execution import StageContext, generator
from pipeline.messages.evaluation import attempt_message
from pipeline.messages.objects import catalogue
from pipeline.messages.proposed_contacts import contacts_message
from pipeline.messages.scenes import read_scene, scene_places
from pipeline.messages.trained import rates_for
from pipeline.simulation.imperfection import with_imperfection
from pipeline.simulation.picking import run_clutter
from pipeline.simulation.proposed_contacts import propose_contacts
from pipeline.spread import choose_evenly
from pipeline.world.scene import ClutterScene
from schemas.softgrip.v1.evaluation_pb2 import Attempt, ProposedContacts
from stages.graph import GIVEN_NETWORK

SEEN = "train"  # the split whose families the network has seen
RATED_BY: tuple[PolicyName, ...] = ("network", "analytic")  # by each alone
M = TypeVar("M", bound=Message)


@dataclass(frozen=True)
class ClutterJob:
    """One work item: all attempts of one policy at one clutter."""

    scene: ClutterScene  # without its pictures: the policy takes its own
    policy: PolicyName
    scale: float  # of the robot's errors
    path: Path
    objects: Path
    network: Path
    config: RunConfig
    provenance: Provenance


@dataclass(frozen=True)
class ContactsJob:
    """One work item: contacts in the pictures of one clutter, rated and labelled."""

    scene: tuple[Path, int]  # file that holds it, and its number there
    path: Path
    objects: Path
    network: Path
    config: RunConfig
    provenance: Provenance


def clutter_jobs(
    stage: StageContext, scenes: list[ClutterScene], policies: Sequence[PolicyName], scale: float
) -> list[ClutterJob]:
    """Every policy at every clutter, on a robot whose errors have this scale."""
    folder = stage.folder.state("evaluate")
    return [
        ClutterJob(
            scene=scene,
            policy=policy,
            scale=scale,
            path=folder / f"{scene.scene_id}.{policy}.{scale:g}.mcap",
            **shared_of(stage),
        )
        for scene in scenes
        for policy in policies
    ]


def contacts_jobs(stage: StageContext, scenes: Sequence[ClutterScene]) -> list[ContactsJob]:
    """Contacts in some clutters of each level, of the evaluated split and of families seen before.

    Parameters
    ----------
    stage
        Stage evaluate.
    scenes
        All scenes of the run, in order.

    Returns
    -------
    A job for each of those clutters, which lie equally far apart in their order.
    """
    wanted = stage.config.evaluate
    by_group: dict[tuple[str, int], list[int]] = {}
    for number, scene in enumerate(scenes):
        by_group.setdefault((scene.split, scene.level), []).append(number)
    chosen = [
        numbers[index]
        for (split, _), numbers in by_group.items()
        if split in (wanted.split, SEEN)
        for index in choose_evenly(len(numbers), wanted.precision.clutters_per_level)
    ]
    folder, places = stage.folder.state("evaluate"), scene_places(stage.upstream("scenes"))
    return [
        ContactsJob(
            scene=places[number],
            path=folder / f"{number}.contacts.mcap",
            **shared_of(stage),
        )
        for number in chosen
    ]


def shared_of(stage: StageContext) -> dict[str, Any]:
    """What all jobs of a stage are given."""
    return {
        "objects": stage.upstream("objects"),
        "network": stage.inputs.get(GIVEN_NETWORK) or stage.upstream("train"),
        "config": stage.config,
        "provenance": stage.provenance(),
    }


def work(job: ClutterJob | ContactsJob) -> Path:
    """Do one work item, unless its file is there already."""
    if not is_current(job.path, job.provenance.key):
        topic, messages = (
            ("/attempts", attempts_at(job, job.policy))
            if isinstance(job, ClutterJob)
            else ("/contacts", contacts_at(job))
        )
        with ArtifactWriter(job.path, job.provenance) as artifact:
            for number, message in enumerate(messages):
                artifact.write(topic, message, number)
    return job.path


def attempts_at(job: ClutterJob, policy: PolicyName) -> list[Attempt]:
    """A policy's attempts at a clutter."""
    objects = {name: item for name, (item, _) in catalogue(job.objects).items()}
    scene, config = job.scene, with_imperfection(job.config, job.scale)
    score = rates_for(policy, job.network, config)
    rng = generator(config.seed, "evaluate", scene.scene_id)
    made = run_clutter(scene, objects, policy, score, config, rng)
    about, judge = (scene.scene_id, scene.level, len(scene.objects)), config.evaluate.judge
    return [
        attempt_message(*about, number, policy, judge, attempt, job.config)
        for number, attempt in enumerate(made)
    ]


def contacts_at(job: ContactsJob) -> list[ProposedContacts]:
    """Contacts in a clutter's pictures, rated and labelled: one message."""
    scene = read_scene(*job.scene)
    meshes = {name: item.mesh for name, (item, _) in catalogue(job.objects).items()}
    network, analytic = (rates_for(policy, job.network, job.config) for policy in RATED_BY)
    rng = generator(job.config.seed, "evaluate contacts", scene.scene_id)
    found = propose_contacts(scene, meshes, network, analytic, job.config, rng)
    return [contacts_message(scene, found)]


def made_in(jobs: Sequence[ClutterJob | ContactsJob], kind: type[M]) -> Iterator[M]:
    """All messages of a kind in jobs that are done, in their order, one in memory at a time."""
    for job in jobs:
        with open_artifact(job.path) as artifact:
            yield from (message for _, message in artifact.messages(kind))
