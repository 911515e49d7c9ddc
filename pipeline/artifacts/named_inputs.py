"""Inputs that lie outside of a run's folder, and where: what its run.toml or mesh folder names.

Provenance calls an input by a name that holds on every machine; here is the file behind it.
"""

from collections.abc import Mapping
from pathlib import Path

from pipeline.artifacts.listing import artifacts_in
from pipeline.config import RunConfig
from pipeline.config.learning import TrainConfig

FAMILIES_FILE = "families.toml"  # what a person declares to be alike
MASSES_FILE = "masses.toml"  # what objects weigh
ATTEMPTS = "attempts/"  # before the number of each input that ``train.attempts`` names
STARTING_NETWORK = "start.safetensors"  # the input that ``train.start`` names
TEACHERS = "teachers/"  # before the number of each network that ``train.teachers`` names
FURTHER = "further/"  # before the number of each run that ``train.further_runs`` names
FURTHER_FILES = ("objects.mcap", "shards.mcap")  # of each of them
RELEASED = "released"  # what a person writes in a network's place
RELEASED_CHECKPOINT = Path(__file__).parents[1] / "network" / "released" / "ga_cnn.safetensors"


def noted_mesh_dir(run: Path) -> Path | None:
    """The mesh folder that Make noted in a run; None for the embedded objects."""
    note = run / ".state" / "mesh_dir"
    named = note.read_text().strip() if note.is_file() else ""
    return Path(named) if named else None


def object_inputs(run: Path, config: RunConfig, mesh_dir: Path | None) -> dict[str, Path]:
    """Files that tell of the objects: those that run.toml names, else the mesh folder's.

    Parameters
    ----------
    run
        The run's folder.
    config
        Its configuration.
    mesh_dir
        Folder of meshes; None: the embedded objects.

    Returns
    -------
    Name of the input → file, whether it is there or not.
    """
    told = {FAMILIES_FILE: config.split.families, MASSES_FILE: config.objects.masses}
    found = {name: run / named for name, named in told.items() if named}
    if mesh_dir is not None:
        beside = {name: mesh_dir / name for name in told if name not in found}
        found |= {name: path for name, path in beside.items() if path.is_file()}
    return found


def training_inputs(run: Path, train: TrainConfig) -> dict[str, Path]:
    """Files that a training reads beside the run's own shards.

    Parameters
    ----------
    run
        The run's folder.
    train
        [train] of its configuration.

    Returns
    -------
    Name of the input → file, whether it is there or not.

    Raises
    ------
    ArtifactError
        ``train.attempts`` names what is not there, or a folder without attempts.
    """
    logged = artifacts_in(run / named for named in train.attempts)
    found = {f"{ATTEMPTS}{number}": path for number, path in enumerate(logged)}
    for name, named in named_networks(train).items():
        found[name] = RELEASED_CHECKPOINT if named == RELEASED else run / named
    for number, named in enumerate(train.further_runs):
        found |= {f"{FURTHER}{number:03d}/{file}": run / named / file for file in FURTHER_FILES}
    return found


def inputs_under(inputs: Mapping[str, Path], prefix: str) -> list[Path]:
    """The files of the inputs whose names begin alike, in the order of their numbers."""
    return [path for name, path in sorted(inputs.items()) if name.startswith(prefix)]


def named_networks(train: TrainConfig) -> dict[str, str]:
    """The networks that [train] names, as it names them, by the name of the input."""
    found = {STARTING_NETWORK: train.start} if train.start else {}
    return found | {f"{TEACHERS}{number:03d}": one for number, one in enumerate(train.teachers)}


def named_inputs(run: Path, config: RunConfig, mesh_dir: Path | None) -> dict[str, Path]:
    """All of them: `object_inputs` and `training_inputs`. May raise ArtifactError as the latter."""
    return object_inputs(run, config, mesh_dir) | training_inputs(run, config.train)
