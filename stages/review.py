"""`make review`: the run's recordings in the Rerun viewer, on the screen or in a browser."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder, run_command
from stages.graph import MADE, RUNS_DIR

WEB_PORT = 9090  # the one that Rerun's web viewer takes by itself
LOCAL = "127.0.0.1"  # the viewer would otherwise listen to the whole network


def recordings_of(folder: RunFolder, stage: str | None) -> list[Path]:
    """Recordings of one stage, or of all that there are, in the pipeline's order.

    Parameters
    ----------
    folder
        The run.
    stage
        Name of a stage, or None for all.

    Returns
    -------
    Paths of .rrd files that are there.

    Raises
    ------
    ArtifactError
        The stage is unknown, or nothing was recorded yet.
    """
    if stage is not None and stage not in MADE:
        raise ArtifactError(f"There is no stage '{stage}'", f"Stages are {', '.join(MADE)}")
    wanted = [stage] if stage else list(MADE)
    found = [path for path in map(folder.recording, wanted) if path.is_file()]
    if not found:
        missing = f"{folder.recording(stage)}" if stage else f"any recording of {folder.path}"
        goal = stage or "dataset"
        raise ArtifactError(f"{missing} is missing", f"Make it: make {goal} RUN={folder.path.name}")
    return found


def viewer_command(recordings: list[Path], screen: bool, port: int) -> list[str]:
    """The viewer's command line: its own window, or a web viewer for a browser on this machine."""
    viewer = str(Path(sys.executable).with_name("rerun"))
    files = [str(path) for path in recordings]
    if screen:
        return [viewer, "--bind", LOCAL, "--port", "auto", *files]
    web = ["--serve-web", "--bind", LOCAL, "--port", "auto", "--web-viewer-port", str(port)]
    return [viewer, *web, *files]


def review(
    run: Annotated[str, typer.Option(envvar="RUN", help="name of the run")] = "default",
    stage: Annotated[str, typer.Option(envvar="STAGE", help="one stage; without it all")] = "",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
    port: Annotated[int, typer.Option(envvar="PORT", help="of the web viewer")] = WEB_PORT,
) -> None:
    """Open a run's recordings; ends when the viewer is closed or interrupted."""
    recordings = recordings_of(RunFolder(runs_dir / run), stage or None)
    screen = bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    for path in recordings:
        logger.info("review: {}", path)
    if not screen:
        logger.info("No screen here: the web viewer's address is printed below, Ctrl-C ends it")
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    # The viewer is a program that a script starts: both end with their session.
    viewer = subprocess.Popen(viewer_command(recordings, screen, port), start_new_session=True)
    try:
        sys.exit(viewer.wait())
    except KeyboardInterrupt:
        os.killpg(viewer.pid, signal.SIGTERM)
        viewer.wait()


if __name__ == "__main__":
    run_command(review)
