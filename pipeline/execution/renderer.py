"""Which renderer makes a run's pictures on this machine, found without rendering one.

``auto`` takes SAPIEN where a Vulkan driver can render; that is tried in a process of its own. The
result is kept in a file and used again until drivers, devices or environment variables change.
"""

import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pipeline.artifacts import publish_bytes
from pipeline.config.cameras import RendererName
from pipeline.errors import MachineError
from pipeline.execution.code import ROOT

EMBREE = "Embree rays"
TRIAL = "pipeline.physics.render_trial"
TRIAL_TIMEOUT_S = 120.0  # a first start compiles shaders; a driver that hangs takes no longer
DEVICES = ("nvidia[0-9]*", "dri/renderD*")
CHOICES = ("VK_ICD_FILENAMES", "VK_DRIVER_FILES")


def identify_renderer(name: RendererName, memo: Path) -> str:
    """The renderer with its device and driver.

    Parameters
    ----------
    name
        What the configuration asks for.
    memo
        File in which the machine's last trial is kept.

    Returns
    -------
    `EMBREE`, or SAPIEN's version, device and driver files with the beginning of their SHA-256.

    Raises
    ------
    MachineError
        SAPIEN's was asked for by name and no Vulkan driver can render.
    """
    if name == "embree":
        return EMBREE
    renderer = _remembered(memo)
    if renderer is None:
        found = try_renderer()
        renderer = str(found["renderer"])
        known = {**found, "machine": _machine(), "marks": [_mark(p) for p in found["watched"]]}
        publish_bytes(memo, json.dumps(known, indent=1).encode())
    if not renderer and name == "sapien":
        raise MachineError(
            "no Vulkan driver on this machine can render",
            "Run `make doctor`, or set cameras.renderer to auto or embree",
        )
    return renderer or EMBREE


def try_renderer() -> dict[str, Any]:
    """Run `pipeline.physics.render_trial` in a process of its own.

    Returns
    -------
    What it printed: the renderer, and the files whose change makes the result invalid.

    Raises
    ------
    MachineError
        The trial ended without an answer.
    """
    command = [sys.executable, "-m", TRIAL]
    try:
        done = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, check=True, timeout=TRIAL_TIMEOUT_S
        )
        return dict(json.loads(done.stdout.splitlines()[-1]))
    except (subprocess.SubprocessError, ValueError, IndexError) as error:
        raise MachineError(
            f"which renderer this machine has could not be told: {error}",
            f"See what '{' '.join(command)}' says, or set cameras.renderer = \"embree\"",
        ) from error


def _remembered(memo: Path) -> str | None:
    """What the last trial found, where nothing changed that it depends on."""
    try:
        known = json.loads(memo.read_text())
        marks = [_mark(path) for path in known["watched"]]
        same = known["machine"] == _machine() and known["marks"] == marks
        return str(known["renderer"]) if same else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _machine() -> dict[str, str]:
    devices = [str(path) for pattern in DEVICES for path in sorted(Path("/dev").glob(pattern))]
    chosen = {name: os.environ.get(name, "") for name in CHOICES}
    return {"sapien": version("sapien"), "devices": " ".join(devices), **chosen}


def _mark(path: str) -> list[int] | None:
    """Size and date of a file or folder; None where it is not there."""
    try:
        status = Path(path).stat()
    except OSError:
        return None
    return [status.st_size, status.st_mtime_ns]
