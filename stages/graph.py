"""The six stages as data, the study beside them, and the files that each of them reads."""

from pathlib import Path

from pipeline.artifacts.listing import artifacts_in
from pipeline.config import load_run_config
from pipeline.errors import ConfigError
from pipeline.execution.stage import RunFolder, Stage
from pipeline.geometry.mesh_folders import FAMILIES_FILE, MASSES_FILE, list_mesh_files
from pipeline.network.released_files import CHECKPOINT_FILE, RELEASED, RELEASED_FOLDER

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
ATTEMPTS = "attempts/"  # before the number of each input that ``train.attempts`` names
STARTING_NETWORK = "start.safetensors"  # the input that ``train.start`` names
FURTHER = "further/"  # before the number of each run that ``train.further_runs`` names


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
    if stage is TRAIN:
        logged = [folder.path / one for one in load_run_config(folder.config).train.attempts]
        inputs |= {f"{ATTEMPTS}{n}": path for n, path in enumerate(artifacts_in(logged))}
    if stage is TRAIN and (named := load_run_config(folder.config).train.start):
        inputs[STARTING_NETWORK] = starting_file(folder, named)
    if stage is TRAIN and (further := further_runs(folder)):
        # What they learn from is held against the objects that this run holds out.
        inputs["objects.mcap"] = folder.artifact(OBJECTS.name)
        for number, run in enumerate(further):
            for made in (OBJECTS.name, SHARDS.name):
                inputs[f"{FURTHER}{number:03d}/{made}.mcap"] = run.artifact(made)
    return inputs


def further_runs(folder: RunFolder) -> list[RunFolder]:
    """The runs that ``train.further_runs`` names, each with its dataset."""
    named = load_run_config(folder.config).train.further_runs
    runs = [RunFolder(folder.path / one) for one in named]
    for run in runs:
        for made in (OBJECTS.name, SHARDS.name):
            if not run.artifact(made).is_file():
                raise ConfigError(
                    f"{run.artifact(made)} is missing, and train.further_runs names its run",
                    f"Make it first: make dataset RUN={run.path.resolve().name}",
                )
    return runs


def starting_file(folder: RunFolder, named: str) -> Path:
    """The file that ``train.start`` names: the released network's, or one beside run.toml."""
    path = RELEASED_FOLDER / CHECKPOINT_FILE if named == RELEASED else folder.path / named
    if not path.is_file():
        run = starting_run(folder, named)
        remedy = f"Put a {CHECKPOINT_FILE} there"
        if run.config.is_file():
            remedy = f"Train that run first: make train RUN={run.path.resolve().name}"
        raise ConfigError(
            f"{path} is missing, and train.start names it",
            f"{remedy}, or write train.start = '{RELEASED}'",
        )
    return path


def starting_run(folder: RunFolder, named: str) -> RunFolder:
    """The run that a file named by ``train.start`` lies in, if it is <run>/train/<file>."""
    return RunFolder((folder.path / named).parent.parent)


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
