"""Stage 6, evaluate: checkpoint → closed-loop success by level on held-out clutters."""

import os
import shutil
import sys
from collections.abc import Iterable, Sequence
from itertools import groupby, islice

from google.protobuf.message import Message

from pipeline.artifacts import ArtifactWriter
from pipeline.clutter.levels import clutter_number
from pipeline.errors import ArtifactError
from pipeline.execution import (
    RunFolder,
    StageContext,
    Summary,
    progress,
    run_in_order,
    stage_command,
)
from pipeline.messages.evaluation_curve import curve_figures, curve_of, curve_scenes
from pipeline.messages.evaluation_results import results_of, without_film
from pipeline.messages.objects import catalogue
from pipeline.messages.proposed_contacts import proposed_of
from pipeline.messages.scenes import read_unseen_scenes
from pipeline.world.scene import ClutterScene
from schemas.softgrip.v1.evaluation_pb2 import Attempt, ProposedContacts
from stages.attempts import ClutterJob, ContactsJob, clutter_jobs, contacts_jobs, made_in, work
from stages.graph import EVALUATE, RUNS_DIR, inputs_of


def build(stage: StageContext) -> Summary:
    """Empty the clutters of a split in closed loop, grasp by grasp; physics judges success."""
    every_scene = read_unseen_scenes(stage.upstream("scenes"))
    scenes = clutters(stage, every_scene)
    wanted = stage.config.evaluate
    robot, accelerations = wanted.imperfection, wanted.transport.accelerations_m_s2
    some = curve_scenes(scenes, robot.curve_clutters)
    contest = clutter_jobs(stage, scenes, wanted.policies, robot.scale)
    curve = {scale: clutter_jobs(stage, some, robot.curve_policies, scale) for scale in robot.curve}
    # A policy, a clutter and a scale that both ask for are one job.
    jobs = {job.path: job for part in (contest, *curve.values()) for job in part}
    rated = contacts_jobs(stage, every_scene)
    every: list[ClutterJob | ContactsJob] = [*jobs.values(), *rated]
    limit_s, store = stage.item_limit_s, stage.store
    done = run_in_order(work, every, stage.workers, stage.executor, limit_s=limit_s, store=store)
    list(progress(done, len(jobs) + len(rated), "evaluate: clutters", "clutter"))
    attempts = without_film(made_in(contest, Attempt))
    results = results_of(scenes, wanted.policies, attempts, accelerations)
    tried = {scale: without_film(made_in(part, Attempt)) for scale, part in curve.items()}
    points = curve_of(some, robot.curve_policies, tried, accelerations)
    items = catalogue(stage.upstream("objects"))
    classes = {name: str(item.shape_class) for name, (item, _) in items.items()}
    contacts = list(made_in(rated, ProposedContacts))
    proposed = proposed_of(contacts, classes, wanted.precision, wanted.split)
    whole = made_in(contest, Attempt)
    topics: dict[str, Iterable[Message]] = {"/attempts": whole, "/imperfection": points}
    topics |= results.topics() | proposed.topics()
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        for topic, messages in topics.items():
            for number, message in enumerate(messages):
                artifact.write(topic, message, log_time_ns=number)
    shutil.rmtree(stage.folder.state("evaluate"))
    return {**results.summary(), "imperfection": curve_figures(points), **proposed.summary()}


def clutters(stage: StageContext, every_scene: Sequence[ClutterScene]) -> list[ClutterScene]:
    """The clutters that [evaluate] names.

    Parameters
    ----------
    stage
        Stage evaluate.
    every_scene
        All scenes of the run.

    Returns
    -------
    Those of the evaluated split from the first wanted number on, of each level no more than are
    wanted, in the same order.

    Raises
    ------
    ArtifactError
        There is none.
    """
    wanted = stage.config.evaluate
    split, first, most = wanted.split, wanted.clutters_from, wanted.clutters_per_level
    of_split = [scene for scene in every_scene if scene.split == split]
    scenes = [scene for scene in of_split if clutter_number(scene.scene_id) >= first]
    if most:
        by_level = groupby(scenes, key=lambda scene: scene.level)
        scenes = [scene for _, of_level in by_level for scene in islice(of_level, most)]
    if not scenes:
        raise ArtifactError(
            f"{stage.upstream('scenes')} holds no {split} clutter from number {first} on",
            f"Give scenes.clutters_per_level.{split} at least {first + 1}",
        )
    return scenes


if __name__ == "__main__":
    # Not in workers: they draw nothing.
    from pipeline.recording.evaluate import draw_evaluate
    from pipeline.recording.results import read_tables

    if sys.argv[1:] == ["--table"]:
        finished = RunFolder(RUNS_DIR / os.environ.get("RUN", "default"))
        sys.stdout.write(read_tables(finished.artifact("evaluate")))
    else:
        stage_command(EVALUATE, build, inputs_of, draw=draw_evaluate)
