"""Whether a stage of a run is fresh, and which of the things it depends on changed."""

from collections.abc import Callable
from pathlib import Path

from loguru import logger

from pipeline.artifacts import open_artifact, read_provenance
from pipeline.artifacts.digests import MEMO
from pipeline.artifacts.sharding import INDEX_TOPIC
from pipeline.config import load_run_config
from pipeline.errors import ArtifactError, ConfigError
from pipeline.execution.code import DRAWING, RUNNING
from pipeline.execution.freshness import Key, drawing_key, key_from_json, stage_key
from pipeline.execution.renderer import identify_renderer
from pipeline.execution.stage import RunFolder, Stage, StageContext
from schemas.softgrip.v1.grasps_pb2 import ShardIndex

InputsOf = Callable[[Stage, RunFolder, Path | None], dict[str, Path]]

RENDERER_MEMO = "renderer.json"
RECORDING_ALONE = "recording alone"


def stage_context(
    stage: Stage,
    folder: RunFolder,
    inputs_of: InputsOf,
    mesh_dir: Path | None,
    workers: int,
    memo: str = MEMO,
) -> StageContext:
    """Read a stage's configuration, inputs and keys as things are now.

    Parameters
    ----------
    stage
        The stage.
    folder
        Paths of the run.
    inputs_of
        Gives name → file of everything a stage reads.
    mesh_dir
        Folder of meshes; None: the embedded objects.
    workers
        Processes to work in.
    memo
        Name of the file, in the run's state, that keeps hashes of unchanged inputs.

    Returns
    -------
    The context to run the stage in.

    Raises
    ------
    ConfigError
        The run has no plain name, or its run.toml cannot be used.
    ArtifactError
        An upstream artifact is missing.
    MachineError
        The configuration asks for a renderer that this machine has not.
    """
    if "/" in folder.path.name or folder.path.name in ("", ".", ".."):
        raise ConfigError(f"'{folder.path.name}' is no run name", "Use a plain name")
    config = load_run_config(folder.config)
    inputs = inputs_of(stage, folder, mesh_dir)
    for name, path in inputs.items():
        if not path.is_file():
            raise ArtifactError(
                f"{path} is missing, and {stage.name} reads it",
                f"Make {name} first: 'make {stage.name} RUN={folder.path.name}' does both",
            )
    renderer = ""
    if stage.renders:
        renderer = identify_renderer(config.cameras.renderer, folder.state(RENDERER_MEMO))
    without = DRAWING + RUNNING if stage.drawn_apart else RUNNING
    key = stage_key(
        config, stage.sections, stage.module, inputs, folder.state(memo), renderer, without
    )
    drawn = drawing_key(config, stage.shown, stage.drawing_module, key)
    return StageContext(stage, config, folder, key, drawn, inputs, workers, mesh_dir)


def is_fresh(context: StageContext) -> bool:
    """Whether artifact and recording are what they would be if they were made now."""
    return artifact_is_fresh(context) and recording_is_fresh(context)


def artifact_is_fresh(context: StageContext) -> bool:
    """Whether the stage's artifact is whole and was made from what is there now."""
    output = context.output
    if not output.is_file():
        return False
    try:
        if read_provenance(output).key != context.key.digest:
            return False
        return not context.stage.sharded or not missing_shards(output)
    except ArtifactError as error:
        logger.warning("{}", error)
        return False


def recording_is_fresh(context: StageContext) -> bool:
    """Whether the recording is there and was drawn from this artifact, by the code of today."""
    if not context.recording.is_file():
        return False
    if not context.stage.drawn_apart:
        return True
    drawn = drawn_key(context.folder, context.name)
    return drawn is not None and drawn.digest == context.drawing_key.digest


def missing_shards(index: Path) -> list[Path]:
    """Files that a sharded artifact's index names and that are not there.

    Of a version whose stage wrote one file alone, there is no index, and none is missing.
    """
    with open_artifact(index) as artifact:
        if INDEX_TOPIC not in artifact.counts():
            return []
        entries = artifact.one(ShardIndex).shards
    paths = [index.parent / entry.path for entry in entries]
    return [path for path in paths if not path.is_file()]


def why_stale(context: StageContext) -> list[str]:
    """Why a stage is not fresh, in words; empty where it is."""
    if artifact_is_fresh(context):
        return [] if recording_is_fresh(context) else [f"{RECORDING_ALONE}: {_why_drawn(context)}"]
    if not context.output.is_file():
        return ["never made"]
    built = built_key(context.folder, context.name)
    if built is None:
        return ["the artifact is damaged, or of a softgrip that did not note what it was made from"]
    return context.key.differences(built) or ["a shard is missing"]


def _why_drawn(context: StageContext) -> str:
    """Why the recording of a fresh artifact is stale."""
    if not context.recording.is_file():
        return "missing"
    drawn = drawn_key(context.folder, context.name)
    if drawn is None:
        return "what drew it is not known"
    return "; ".join(context.drawing_key.differences(drawn))


def built_key(folder: RunFolder, stage: str) -> Key | None:
    """The key that a stage's artifact was made with; None where there is none to be read."""
    try:
        return key_from_json(read_provenance(folder.artifact(stage)).key_parts)
    except (ArtifactError, ValueError):
        return None


def drawn_key(folder: RunFolder, stage: str) -> Key | None:
    """The key that a stage's recording was drawn with; None where there is none to be read."""
    try:
        return key_from_json(drawing_note_path(folder, stage).read_text())
    except (FileNotFoundError, ValueError):
        return None


def drawing_note_path(folder: RunFolder, stage: str) -> Path:
    """File of the run's state that holds the key a recording was drawn with."""
    return folder.state(f"{stage}.drawn.json")
