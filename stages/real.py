"""`make real`: first choices of network and analytic baseline on a folder of real frames.

Writes runs/<run>/real/: the sheet (real.png), the page (real.html, real.md) and all figures
(real.json). A frame that cannot be read, or on which nothing can be proposed, is told in one
sentence; the others go on.
"""

import json
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from loguru import logger

from pipeline.artifacts import publish_bytes
from pipeline.camera.frame import Frame
from pipeline.camera.frame_files import frames_in, read_frame
from pipeline.camera.prediction import Prediction
from pipeline.camera.proposals import Proposals, propose_grasps
from pipeline.camera.trial import (
    FrameTrial,
    Stability,
    first_choice,
    stability_of,
    unmasked,
    with_lost_pixels,
)
from pipeline.config import RunConfig, load_run_config
from pipeline.control.ranking import NetworkRanking
from pipeline.errors import PictureError
from pipeline.execution import RunFolder, generator, progress, run_command
from pipeline.network.sources import ANALYTIC, RELEASED, QualitySource, quality_source
from pipeline.recording.overlay import png_bytes
from pipeline.recording.trial_sheet import trial_sheet
from pipeline.reporting.page import html_page
from pipeline.reporting.real_frames import trial_figures, trial_page
from stages.graph import RUNS_DIR

THREADS = 2  # cores of the smallest machine that is supported


def real(
    frames: Annotated[Path, typer.Argument(help="folder of NAME.depth.* with NAME.json, ...")],
    tilt_deg: Annotated[
        float | None, typer.Option(min=1, max=180, help="approach off the vertical; 90: sideways")
    ] = None,
    radius_mm: Annotated[float | None, typer.Option(min=1, help="radius of the gripper")] = None,
    network: Annotated[
        str, typer.Option(envvar="NETWORK", help=f"'{RELEASED}' or an exported network (.onnx)")
    ] = RELEASED,
    run: Annotated[str, typer.Option(envvar="RUN", help="whose run.toml configures")] = "default",
    out: Annotated[Path | None, typer.Option(help="folder; else runs/<run>/real")] = None,
) -> None:
    """Try network and analytic baseline on every frame of a folder, and write the sheet."""
    config = trial_config(run, tilt_deg, radius_mm)
    files = frames_in(frames)
    sources = [quality_source(name, config.gripper, THREADS) for name in (network, ANALYTIC)]
    trials: list[FrameTrial] = []
    unreadable: dict[str, str] = {}
    for item in progress(files, len(files), "real", "frame"):
        try:
            frame = read_frame(item)
        except PictureError as error:
            name = str(item.depth.relative_to(frames))
            unreadable[name] = str(error)
            logger.warning("{}: {}", name, error)
            continue
        trials += trials_of(frame, sources, config)
    if not trials:
        raise PictureError(f"No frame of {frames} can be read", "The lines above say why")
    publish(out or RUNS_DIR / run / "real", trials, unreadable, config)


def trial_config(run: str, tilt_deg: float | None, radius_mm: float | None) -> RunConfig:
    """The run's configuration with the approaches and the gripper that frames are tried with."""
    settings = load_run_config(RunFolder(RUNS_DIR / run).config).model_dump()
    if tilt_deg is not None:
        settings["predict"]["trial"]["tilt_max_rad"] = math.radians(tilt_deg)
    if radius_mm is not None:
        settings["gripper"]["pad"]["radius_m"] = 1e-3 * radius_mm
    settings["predict"]["tilt_max_rad"] = settings["predict"]["trial"]["tilt_max_rad"]
    return RunConfig.model_validate(settings)


def trials_of(
    frame: Frame, sources: Sequence[QualitySource], config: RunConfig
) -> list[FrameTrial]:
    """Every source on a frame: everywhere and, where it has a mask, kept to it."""
    uses = (False,) if frame.allowed.all() else (False, True)
    return [tried(frame, source, kept, config) for kept in uses for source in sources]


def tried(frame: Frame, source: QualitySource, kept_to_mask: bool, config: RunConfig) -> FrameTrial:
    """One source on one frame, with contacts drawn anew and pixels lost."""
    radius_m = config.gripper.pad.radius_m
    ranking = NetworkRanking(source.predict, config.sensing, radius_m, config.evaluate.policy)
    seconds: list[float] = []

    def proposed(seen: Frame, draw: int) -> Proposals:
        began = time.perf_counter()
        found = propose_grasps(
            [seen], ranking, config, generator(config.seed, "real", frame.name, draw)
        )
        seconds.append(time.perf_counter() - began)
        return found

    def changed(seen: Frame, draw: int) -> Proposals | None:
        try:
            return proposed(seen, draw)
        except PictureError:  # the change has left nothing; it counts as a choice that is gone
            return None

    shown = frame if kept_to_mask else unmasked(frame)
    settings, apart_m = config.predict.trial, config.predict.apart_m
    try:
        found = proposed(shown, 0)
    except PictureError as error:
        return FrameTrial(
            frame, source.name, kept_to_mask, None, str(error), None, None, None, math.nan
        )
    prediction = Prediction([shown], found, source.name, radius_m, config.predict.quality_min)
    first = first_choice(frame, found, radius_m, settings)
    redrawn: Stability | None = None
    thinned: Stability | None = None
    if first is not None:
        draws = range(1, 1 + settings.repeats)
        redrawn = stability_of(first, [changed(shown, draw) for draw in draws], apart_m)
        lost = generator(config.seed, "lost", frame.name)
        few = [with_lost_pixels(shown, settings.lost_share, lost) for _ in draws]
        thinned = stability_of(first, [changed(one, 0) for one in few], apart_m)
    return FrameTrial(
        frame,
        source.name,
        kept_to_mask,
        prediction,
        "",
        first,
        redrawn,
        thinned,
        float(np.median(seconds)),
    )


def publish(
    folder: Path, trials: Sequence[FrameTrial], unreadable: dict[str, str], config: RunConfig
) -> None:
    """Sheet, page and figures."""
    figures = trial_figures(trials, unreadable, config.predict.apart_m)
    png = png_bytes(trial_sheet(trials))
    page = trial_page(figures, config.predict, "real.png")
    publish_bytes(folder / "real.png", png)
    publish_bytes(folder / "real.json", (json.dumps(figures, indent=1) + "\n").encode())
    publish_bytes(folder / "real.md", page.encode())
    html = html_page(page, "First choices on real frames", {"real.png": png})
    publish_bytes(folder / "real.html", html.encode())
    logger.info("real: {}", folder / "real.html")


if __name__ == "__main__":
    run_command(real)
