"""Stage 6, evaluate: checkpoint → closed-loop success by level on held-out clutters."""

import os
import shutil
import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact
from pipeline.artifacts.sharding import is_current
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
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.messages.evaluation import attempt_message
from pipeline.messages.evaluation_curve import curve_figures, curve_of, curve_scenes
from pipeline.messages.evaluation_results import Results, results_of
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scenes
from pipeline.messages.training import EXPORT
from pipeline.network.control_inference import ControlPredictor
from pipeline.recording.evaluate import draw_evaluate
from pipeline.recording.results import curve_markdown, results_markdown
from pipeline.simulation.imperfection import with_imperfection
from pipeline.simulation.picking import run_clutter
from pipeline.world.scene import ClutterScene
from schemas.softgrip.v1.evaluation_pb2 import Attempt, Comparison, LevelResult
from stages.graph import EVALUATE, GIVEN_NETWORK, RUNS_DIR, inputs_of

SCORE_THREADS = 1  # clutters run side by side, a worker a core


@dataclass(frozen=True)
class ClutterJob:
    """One work item: all attempts of one policy at one clutter."""

    scene: ClutterScene
    policy: PolicyName
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
    done = run_in_order(pick_clutter, list(jobs.values()), stage.workers, stage.executor)
    list(progress(done, len(jobs), "evaluate: clutters", "clutter"))
    attempts = attempts_of(contest)
    results = results_of(scenes, wanted.policies, attempts, accelerations)
    points = curve_of(
        some,
        robot.curve_policies,
        {scale: attempts_of(part) for scale, part in curve.items()},
        accelerations,
    )
    publish(stage, attempts, results, points)
    shutil.rmtree(stage.folder.state("evaluate"))
    return {**results.summary(), "imperfection": curve_figures(points)}


def clutters(stage: StageContext) -> list[ClutterScene]:
    """The clutters of ``evaluate.split``. Raises ArtifactError where there is none."""
    split = stage.config.evaluate.split
    scenes = [s for s in read_scenes(stage.upstream("scenes")) if s.split == split]
    if not scenes:
        raise ArtifactError(
            f"{stage.upstream('scenes')} holds no {split} clutter",
            f"Give scenes.clutters_per_level.{split} at least one",
        )
    return scenes


def clutter_jobs(
    stage: StageContext,
    scenes: list[ClutterScene],
    policies: tuple[PolicyName, ...],
    scale: float,
) -> list[ClutterJob]:
    """Every policy at every clutter, on a robot whose errors have this scale."""
    return [
        ClutterJob(
            scene=scene,
            policy=policy,
            path=stage.folder.state("evaluate") / f"{scene.scene_id}.{policy}.{scale:g}.mcap",
            objects=stage.upstream("objects"),
            network=stage.inputs.get(GIVEN_NETWORK) or stage.upstream("train"),
            config=stage.config,
            provenance=stage.provenance(),
            scale=scale,
        )
        for scene in scenes
        for policy in policies
    ]


def pick_clutter(job: ClutterJob) -> Path:
    """Make, or keep, the attempts at one clutter."""
    if is_current(job.path, job.provenance.key):
        return job.path
    objects = {name: item for name, (item, _) in catalogue(job.objects).items()}
    score = network(job.network).predict
    rng = generator(job.config.seed, "evaluate", job.scene.scene_id)
    config = with_imperfection(job.config, job.scale)
    made = run_clutter(job.scene, objects, job.policy, score, config, rng)
    scene = job.scene
    with ArtifactWriter(job.path, job.provenance) as artifact:
        for number, attempt in enumerate(made):
            message = attempt_message(
                scene.scene_id,
                scene.level,
                len(scene.objects),
                number,
                job.policy,
                job.config.evaluate.judge,
                attempt,
                job.config,
            )
            artifact.write("/attempts", message, log_time_ns=number)
    return job.path


@lru_cache(maxsize=1)
def catalogue(objects: Path) -> dict[str, tuple[CatalogueObject, str]]:
    """The object catalogue, read once a worker."""
    return read_objects(objects)


@lru_cache(maxsize=1)
def network(path: Path) -> ControlPredictor:
    """The network as exported for control, of a train artifact or given; read once a worker."""
    if path.name == GIVEN_NETWORK:
        return ControlPredictor(path.read_bytes(), SCORE_THREADS)
    with open_artifact(path) as artifact:
        return ControlPredictor(artifact.attachment(EXPORT), SCORE_THREADS)


def attempts_of(jobs: list[ClutterJob]) -> list[Attempt]:
    """All attempts of jobs that are done, in their order."""
    found: list[Attempt] = []
    for job in jobs:
        with open_artifact(job.path) as artifact:
            found += [message for _, message in artifact.messages(Attempt)]
    return found


def publish(
    stage: StageContext, attempts: list[Attempt], results: Results, curve: list[LevelResult]
) -> None:
    """Write the artifact."""
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        for number, message in enumerate(attempts):
            artifact.write("/attempts", message, log_time_ns=number)
        for number, result in enumerate(results.levels):
            artifact.write("/levels", result, log_time_ns=number)
        for number, result in enumerate(results.policies):
            artifact.write("/policies", result, log_time_ns=number)
        for number, comparison in enumerate(results.comparisons):
            artifact.write("/comparisons", comparison, log_time_ns=number)
        for number, result in enumerate(curve):
            artifact.write("/imperfection", result, log_time_ns=number)


def print_table(folder: RunFolder) -> None:
    """The table of a finished evaluation."""
    with open_artifact(folder.artifact("evaluate")) as artifact:
        levels = [message for _, message in artifact.messages(LevelResult, "/levels")]
        policies = [message for _, message in artifact.messages(LevelResult, "/policies")]
        comparisons = [message for _, message in artifact.messages(Comparison)]
        curve = [message for _, message in artifact.messages(LevelResult, "/imperfection")]
    sys.stdout.write(results_markdown(levels, policies, comparisons) + curve_markdown(curve))


if __name__ == "__main__":
    if sys.argv[1:] == ["--table"]:
        print_table(RunFolder(RUNS_DIR / os.environ.get("RUN", "default")))
    else:
        stage_command(EVALUATE, build, inputs_of, draw=draw_evaluate)
