"""The six stages as data, the study beside them, and the files that each of them reads."""

from collections.abc import Sequence
from pathlib import Path

from pipeline.artifacts.named_inputs import (
    FAMILIES_FILE,
    FURTHER,
    MASSES_FILE,
    RELEASED,
    STARTING_NETWORK,
    named_networks,
    object_inputs,
    training_inputs,
)
from pipeline.config import load_run_config
from pipeline.errors import ConfigError
from pipeline.execution.stage import RunFolder, Stage
from pipeline.geometry.mesh_folders import list_mesh_files
from pipeline.network.released_files import CHECKPOINT_FILE

OBJECTS = Stage(
    "objects", ("seed", "objects", "split"), shown=("recording.objects",), drawn_apart=True
)
SCENES = Stage(
    "scenes",
    ("seed", "scenes", "cameras"),
    ("objects",),
    sharded=True,
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
    ("seed", "network", "train", "gripper"),
    ("shards",),
    shown=("recording.clouds",),
    drawn_apart=True,
)
EVALUATE = Stage(
    "evaluate",
    (
        *("seed", "evaluate", "referee", "scenes", "cameras", "gripper", "sensing"),
        *("grasps.normal_radius_rg", "grasps.clearance_rg"),
    ),
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
        inputs |= told_of_objects(folder, mesh_dir)
    if stage is TRAIN:
        inputs |= learned_from(folder)
    return inputs


def told_of_objects(folder: RunFolder, mesh_dir: Path | None) -> dict[str, Path]:
    """What a person tells of the objects; what run.toml names of it is there."""
    told = object_inputs(folder.path, load_run_config(folder.config), mesh_dir)
    for name, named_by in ((FAMILIES_FILE, "split.families"), (MASSES_FILE, "objects.masses")):
        if name in told and not told[name].is_file():
            raise ConfigError(f"{told[name]} is missing, and {named_by} names it", "Put it there")
    return told


def learned_from(folder: RunFolder) -> dict[str, Path]:
    """What a training reads beside its shards; all of it is there, but the run's own objects."""
    train = load_run_config(folder.config).train
    inputs = training_inputs(folder.path, train)
    for name, named in named_networks(train).items():
        if not inputs[name].is_file():
            run = starting_run(folder, named)
            remedy = f"Put a {CHECKPOINT_FILE} there"
            if run.config.is_file():
                remedy = f"Train that run first: make train RUN={run.path.resolve().name}"
            key = "train.start" if name == STARTING_NETWORK else "train.teachers"
            raise ConfigError(
                f"{inputs[name]} is missing, and {key} names it",
                f"{remedy}, or write '{RELEASED}' in its place",
            )
    if further_runs(folder, train.further_runs):
        # What they learn from is held against the objects that this run holds out.
        inputs["objects.mcap"] = folder.artifact(OBJECTS.name)
    for name, path in inputs.items():
        if name.startswith(FURTHER) and not path.is_file():
            raise ConfigError(
                f"{path} is missing, and train.further_runs names its run",
                "Make it first, with the same MESH_DIR: "
                f"make dataset RUN={path.parent.resolve().name}",
            )
    return inputs


def further_runs(folder: RunFolder, named: Sequence[str]) -> list[RunFolder]:
    """The runs that ``train.further_runs`` of a run names: each once, and not this one."""
    seen = {folder.path.resolve()}
    runs = []
    for one in named:
        run = RunFolder(folder.path / one)
        if run.path.resolve() in seen:
            raise ConfigError(
                f"train.further_runs names {one}, which is this run or was named before",
                "Name each other run once: a run's own samples are learnt from anyhow",
            )
        seen.add(run.path.resolve())
        runs.append(run)
    return runs


def starting_run(folder: RunFolder, named: str) -> RunFolder:
    """The run that a file named by ``train.start`` lies in, if it is <run>/train/<file>."""
    return RunFolder((folder.path / named).parent.parent)
