"""`make gallery`: the first clutter of each level, rendered large, on one sheet."""

import io
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from loguru import logger

from pipeline.artifacts import publish_bytes
from pipeline.clutter.gaps import bounds_of
from pipeline.config import StaticCameraConfig, load_run_config
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder, run_command
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scenes
from pipeline.recording.gallery import contact_sheet
from pipeline.sensing.rendering import new_renderer, render_views
from pipeline.world.cameras import PinholeCamera, camera_at
from pipeline.world.scene import ClutterScene
from stages.graph import RUNS_DIR

# Pictures of the size that a sheet of nine has room for.
PORTRAIT = StaticCameraConfig(width_px=560, height_px=420, vertical_fov_rad=0.6, sensor="ideal")
ELEVATION_RAD, AZIMUTH_RAD = 0.75, -0.9  # from the side and above, where piles show their height
MARGIN = 0.92  # of the sphere around the objects, which they never fill


def make_gallery(folder: RunFolder) -> None:
    """Render the sheet of a run and write it beside the run's scenes.

    Parameters
    ----------
    folder
        The run.

    Raises
    ------
    ArtifactError
        The run has no scenes yet.
    """
    scenes_path = folder.artifact("scenes")
    if not scenes_path.is_file():
        name = folder.path.name
        raise ArtifactError(f"{scenes_path} is missing", f"Make it first: make scenes RUN={name}")
    config = load_run_config(folder.config)
    objects = {name: item for name, (item, _) in read_objects(folder.artifact("objects")).items()}
    first: dict[int, ClutterScene] = {}
    for scene in read_scenes(scenes_path):
        first.setdefault(scene.level, scene)
    renderer = new_renderer(config.cameras.renderer, config.scenes)
    pictures = {
        level: render_views(scene, objects, (portrait_camera(scene, objects),), renderer)
        .views[0]
        .colour
        for level, scene in first.items()
    }
    png = io.BytesIO()
    contact_sheet(pictures).save(png, format="PNG", optimize=True)
    path = folder.path / "gallery.png"
    publish_bytes(path, png.getvalue())
    logger.info("gallery: levels {} in {}", ", ".join(str(level) for level in sorted(first)), path)


def portrait_camera(scene: ClutterScene, objects: dict[str, CatalogueObject]) -> PinholeCamera:
    """A camera from the side and above that has all of a scene in its picture."""
    boxes = [bounds_of(objects[p.object_name].mesh, p.world_from_object) for p in scene.objects]
    lower = np.min([box[0] for box in boxes], axis=0)
    upper = np.max([box[1] for box in boxes], axis=0)
    radius_m = float(np.linalg.norm(upper - lower)) / 2
    distance_m = MARGIN * radius_m / np.sin(PORTRAIT.vertical_fov_rad / 2)
    camera = camera_at(
        "portrait", PORTRAIT, (lower + upper) / 2, float(distance_m), ELEVATION_RAD, AZIMUTH_RAD
    )
    return replace(camera, near_m=0.05)


def gallery(
    run: Annotated[str, typer.Option(envvar="RUN", help="name of the run")] = "default",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
) -> None:
    """Render the nine levels on one sheet, runs/<run>/gallery.png."""
    make_gallery(RunFolder(runs_dir / run))


if __name__ == "__main__":
    run_command(gallery)
