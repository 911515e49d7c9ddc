"""Stage 6, evaluate: checkpoint → closed-loop success by level on the test clutters."""

import os
import shutil
import sys
from collections import Counter
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact
from pipeline.artifacts.evaluation_messages import attempt_message
from pipeline.artifacts.object_messages import read_objects
from pipeline.artifacts.scene_messages import read_scenes
from pipeline.artifacts.sharding import is_current
from pipeline.artifacts.training_messages import read_export
from pipeline.clutter.scene import ClutterScene
from pipeline.config import RunConfig
from pipeline.control.success import success_rate
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
from pipeline.network.export import OnnxPredictor
from pipeline.recording.evaluate import blueprint, show_attempts
from pipeline.recording.recording import recording, spread
from pipeline.sensing.rendering import Renderer, new_renderer
from pipeline.simulation.picking import run_clutter
from schemas.softgrip.v1.evaluation_pb2 import Attempt, LevelResult
from stages.graph import EVALUATE, RUNS_DIR, inputs_of

SCORE_BATCH = 64
SCORE_THREADS = 1  # clutters run side by side, a worker a core


@dataclass(frozen=True)
class ClutterJob:
    """One work item: all attempts at one clutter."""

    scene: ClutterScene
    path: Path
    objects: Path
    checkpoint: Path
    config: RunConfig
    provenance: Provenance


def build(stage: StageContext) -> Summary:
    """Pick the test clutters empty in closed loop; success is judged by physics."""
    scenes = [s for s in read_scenes(stage.upstream("scenes")) if s.split == "test"]
    if not scenes:
        raise ArtifactError(
            f"{stage.upstream('scenes')} holds no test clutter",
            "Give scenes.clutters_per_level.test at least one",
        )
    jobs = [
        ClutterJob(
            scene=scene,
            path=stage.folder.state("evaluate") / f"{scene.scene_id}.mcap",
            objects=stage.upstream("objects"),
            checkpoint=stage.upstream("train"),
            config=stage.config,
            provenance=stage.provenance(),
        )
        for scene in scenes
    ]
    done = run_in_order(pick_clutter, jobs, stage.workers, stage.executor)
    parts = list(progress(done, len(jobs), "evaluate: clutters", "clutter"))
    attempts = [message for part in parts for message in read_attempts(part)]
    results = [level_result(level, scenes, attempts) for level in sorted({s.level for s in scenes})]
    publish(stage, scenes, attempts, results)
    shutil.rmtree(stage.folder.state("evaluate"))
    return {
        "attempts": len(attempts),
        "success_by_level": {
            str(r.level): {
                "rate": r.success_rate,
                "interval_95": [r.interval_low, r.interval_high],
                "lifted": r.lifted,
                "attempts": r.attempts,
                "cleared": r.cleared,
                "clutters": r.clutters,
                "failures": dict(sorted(r.failures.items())),
            }
            for r in results
        },
    }


def pick_clutter(job: ClutterJob) -> Path:
    """Make, or keep, the attempts at one clutter."""
    if is_current(job.path, job.provenance.key):
        return job.path
    objects = {name: item for name, (item, _) in catalogue(job.objects).items()}
    config = job.config
    score = partial(network(job.checkpoint).predict, batch_size=SCORE_BATCH)
    rng = generator(config.seed, "evaluate", job.scene.scene_id)
    made = run_clutter(job.scene, objects, renderer_of(config), score, config, rng)
    with ArtifactWriter(job.path, job.provenance) as artifact:
        for number, attempt in enumerate(made):
            message = attempt_message(job.scene.scene_id, job.scene.level, number, attempt)
            artifact.write("/attempts", message, log_time_ns=number)
    return job.path


@lru_cache(maxsize=1)
def catalogue(objects: Path) -> dict[str, tuple[CatalogueObject, str]]:
    """The object catalogue, read once a worker."""
    return read_objects(objects)


@lru_cache(maxsize=1)
def network(checkpoint: Path) -> OnnxPredictor:
    """The trained network as exported for control, read once a worker."""
    return OnnxPredictor(read_export(checkpoint), SCORE_THREADS)


@lru_cache(maxsize=1)
def renderer_of(config: RunConfig) -> Renderer:
    """The renderer of this worker; its first frame costs seconds, so it is kept."""
    return new_renderer(config.cameras.renderer, config.scenes)


def read_attempts(path: Path) -> list[Attempt]:
    """All attempts of a file."""
    with open_artifact(path) as artifact:
        return [message for _, message in artifact.messages(Attempt)]


def level_result(level: int, scenes: list[ClutterScene], attempts: list[Attempt]) -> LevelResult:
    """Success at one level, with its 95 % interval and the causes of its failures."""
    mine = [made for made in attempts if made.level == level]
    clutters = [scene for scene in scenes if scene.level == level]
    lifted = sum(made.outcome == "lifted" for made in mine)
    by_scene = Counter(made.scene_id for made in mine if made.outcome == "lifted")
    rate, low, high = success_rate(lifted, len(mine))
    return LevelResult(
        level=level,
        attempts=len(mine),
        lifted=lifted,
        objects=sum(len(scene.objects) for scene in clutters),
        clutters=len(clutters),
        cleared=sum(by_scene[scene.scene_id] == len(scene.objects) for scene in clutters),
        success_rate=rate,
        interval_low=low,
        interval_high=high,
        failures=Counter(made.cause for made in mine if made.outcome != "lifted"),
    )


def table(results: list[LevelResult]) -> str:
    """Success by level, as a person reads it (Markdown)."""
    rows = "\n".join(
        f"| {r.level} | {r.lifted} / {r.attempts} | {100 * r.success_rate:.0f} % "
        f"({100 * r.interval_low:.0f}-{100 * r.interval_high:.0f}) "
        f"| {r.cleared} / {r.clutters} "
        f"| {', '.join(f'{cause} {n}' for cause, n in sorted(r.failures.items())) or 'none'} |"
        for r in results
    )
    return (
        f"| level | lifted | success (95 % interval) | cleared | failures |\n|-|-|-|-|-|\n{rows}\n"
    )


def publish(
    stage: StageContext,
    scenes: list[ClutterScene],
    attempts: list[Attempt],
    results: list[LevelResult],
) -> None:
    """The film, then the artifact."""
    meshes = {n: item.mesh for n, (item, _) in catalogue(stage.upstream("objects")).items()}
    names = {s.scene_id: [placed.object_name for placed in s.objects] for s in scenes}
    shown = [attempts[i] for i in spread(len(attempts), stage.config.recording.attempts)]
    with recording(stage.recording, stage.stage.name, stage.key.digest, blueprint()) as stream:
        show_attempts(stream, shown, names, meshes, table(results))
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        for number, message in enumerate(attempts):
            artifact.write("/attempts", message, log_time_ns=number)
        for number, result in enumerate(results):
            artifact.write("/levels", result, log_time_ns=number)


def print_table(folder: RunFolder) -> None:
    """The table of a finished evaluation."""
    with open_artifact(folder.artifact("evaluate")) as artifact:
        results = [message for _, message in artifact.messages(LevelResult)]
    sys.stdout.write(table(results))


if __name__ == "__main__":
    if sys.argv[1:] == ["--table"]:
        print_table(RunFolder(RUNS_DIR / os.environ.get("RUN", "default")))
    else:
        stage_command(EVALUATE, build, inputs_of)
