"""The Rerun viewer without a window: open a recording, list its problems, save pictures of it."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
from rerun.experimental import ViewerClient

from pipeline.artifacts import publish_bytes
from pipeline.errors import MachineError, SoftgripError
from pipeline.physics.vulkan import choose_vulkan_driver

LOCAL = "127.0.0.1"  # the viewer would otherwise listen to the whole network

_PATIENCE_S = 60.0  # a viewer that takes longer to open a file hangs
_START_PAUSE_S = 0.1  # between two looks for its address
_PAUSE_S = 0.5  # between two tries at a picture
_TRIES = 3  # beyond the first; the viewer gives up on a picture after some seconds


@dataclass(frozen=True)
class ViewerState:
    """What the viewer shows of a recording.

    Attributes
    ----------
    window_png
        Picture of the whole window.
    view_png
        Picture of each visible view by its name; views behind a tab are left out.
    problems
        What the viewer could not show, and why.
    timeline
        Name of the timeline that is active.
    """

    window_png: bytes
    view_png: dict[str, bytes]
    problems: tuple[str, ...]
    timeline: str


def photograph(recording: Path, step: int | None = None) -> ViewerState:
    """Open a recording in the viewer, without a window, and take pictures once it is loaded.

    Parameters
    ----------
    recording
        An .rrd file.
    step
        Step of its timeline; None for the step at which it opens.

    Returns
    -------
    The pictures, and the problems that the viewer reports.

    Raises
    ------
    MachineError
        The viewer does not start, for example without a graphics driver.
    SoftgripError
        The recording does not finish loading.
    """
    with off_screen_viewer() as client:
        client.open(str(recording.resolve()))
        if step is not None:
            client.set_time(sequence=step)
        window = _settled(client, recording)
        state = client.get_state()
        views = {}
        for view in state.views:
            if view.visible:
                with _behind_a_tab():
                    views[view.name or view.origin] = _screenshot(client, view.view_id)
        problems = tuple(
            f"{view.name}: {report}" for view in state.views for report in view.reports
        )
        (shown,) = state.recordings
        return ViewerState(window, views, problems, shown.current_timeline or "")


@contextmanager
def off_screen_viewer() -> Iterator[ViewerClient]:
    """Start a viewer without a window, and end it with the block.

    Yields
    ------
    ViewerClient
        The connected client.

    Raises
    ------
    MachineError
        The viewer does not start, for example without a graphics driver.
    """
    choose_vulkan_driver()
    port = _free_port()
    # The viewer is a program that a script starts: both end with their session.
    process = subprocess.Popen(
        _viewer_command(port),
        start_new_session=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield _connected(process, port)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # it holds nothing that could be lost
        process.wait()


def _viewer_command(port: int) -> list[str]:
    """Command line of a viewer without a window that listens on this machine only."""
    viewer = str(Path(sys.executable).with_name("rerun"))
    options = ["--headless", "--hide-welcome-screen", "--renderer", "vulkan"]
    return [viewer, *options, "--bind", LOCAL, "--port", str(port)]


def _connected(process: subprocess.Popen[bytes], port: int) -> ViewerClient:
    """A client of the viewer once it answers.

    Parameters
    ----------
    process
        The running viewer.
    port
        Where it listens, on this machine alone.

    Returns
    -------
    The client.

    Raises
    ------
    MachineError
        The viewer ended, or does not answer in time.
    """
    deadline = time.monotonic() + _PATIENCE_S
    while process.poll() is None and time.monotonic() < deadline:
        try:
            client = ViewerClient.connect(f"rerun+http://{LOCAL}:{port}/proxy")
            client.get_state()
        except (RuntimeError, ConnectionError, TimeoutError):
            time.sleep(_START_PAUSE_S)
        else:
            return client
    how = "answers nothing" if process.poll() is None else f"ended with code {process.returncode}"
    raise MachineError(
        f"the Rerun viewer does not start: it {how}",
        f"Run `make doctor`, and see what '{' '.join(_viewer_command(port))}' says",
    )


def _settled(client: ViewerClient, recording: Path) -> bytes:
    """Picture of the window once nothing loads and two pictures in a row are equal."""
    before, deadline = b"", time.monotonic() + _PATIENCE_S
    while time.monotonic() < deadline:
        time.sleep(_PAUSE_S)
        state = client.get_state()
        window = _screenshot(client)
        if not state.loading and state.active_recording and window == before:
            return window
        before = window
    raise SoftgripError(
        f"{recording} did not stand still in the viewer for {_PATIENCE_S:.0f} s",
        "Open it by hand: .venv/bin/rerun with its path",
    )


@contextmanager
def _behind_a_tab() -> Iterator[None]:
    """Ignore the error for a view behind a tab: the viewer calls it visible but has no picture."""
    try:
        yield
    except ConnectionError as error:
        if "NotFound" not in str(error):
            raise


def _screenshot(client: ViewerClient, view_id: str | None = None) -> bytes:
    """A picture of the window or of a view; a busy machine may need several tries for one."""
    for _ in range(_TRIES):
        try:
            return bytes(client.take_screenshot(view_id))
        except TimeoutError:
            time.sleep(_PAUSE_S)
    return bytes(client.take_screenshot(view_id))


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((LOCAL, 0))
        return int(probe.getsockname()[1])


def picture(
    recording: Annotated[Path, typer.Argument(help="an .rrd file")],
    png: Annotated[Path, typer.Argument(help="where the picture goes")],
    step: Annotated[int | None, typer.Option(help="where on the recording's timeline")] = None,
) -> None:
    """Photograph a recording as the viewer shows it."""
    try:
        sight = photograph(recording, step)
    except SoftgripError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from None
    publish_bytes(png, sight.window_png)
    for problem in sight.problems:
        typer.echo(problem, err=True)


if __name__ == "__main__":
    typer.run(picture)
