"""What Make asks: ``key STAGE`` rewrites a key file if its digest changed; ``status`` says what is
stale and why; ``plan GOAL`` says what a make will do, about how long it takes and how much disk.
"""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.artifacts import publish_bytes
from pipeline.config import load_run_config
from pipeline.errors import ArtifactError, ConfigError
from pipeline.execution.commands import run_command
from pipeline.execution.run_store import fetch_configuration
from pipeline.execution.sealing import is_sealed
from pipeline.execution.stage import RunFolder, Stage, StageContext
from pipeline.execution.staleness import (
    RECORDING_ALONE,
    built_key,
    missing_shards,
    recording_is_fresh,
    stage_context,
    why_stale,
)
from pipeline.geometry.mesh_folders import list_mesh_files
from pipeline.housekeeping.forecast import Forecast, as_lines, forecast, total_s, work_of
from pipeline.housekeeping.listing import free_disk_bytes, run_folders
from stages.graph import EVALUATE, MADE, OBJECTS, RUNS_DIR, SHARDS, STAGES, TRAIN, inputs_of

# Goals of Make that are not named like the stage that they end with.
GOALS = {"dataset": SHARDS.name, "eval": EVALUATE.name}
PLANNED_FROM_S = 60.0  # a make that takes longer tells beforehand what it will do
SEALED_DATE = 0  # of a sealed run's key files: older than any artifact

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
RunName = Annotated[str, typer.Option(envvar="RUN")]
MeshDir = Annotated[Path | None, typer.Option(envvar="MESH_DIR")]


@app.command()
def key(stage: str, run: RunName = "default", mesh_dir: MeshDir = None) -> None:
    """Rewrite a stage's key file if what it depends on changed; of a sealed run never."""
    folder = RunFolder(RUNS_DIR / run)
    fetch_configuration(folder)
    if is_sealed(folder):
        _keep_sealed(folder, stage)
        return
    goals = os.environ.get("GOALS", "").split()
    trains = {TRAIN.name, EVALUATE.name} & {GOALS.get(goal, goal) for goal in goals}
    if MADE[stage] is OBJECTS and trains:
        inputs_of(TRAIN, folder, None)  # what run.toml names must be there before hours of work
    context = stage_context(MADE[stage], folder, inputs_of, mesh_dir, workers=1)
    path = folder.state(f"{stage}.key")
    text = context.key.to_json() + context.drawing_key.to_json()
    if path.is_file() and path.read_text() == text and not _lacking(context):
        return
    if context.output.is_file():
        for reason in why_stale(context):
            logger.info("{}: {}", stage, reason)
    publish_bytes(path, text.encode())
    if MADE[stage] is OBJECTS:
        # What train and eval stay with when they are called without MESH_DIR.
        publish_bytes(folder.state("mesh_dir"), str(mesh_dir or "").encode())
        _tell_plan(folder, mesh_dir, goals)


@app.command()
def plan(goal: str, run: RunName = "default", mesh_dir: MeshDir = None) -> None:
    """Print what `make GOAL` will do, about how long it takes and how much disk."""
    folder = RunFolder(RUNS_DIR / run)
    lines = as_lines(planned(folder, mesh_dir, [goal]), free_disk_bytes(folder))
    sys.stdout.write("\n".join(lines) + "\n")


@app.command()
def status(run: RunName = "default", mesh_dir: MeshDir = None) -> None:
    """Print for every stage whether it is up to date, and if not, why."""
    folder = RunFolder(RUNS_DIR / run)
    if is_sealed(folder):
        sys.stdout.write(f"{folder.path} is sealed: nothing in it is made anew\n")
        return
    for name, reason in reasons(folder, mesh_dir, list(STAGES)).items():
        sys.stdout.write(f"{name:<9} {'stale: ' + reason if reason else 'up to date'}\n")


@app.command()
def fresh(stage: str, run: RunName = "default") -> None:
    """Print the last line of a Make goal: the stage is up to date."""
    sys.stdout.write(f"{RunFolder(RUNS_DIR / run).artifact(stage)} is up to date\n")


def reasons(folder: RunFolder, mesh_dir: Path | None, names: list[str]) -> dict[str, str]:
    """Stage → why it is stale, in words; empty where it is not."""
    stale: set[str] = set()
    found = {}
    for name in names:
        found[name] = reason = _staleness(MADE[name], folder, mesh_dir, stale)
        if reason and not reason.startswith(RECORDING_ALONE):
            stale.add(name)
    return found


def planned(folder: RunFolder, mesh_dir: Path | None, goals: list[str]) -> list[Forecast]:
    """What is made on the way to some goals of Make.

    Parameters
    ----------
    folder
        The run.
    mesh_dir
        Folder of meshes; None: the embedded objects.
    goals
        Goals of Make; none: nothing is made.

    Returns
    -------
    One forecast for each stage that is not up to date.

    Raises
    ------
    ConfigError
        A goal ends with no stage.
    """
    # Loaded where a plan is made, not for each of a make's six keys: it takes a second.
    from pipeline.geometry.parametric import PARAMETRIC_OBJECTS
    from pipeline.housekeeping.kept import taken_over

    names = list(STAGES)
    ends = [GOALS.get(goal, goal) for goal in goals]
    if unknown := [end for end in ends if end not in STAGES]:
        raise ConfigError(f"'{unknown[0]}' is no goal that makes artifacts", f"One of {names}")
    wanted = names[: 1 + max(map(names.index, ends))] if ends and not is_sealed(folder) else []
    config = load_run_config(folder.config)
    meshes = list_mesh_files(mesh_dir)[: config.objects.limit or None] if mesh_dir else []
    embedded = not meshes or config.objects.embedded_in_training
    sources = len(meshes) + (len(PARAMETRIC_OBJECTS) if embedded else 0)
    others = list(run_folders(RUNS_DIR))
    named = [RunFolder(folder.path / one).config for one in config.train.further_runs]
    further = [load_run_config(path) for path in named if path.is_file()]

    def context_of(name: str) -> StageContext:
        return stage_context(MADE[name], folder, inputs_of, mesh_dir, workers=1)

    return [
        forecast(name, reason, config, sources, others, kept, bool(meshes), further)
        for name, reason in reasons(folder, mesh_dir, wanted).items()
        if reason and not reason.startswith(RECORDING_ALONE)
        for kept in [taken_over(name, context_of, work_of(name, config, sources))]
    ]


def _tell_plan(folder: RunFolder, mesh_dir: Path | None, goals: list[str]) -> None:
    """Before a long make, say what it will do; silent for short ones and for other goals."""
    made = [goal for goal in goals if GOALS.get(goal, goal) in STAGES]
    forecasts = planned(folder, mesh_dir, made)
    if total_s(forecasts) >= PLANNED_FROM_S:
        for line in as_lines(forecasts, free_disk_bytes(folder)):
            logger.info("{}", line)


def _keep_sealed(folder: RunFolder, stage: str) -> None:
    """Let Make find a sealed artifact newer than its key file, on a machine that has none."""
    path = folder.state(f"{stage}.key")
    if not folder.artifact(stage).is_file():
        raise ArtifactError(
            f"{folder.path} is sealed without {stage}, and makes nothing more",
            f"Take the seal off: make unseal RUN={folder.path.name}",
        )
    if not path.is_file():
        publish_bytes(path, b"")
    os.utime(path, (SEALED_DATE, SEALED_DATE))


def _staleness(stage: Stage, folder: RunFolder, mesh_dir: Path | None, stale: set[str]) -> str:
    waits_for = [name for name in stage.upstream if name in stale]
    if waits_for:
        return f"after {', '.join(waits_for)}"
    return "; ".join(why_stale(stage_context(stage, folder, inputs_of, mesh_dir, workers=1)))


def _lacking(context: StageContext) -> bool:
    """Whether a finished stage lacks something: Make sees the artifact, or its index, alone."""
    if not context.output.is_file():
        return False
    built = built_key(context.folder, context.name)
    if built is not None and not built.is_final:
        return True
    shards_lost = context.stage.sharded and bool(missing_shards(context.output))
    return shards_lost or not recording_is_fresh(context)


if __name__ == "__main__":
    os.environ.setdefault("MESH_DIR", "")
    if not os.environ["MESH_DIR"]:
        del os.environ["MESH_DIR"]
    run_command(app)
