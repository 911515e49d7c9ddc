"""One Rerun recording a stage: how it is opened, named, bounded and published.

Entity paths and the timeline are named alike across stages, and a test holds every stage to it:

- ``/world``: what has a place in space, in metres, z up. Things that come and go lie at
  ``/world/<kind>/<step>/<thing>`` (see `start_path`), a camera and its pictures at
  ``/world/<camera>/colour``, ``depth``, ``segmentation`` and ``normals``.
- ``/camera/<name>``: pictures that have no place in a scene that is shown.
- ``/curves/<quantity>/<curve>``: figures, as curves over the timeline or as bars.
- ``/notes/<subject>``: words, as Markdown.
- One timeline a recording, of whole numbers from 0, named by what it steps through:
  `TIMELINES`. A view on another timeline would open empty.

How many things a recording shows is bounded by ``[recording]`` of run.toml, so that it stays
under `LARGEST_MB`; what it costs is ``recording_share`` of the stage's summary.
"""

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
import pyarrow.compute  # noqa: F401 - Rerun loads it at the first bar chart, amid the logging
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import UInt8
from loguru import logger

from pipeline.artifacts.publishing import published
from pipeline.config import RunConfig
from pipeline.stopwatch import Stopwatch

APPLICATION = "softgrip"
NO_ROOM_BYTES = 1 << 20  # less free space is a full disk
SHEET_SPACING = 3.0  # between clouds that are shown side by side, in r_G: they are 2.4 wide
LARGEST_MB = 200  # what a viewer still opens in seconds; [recording] of run.toml keeps below it
ROOTS = ("world", "camera", "curves", "notes")
TIMELINES = {
    "objects": "object",
    "scenes": "scene",
    "grasps": "grasp",
    "shards": "sample",
    "train": "epoch",
    "evaluate": "frame",
    "sweep": "layers",
    "predict": "grasp",
    "referee": "grasp",
    "holdout": "object",
    "diff": "group",
}


class Recorded(Protocol):
    """The part of a stage that its recording needs."""

    @property
    def name(self) -> str:
        """The stage's name."""

    @property
    def recording(self) -> Path:
        """Path of the .rrd file."""

    @property
    def recording_id(self) -> str:
        """Key of the stage: the viewer opens recordings of equal runs as the same recording."""

    @property
    def drawing(self) -> Stopwatch:
        """Counts the processor time spent on recording."""


@dataclass(frozen=True)
class OwnRecording:
    """A recording of a command that is no stage; see `Recorded` for what each part is."""

    name: str
    recording: Path
    recording_id: str
    drawing: Stopwatch = field(default_factory=Stopwatch)


@runtime_checkable
class Expecting(Protocol):
    """A stage that was checked against what is expected of its artifact."""

    @property
    def expectations(self) -> str:
        """What was expected and found, Markdown; empty where nothing was checked."""


class FinishedStage(Recorded, Protocol):
    """A stage whose artifact is finished; its recording is drawn from the artifact."""

    @property
    def config(self) -> RunConfig:
        """The run's configuration."""

    @property
    def output(self) -> Path:
        """Path of the stage's artifact."""

    def upstream(self, stage: str) -> Path:
        """Path of the artifact of another stage that this stage reads."""


@contextmanager
def recording(stage: Recorded, blueprint: rrb.Blueprint) -> Iterator[rr.RecordingStream]:
    """Open the recording of a stage; it appears at ``stage.recording`` when the block ends well.

    Parameters
    ----------
    stage
        Its name, the recording's place and identity, and the stopwatch that runs meanwhile.
    blueprint
        How the viewer lays the recording out.

    Yields
    ------
    rr.RecordingStream
        The open recording.

    Raises
    ------
    OSError
        The disk is full.
    """
    path = stage.recording
    with published(path) as scratch, stage.drawing.running(whole_process=True):
        _check_room(scratch)
        name = f"{APPLICATION}_{stage.name}"
        stream = rr.RecordingStream(name, recording_id=stage.recording_id)
        stream.save(scratch, default_blueprint=blueprint)
        if isinstance(stage, Expecting) and stage.expectations:
            note = rr.TextDocument(stage.expectations, media_type=rr.MediaType.MARKDOWN)
            stream.log("notes/expectations", note, static=True)
        try:
            yield stream
        finally:
            with _explaining_a_full_disk(scratch):
                stream.flush()
                stream.disconnect()
    _warn_if_large(path)


def _warn_if_large(path: Path) -> None:
    """Warn where a recording is larger than `LARGEST_MB`, as it is slow to open."""
    megabytes = path.stat().st_size / 1e6
    if megabytes > LARGEST_MB:
        advice = "{} has {:.0f} MB, which is slow to open: lower the numbers in [recording]"
        logger.warning(advice, path, megabytes)


@contextmanager
def _explaining_a_full_disk(path: Path) -> Iterator[None]:
    """Raise OSError where Rerun's writer stopped at a full disk; Rerun itself gives no reason."""
    try:
        yield
    except RuntimeError:
        _check_room(path)
        raise


def _check_room(path: Path) -> None:
    """Raise OSError on a full disk: Rerun's writer would wait for ever."""
    if shutil.disk_usage(path.parent).free < NO_ROOM_BYTES:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))


def eye_at(
    from_m: tuple[float, float, float], at_m: tuple[float, float, float]
) -> rrb.EyeControls3D:
    """A 3-D view's camera at one point [m] that looks at another [m]; z is up."""
    return rrb.EyeControls3D(position=from_m, look_target=at_m, eye_up=(0.0, 0.0, 1.0))


def time_panel(timeline: str) -> rrb.TimePanel:
    """The time panel, collapsed and paused, on the recording's one timeline."""
    return rrb.TimePanel(timeline=timeline, state="collapsed", play_state="paused")


def name_curve(
    stream: rr.RecordingStream, path: str, name: str, colour: UInt8[np.ndarray, " 3"]
) -> None:
    """Set name and colour of the curve logged under ``path``."""
    stream.log(path, rr.SeriesLines(names=name, colors=colour, widths=1.5), static=True)


def set_step(stream: rr.RecordingStream, timeline: str, index: int) -> None:
    """Log what follows at step ``index`` of the recording's one timeline."""
    stream.set_time(timeline, sequence=index)


def start_path(stream: rr.RecordingStream, path: str, number: int) -> str:
    """Clear what the step before showed under a path, and return the path for this step.

    Each step logs under a path of its own: clearing and logging the same path at the same time has
    no defined order.

    Parameters
    ----------
    stream
        The recording, already at this step.
    path
        Path without the number.
    number
        Number of the step, from 0.

    Returns
    -------
    Path under which this step logs.
    """
    if number > 0:
        stream.log(f"{path}/{number - 1:04d}", rr.Clear(recursive=True))
    return f"{path}/{number:04d}"
