"""`make predict`: a real picture in, ranked grasps out.

Reads depth images or point clouds with their cameras, finds what objects stand on, tries contacts
on what stands out of it, and writes the best grasps as JSON, CSV, MCAP, a Rerun recording and a
picture.
"""

import hashlib
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.artifacts import (
    ArtifactWriter,
    Input,
    Provenance,
    file_sha256,
    package_version,
    publish_bytes,
)
from pipeline.camera.frame_files import FrameFiles, read_frame, with_neighbours, within_workspace
from pipeline.camera.frame_support import frames_that_agree
from pipeline.camera.prediction import Prediction
from pipeline.camera.proposals import propose_grasps
from pipeline.config import RunConfig, load_run_config, section_digest
from pipeline.control.ranking import NetworkRanking
from pipeline.execution import RunFolder, generator, run_command
from pipeline.interchange.ranked_grasps import grasps_csv, grasps_json
from pipeline.messages.predictions import write_prediction
from pipeline.network.sources import ANALYTIC, RELEASED, quality_source
from pipeline.recording.overlay import grasp_picture, png_bytes
from pipeline.recording.predict import blueprint, show_prediction
from pipeline.recording.recording import recording
from pipeline.stopwatch import Stopwatch
from stages.graph import RUNS_DIR

SECTIONS = ("seed", "predict", "gripper", "sensing", "grasps", "evaluate")
THREADS = 2  # cores of the smallest machine that is supported


@dataclass(frozen=True)
class PredictionFiles:
    """Paths of the results, and what the recording needs to know of them."""

    folder: Path
    key: str
    name: str = "predict"
    drawing: Stopwatch = field(default_factory=Stopwatch)

    @property
    def recording(self) -> Path:
        """The Rerun recording."""
        return self.folder / "grasps.rrd"

    @property
    def recording_id(self) -> str:
        """Equal for equal inputs."""
        return self.key


def predict(
    depth: Annotated[
        list[Path], typer.Argument(help="depth images or point clouds, several with poses")
    ],
    camera: Annotated[
        list[Path] | None,
        typer.Option(help="intrinsics and pose, one a depth image; else NAME.json beside it"),
    ] = None,
    colour: Annotated[list[Path] | None, typer.Option(help="aligned pictures")] = None,
    mask: Annotated[list[Path] | None, typer.Option(help="where grasps may be")] = None,
    instances: Annotated[list[Path] | None, typer.Option(help="labels of objects")] = None,
    workspace: Annotated[
        Path | None, typer.Option(help="JSON with box_m, polygon_m or polygon_px")
    ] = None,
    depth_scale_m: Annotated[
        float | None, typer.Option(min=1e-9, help="metres a unit of the depth image")
    ] = None,
    radius_mm: Annotated[float | None, typer.Option(min=1, help="radius of the gripper")] = None,
    tilt_deg: Annotated[
        float | None, typer.Option(min=1, max=180, help="approach off the vertical; 90: sideways")
    ] = None,
    top: Annotated[int | None, typer.Option(min=1, help="how many grasps")] = None,
    network: Annotated[
        str,
        typer.Option(
            envvar="NETWORK", help=f"'{RELEASED}', '{ANALYTIC}', or an exported network (.onnx)"
        ),
    ] = RELEASED,
    run: Annotated[str, typer.Option(envvar="RUN", help="whose run.toml configures")] = "default",
    out: Annotated[
        Path | None, typer.Option(help="folder of the results; else runs/<run>/predict/<frame>")
    ] = None,
) -> None:
    """Propose grasps on real pictures, the best first."""
    files = frame_files(depth, camera, colour, mask, instances, depth_scale_m)
    config = predict_config(run, radius_mm, tilt_deg, top)
    frames = [read_frame(item) for item in files]
    if workspace is not None:
        frames = [within_workspace(frame, workspace) for frame in frames]
    frames = frames_that_agree(frames, config, generator(config.seed, "poses"))
    source = quality_source(network, config.gripper, THREADS)
    radius_m = config.gripper.pad.radius_m
    ranking = NetworkRanking(source.predict, config.sensing, radius_m, config.evaluate.policy)
    proposals = propose_grasps(
        frames, ranking, config, generator(config.seed, "predict", frames[0].name)
    )
    quality_min = config.predict.quality_min
    prediction = Prediction(frames, proposals, source.name, radius_m, quality_min)
    folder = out or RUNS_DIR / run / "predict" / frames[0].name
    read = [path for item in files for path in paths_of(item)] + ([workspace] if workspace else [])
    publish(prediction, folder, provenance(config, read, source.digest))
    logger.info("{}", prediction.verdict)
    for reason, number in proposals.left_out.items():
        logger.info("{} contacts left out: {}", number, reason)
    logger.info("predict: {}", folder / "grasps.png")


def frame_files(
    depth: list[Path],
    camera: list[Path] | None,
    colour: list[Path] | None,
    mask: list[Path] | None,
    instances: list[Path] | None,
    depth_scale_m: float | None,
) -> list[FrameFiles]:
    """The files of each frame, in the order given. Raises BadParameter where counts differ."""
    named = {"camera": camera, "colour": colour, "mask": mask, "instances": instances}
    for option, paths in named.items():
        if paths and len(paths) != len(depth):
            raise typer.BadParameter(f"--{option} is given {len(paths)} times for {len(depth)}")
    return [
        FrameFiles(
            depth=path,
            camera=camera[index] if camera else None,
            colour=colour[index] if colour else None,
            mask=mask[index] if mask else None,
            instances=instances[index] if instances else None,
            depth_scale_m=depth_scale_m,
        )
        for index, path in enumerate(depth)
    ]


def predict_config(
    run: str, radius_mm: float | None, tilt_deg: float | None, top: int | None
) -> RunConfig:
    """The run's configuration, with what the command line says in its place."""
    config = load_run_config(RunFolder(RUNS_DIR / run).config)
    settings = config.model_dump()
    if radius_mm is not None:
        settings["gripper"]["pad"]["radius_m"] = 1e-3 * radius_mm
    if tilt_deg is not None:
        settings["predict"]["tilt_max_rad"] = math.radians(tilt_deg)
    if top is not None:
        settings["predict"]["top"] = top
    return RunConfig.model_validate(settings)


def paths_of(files: FrameFiles) -> list[Path]:
    """All files that a frame is read from."""
    found = with_neighbours(files)
    named = (found.depth, found.camera, found.colour, found.mask, found.instances)
    return [path for path in named if path is not None]


def provenance(config: RunConfig, read: list[Path], network_digest: str) -> Provenance:
    """What the results were made from: configuration, files and network, by content."""
    inputs = tuple(Input(path.name, file_sha256(path)) for path in read)
    settings = section_digest(config, SECTIONS)
    text = "\n".join([settings, network_digest, *(f"{i.path} {i.sha256}" for i in inputs)])
    return Provenance(
        stage="predict",
        key=hashlib.sha256(text.encode()).hexdigest(),
        config_digest=settings,
        code_digest=network_digest,
        seed=config.seed,
        inputs=inputs,
        package_version=package_version(),
    )


def publish(prediction: Prediction, folder: Path, made_from: Provenance) -> None:
    """Write all files; the MCAP comes last."""
    folder.mkdir(parents=True, exist_ok=True)
    files = PredictionFiles(folder, made_from.key)
    with recording(files, blueprint(prediction)) as stream:
        show_prediction(stream, prediction)
    publish_bytes(folder / "grasps.png", png_bytes(grasp_picture(prediction)))
    publish_bytes(folder / "grasps.json", grasps_json(prediction).encode())
    publish_bytes(folder / "grasps.csv", grasps_csv(prediction).encode())
    with ArtifactWriter(folder / "grasps.mcap", made_from) as artifact:
        write_prediction(artifact, prediction)


if __name__ == "__main__":
    run_command(predict)
