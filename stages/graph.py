"""The six stages as data, the study beside them, and what Make asks about them.

``python -m stages.graph key STAGE`` rewrites a stage's key file only when its
digest changed; ``status`` says what is stale and why.
"""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.artifacts import publish_bytes
from pipeline.config import load_run_config
from pipeline.errors import ConfigError
from pipeline.execution.commands import run_command
from pipeline.execution.stage import RunFolder, Stage, StageContext
from pipeline.execution.staleness import (
    RECORDING_ALONE,
    built_key,
    missing_shards,
    recording_is_fresh,
    stage_context,
    why_stale,
)
from pipeline.geometry.mesh_folders import FAMILIES_FILE, MASSES_FILE, list_mesh_files

OBJECTS = Stage(
    "objects", ("seed", "objects", "split"), shown=("recording.objects",), drawn_apart=True
)
SCENES = Stage(
    "scenes",
    ("seed", "scenes", "cameras"),
    ("objects",),
    renders=True,
    shown=("recording.scenes",),
    drawn_apart=True,
)
GRASPS = Stage(
    "grasps",
    # Draped pads for the recording lie in the shards: their number decides bytes.
    ("seed", "gripper", "sensing", "grasps", "recording.grasps"),
    ("objects", "scenes"),
    sharded=True,
    drawn_apart=True,
)
SHARDS = Stage(
    "shards",
    ("seed", "shards"),
    ("grasps",),
    sharded=True,
    shown=("recording.clouds",),
    drawn_apart=True,
)
TRAIN = Stage(
    "train",
    ("seed", "network", "train", "gripper.pad"),
    ("shards",),
    shown=("recording.clouds",),
    drawn_apart=True,
)
EVALUATE = Stage(
    "evaluate",
    ("seed", "evaluate", "referee", "scenes", "cameras", "gripper", "sensing"),
    ("objects", "scenes", "train"),
    shown=("recording.attempts",),
    drawn_apart=True,
)
STAGES = {stage.name: stage for stage in (OBJECTS, SCENES, GRASPS, SHARDS, TRAIN, EVALUATE)}

# Beside the pipeline: nothing downstream reads it, and it is made only when asked for.
SWEEP = Stage("sweep", ("seed", "network", "train", "sweep"), ("shards",), drawn_apart=True)
MADE = {**STAGES, SWEEP.name: SWEEP}

RUNS_DIR = Path("runs")
# A network in a run's folder that stands in the place of one trained there; `make holdout`.
GIVEN_NETWORK = "network.onnx"


def inputs_of(stage: Stage, folder: RunFolder, mesh_dir: Path | None) -> dict[str, Path]:
    """Name → file of everything a stage reads."""
    inputs = {f"{name}.mcap": folder.artifact(name) for name in stage.upstream}
    if stage is EVALUATE and (given := folder.path / GIVEN_NETWORK).is_file():
        inputs = {n: path for n, path in inputs.items() if n != "train.mcap"}
        inputs[GIVEN_NETWORK] = given
    if stage is OBJECTS and mesh_dir is not None:
        files = list_mesh_files(mesh_dir)
        inputs |= {f"meshes/{path.relative_to(mesh_dir).as_posix()}": path for path in files}
    if stage is OBJECTS:
        config = load_run_config(folder.config)
        for file, named_by, named in (
            (FAMILIES_FILE, "split.families", config.split.families),
            (MASSES_FILE, "objects.masses", config.objects.masses),
        ):
            if path := told_of_objects(folder, mesh_dir, file, named_by, named):
                inputs[file] = path
    return inputs


def told_of_objects(
    folder: RunFolder, mesh_dir: Path | None, file: str, named_by: str, named: str
) -> Path | None:
    """What a person tells of the objects: the file that run.toml names, else the mesh folder's."""
    if named:
        path = folder.path / named
        if not path.is_file():
            raise ConfigError(f"{path} is missing, and {named_by} names it", "Put it there")
        return path
    beside = mesh_dir / file if mesh_dir else None
    return beside if beside and beside.is_file() else None


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
RunName = Annotated[str, typer.Option(envvar="RUN")]
MeshDir = Annotated[Path | None, typer.Option(envvar="MESH_DIR")]


@app.command()
def key(stage: str, run: RunName = "default", mesh_dir: MeshDir = None) -> None:
    """Rewrite a stage's key file if what it depends on changed."""
    folder = RunFolder(RUNS_DIR / run)
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


@app.command()
def status(run: RunName = "default", mesh_dir: MeshDir = None) -> None:
    """Print for every stage whether it is up to date, and if not, why."""
    folder = RunFolder(RUNS_DIR / run)
    stale: set[str] = set()
    for name, stage in STAGES.items():
        reason = _staleness(stage, folder, mesh_dir, stale)
        if reason and not reason.startswith(RECORDING_ALONE):
            stale.add(name)
        sys.stdout.write(f"{name:<9} {'stale: ' + reason if reason else 'up to date'}\n")


@app.command()
def fresh(stage: str, run: RunName = "default") -> None:
    """Print the last line of a Make goal: the stage is up to date."""
    sys.stdout.write(f"{RunFolder(RUNS_DIR / run).artifact(stage)} is up to date\n")


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
