"""`make review`: which recordings it opens, and that the web viewer is really served."""

import signal
import socket
import subprocess
import sys
import time
import urllib.request

import pytest

from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from stages.graph import STAGES
from stages.review import recordings_of, viewer_command
from tests.stages.conftest import ROOT


def test_all_stages_or_the_one_asked_for(run: RunFolder) -> None:
    assert recordings_of(run, None) == [run.recording(stage) for stage in STAGES]
    assert recordings_of(run, "grasps") == [run.recording("grasps")]


def test_what_is_missing_is_named_with_its_remedy(run: RunFolder) -> None:
    with pytest.raises(ArtifactError, match="Stages are objects, scenes"):
        recordings_of(run, "grasp")
    empty = RunFolder(run.path.parent / "nothing")
    with pytest.raises(ArtifactError, match="make scenes RUN=nothing"):
        recordings_of(empty, "scenes")
    with pytest.raises(ArtifactError, match="make dataset RUN=nothing"):
        recordings_of(empty, None)


def test_a_screen_gets_the_native_viewer(run: RunFolder) -> None:
    files = [run.recording("scenes")]
    assert "--serve-web" not in viewer_command(files, screen=True, port=1)
    assert "--serve-web" in viewer_command(files, screen=False, port=1)


def test_without_a_screen_the_web_viewer_answers(run: RunFolder) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "stages.review", "--run", run.path.name, "--stage", "scenes"]
    command += ["--runs-dir", str(run.path.parent), "--port", str(port)]
    process = subprocess.Popen(
        command,
        cwd=ROOT,
        env={"PATH": "/usr/bin:/bin"},
        stdout=subprocess.PIPE,
        text=True,
        stderr=subprocess.STDOUT,
    )
    try:
        page = b""
        deadline = time.monotonic() + 60
        while not page and time.monotonic() < deadline and process.poll() is None:
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=5) as answer:
                    page = answer.read()
            except OSError:
                time.sleep(0.2)
        assert b"<html" in page.lower()
    finally:
        process.send_signal(signal.SIGTERM)
        said, _ = process.communicate(timeout=30)
    assert f"127.0.0.1:{port}" in said
