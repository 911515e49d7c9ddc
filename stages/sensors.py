"""`make sensors`: a noise model fitted to real frames, and the network's error by sensor.

Writes runs/<run>/sensors/<name>/: the page (sensors.html, sensors.md), its figure (spread.svg) and
all numbers (sensors.json). The error is taken on grasps of the run's scenes where it has some: the
same grasps and labels, with the clouds that each sensor would have measured.
"""

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated, Any, get_args

import numpy as np
import typer
from loguru import logger

from pipeline.artifacts import publish_bytes
from pipeline.camera.frame_files import frames_in, read_frame
from pipeline.config import RunConfig, load_run_config
from pipeline.config.cameras import DepthSensor
from pipeline.errors import PictureError
from pipeline.execution import RunFolder, generator, run_command
from pipeline.labelling.clouds import cut_clouds, measure_pictures
from pipeline.labelling.scene import label_scene, scene_surfaces
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scene, scene_count
from pipeline.network.sources import RELEASED, QualitySource, quality_source
from pipeline.reporting.page import html_page
from pipeline.reporting.sensor_fit import sensor_page, spread_figure
from pipeline.sensing.depth_noise import NoiseModel
from pipeline.sensing.noise_fit import EDGE_M, SensorFit, fit_sensor
from pipeline.spread import choose_evenly
from stages.graph import RUNS_DIR

THREADS = 2  # cores of the smallest machine that is supported
TRANSPARENT_LOSS = 0.6  # frames do not tell which pixels show something transparent
NAMES = {field.name for field in fields(NoiseModel)}


def sensors(
    frames: Annotated[Path, typer.Argument(help="folder of one camera's NAME.depth.*")],
    name: Annotated[str, typer.Option(help="what the sensor is called")] = "sensor",
    names: Annotated[str, typer.Option(help="frames whose file matches, as 'bin_*'")] = "*",
    scenes: Annotated[int, typer.Option(min=0, help="of the run, whose grasps are tried")] = 12,
    grasps: Annotated[int, typer.Option(min=1, help="a scene")] = 40,
    run: Annotated[str, typer.Option(envvar="RUN", help="whose scenes are used")] = "default",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
    network: Annotated[str, typer.Option(envvar="NETWORK", help="or an .onnx file")] = RELEASED,
) -> None:
    """Fit a noise model to real frames, and tell the network's error by sensor."""
    files = [item for item in frames_in(frames) if item.depth.match(names)]
    if not files:
        raise PictureError(f"{frames} has no frame {names}", "Give names=, a pattern of file names")
    read = [read_frame(item) for item in files]
    fit = fit_sensor([(frame.depth_m, frame.camera.intrinsics) for frame in read])
    model = model_of(fit)
    folder = RunFolder(runs_dir / run)
    config = load_run_config(folder.config)
    source = quality_source(network, config.gripper, THREADS)
    made = folder.artifact("scenes").is_file() and scenes > 0
    figures: dict[str, Any] = {
        "name": name,
        "frames": len(read),
        "blocks": int(fit.bins[:, 3].sum()),
        "depth_m": [float(v) for v in np.percentile(fit.bins[:, 0], [0, 100])],
        "incidence_deg": [float(np.degrees(v)) for v in np.percentile(fit.bins[:, 1], [0, 100])],
        "model": {field: getattr(model, field) for field in sorted(NAMES)},
        "bins": fit.bins.tolist(),
        "network_error": errors_by_sensor(folder, config, source, scenes, grasps) if made else {},
    }
    publish(folder.path / "sensors" / name, figures, fit, model)


def model_of(fit: SensorFit) -> NoiseModel:
    """The noise model of a fit; what frames cannot tell is our choice."""
    told = {name: getattr(fit, name) for name in NAMES if hasattr(fit, name)}
    return NoiseModel(
        **told,
        grazing_rad=fit.steepest_rad,
        edge_m=EDGE_M,
        transparent_loss=TRANSPARENT_LOSS,
    )


def errors_by_sensor(
    run: RunFolder, config: RunConfig, source: QualitySource, scenes: int, grasps: int
) -> dict[str, dict[str, float]]:
    """Mean error of a network on equal grasps, seen by each sensor in the cameras' places."""
    catalogue = read_objects(run.artifact("objects"))
    meshes = {name: item.mesh for name, (item, _) in catalogue.items()}
    path = run.artifact("scenes")
    off: dict[DepthSensor, list[np.ndarray]] = {name: [] for name in get_args(DepthSensor)}
    seen: dict[DepthSensor, list[np.ndarray]] = {name: [] for name in off}
    for index in choose_evenly(scene_count(path), min(scenes, scene_count(path))):
        scene = read_scene(path, int(index))
        surfaces = scene_surfaces(scene, meshes, config.scenes.table_side_m)
        rng = generator(config.seed, "sensors", scene.scene_id)
        for origin, labelled in label_scene(scene, surfaces, config, grasps, rng):
            contact = labelled.world_from_gripper.copy()
            contact[:, :3, 3] -= labelled.touch_height_m[:, None] * contact[:, :3, 2]
            for sensor in off:
                views = [
                    replace(view, camera=replace(view.camera, sensor=sensor))
                    for view in scene.views
                ]
                draw = generator(config.seed, "sensors", scene.scene_id, origin.viewpoint)
                pictures = measure_pictures(views, True, draw)
                at = [view.camera.name for view in views].index(origin.viewpoint)
                # The same clouds are cut from one picture, whatever a sensor's noise has drawn.
                cuts = generator(config.seed, "cuts", scene.scene_id, origin.viewpoint)
                cloud, mask, _ = cut_clouds(contact, pictures[at], pictures, config, cuts)
                off[sensor].append(np.abs(source.predict(cloud, mask) - labelled.quality))
                seen[sensor].append(mask.mean(axis=(1, 2)))
    return {
        sensor: {
            "grasps": len(np.concatenate(off[sensor])),
            "mae": float(np.mean(np.concatenate(off[sensor]))),
            "unseen_share": 1.0 - float(np.mean(np.concatenate(seen[sensor]))),
        }
        for sensor in off
    }


def publish(folder: Path, figures: dict[str, Any], fit: SensorFit, model: NoiseModel) -> None:
    """Page, figure and numbers."""
    svg = spread_figure(fit.bins, model).encode()
    page = sensor_page(figures, "spread.svg")
    publish_bytes(folder / "spread.svg", svg)
    publish_bytes(folder / "sensors.json", (json.dumps(figures, indent=1) + "\n").encode())
    publish_bytes(folder / "sensors.md", page.encode())
    html = html_page(page, f"Noise of {figures['name']}", {"spread.svg": svg})
    publish_bytes(folder / "sensors.html", html.encode())
    logger.info("sensors: {}", folder / "sensors.html")


if __name__ == "__main__":
    run_command(sensors)
