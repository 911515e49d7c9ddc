"""``make doctor``: what is installed, what is missing, and how to install it."""

import importlib.metadata
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pipeline.machine import vulkan_driver

ROOT = Path(__file__).resolve().parents[2]
OLDEST_PYTHON = (3, 11)  # the oldest that pyproject.toml allows
FREE_GIB_WANTED = 5  # environment, caches and a run of paper
RENDER_TRIAL = """
from pipeline.config import ScenesConfig, StaticCameraConfig
from pipeline.world.scene_cameras import static_cameras
from pipeline.sensing.sapien_rendering import render_table

seen = render_table(ScenesConfig(), static_cameras(StaticCameraConfig())[0])
raise SystemExit(0 if (seen.depth_m > 0).any() else "the table is not in the picture")
"""
CLUSTER = "stages.cluster"  # looks at each node, in a process of its own
STORE = "stages.store"  # looks at the store of RUN, in a process of its own
STORE_TIMEOUT_S = 150  # a request is tried again for store.patience_s, a minute
CLUSTER_TIMEOUT_S = 300  # every node tries its renderer
TRIAL_TIMEOUT_S = 120  # a first picture compiles shaders; a driver that hangs takes no longer


@dataclass(frozen=True)
class Finding:
    """One line of the report; ``remedy`` is empty where nothing is missing."""

    subject: str
    state: str
    remedy: str = ""


def check_python() -> Finding:
    """Check the version of Python."""
    state = f"{platform.python_version()} at {sys.executable}"
    if sys.version_info[:2] < OLDEST_PYTHON:
        return Finding("Python", state, "install Python 3.11 or newer: apt-get install python3")
    return Finding("Python", state)


def check_tools() -> Finding:
    """Check for make, and for the C compiler that some packages need."""
    missing = [tool for tool in ("make", "cc") if shutil.which(tool) is None]
    if missing:
        return Finding("tools", f"missing: {', '.join(missing)}", "apt-get install build-essential")
    return Finding("tools", "make and a C compiler are there")


def check_readers() -> Finding:
    """Check for the MCAP readers of other languages that tests use."""
    missing = []
    if shutil.which("node") is None or shutil.which("npm") is None:
        missing.append("apt-get install nodejs npm, then 'make reader'")
    elif not (ROOT / "tests/artifacts/node/node_modules").is_dir():
        missing.append("run 'make reader'")
    if missing:
        return Finding("MCAP in TypeScript", "not installed, its tests are skipped", missing[0])
    go = "the mcap command line as well" if shutil.which("mcap") else "no mcap command line"
    return Finding("MCAP in TypeScript", f"installed; {go}")


def check_venv() -> Finding:
    """Check that the virtual environment has the pinned packages."""
    if not (ROOT / ".venv/.ready").is_file():
        return Finding("packages", "the virtual environment is not set up", "run 'make setup'")
    wrong = [
        f"{name} {wanted} (there is {have})"
        for name, wanted in _pins()
        if (have := _installed(name)) != wanted
    ]
    if wrong:
        return Finding("packages", f"not as pinned: {', '.join(wrong[:5])}", "run 'make setup'")
    return Finding("packages", f"{len(_pins())} packages as pinned in constraints.txt")


def check_driver() -> Finding:
    """Check for the Vulkan driver that SAPIEN renders with."""
    if vulkan_driver.has_gpu():
        return Finding("Vulkan driver", "an NVIDIA GPU")
    version = vulkan_driver.mesa_version()
    named = "unknown version" if version is None else f"Mesa {version[0]}.{version[1]}"
    if vulkan_driver.is_ready():
        return Finding("Vulkan driver", f"software (lavapipe), {named}")
    have = "none" if vulkan_driver.software_icd() is None else f"{named}, too old (24.3 needed)"
    return Finding(
        "Vulkan driver",
        f"{have}: scenes would be rendered with Embree rays",
        f"run\n{vulkan_driver.advice()}",
    )


def check_rendering() -> Finding:
    """Check that SAPIEN renders, in a process of its own."""
    try:
        trial = subprocess.run(
            [sys.executable, "-c", RENDER_TRIAL],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=False,
            timeout=TRIAL_TIMEOUT_S,
        )
    except subprocess.TimeoutExpired:
        return Finding("SAPIEN", f"no frame within {TRIAL_TIMEOUT_S} s", "see the Vulkan driver")
    if trial.returncode == 0:
        return Finding("SAPIEN", "renders")
    last = (trial.stderr.strip().splitlines() or ["no message"])[-1]
    return Finding("SAPIEN", f"does not render: {last}", "see the Vulkan driver above")


def check_cluster() -> Finding:
    """Check the nodes of the Ray cluster that RAY_ADDRESS names, in a process of its own."""
    address = os.environ.get("RAY_ADDRESS")
    if not address:
        return Finding("cluster", "none: RAY_ADDRESS names none")
    command = [sys.executable, "-m", CLUSTER]
    try:
        looked = subprocess.run(
            command,
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=False,
            timeout=CLUSTER_TIMEOUT_S,
        )
    except subprocess.TimeoutExpired:
        return Finding("cluster", f"{address} does not answer", f"see '{' '.join(command)}'")
    said = (looked.stdout.strip() or looked.stderr.strip()).removeprefix("cluster: ")
    if looked.returncode == 0:
        return Finding("cluster", said)
    return Finding("cluster", said, "give every node this project, these packages and this driver")


def check_store() -> Finding:
    """Check the object store that RUN_STORE, or RUN's run.toml, names, in a process of its own."""
    command = [sys.executable, "-m", STORE, "look"]
    run_toml = ROOT / "runs" / os.environ.get("RUN", "default") / "run.toml"
    in_run = run_toml.is_file() and "[store]" in run_toml.read_text()
    if not (os.environ.get("RUN_STORE") or in_run):
        return Finding("store", "none: runs lie in their folders")
    try:
        looked = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=STORE_TIMEOUT_S
        )
    except subprocess.TimeoutExpired:
        return Finding("store", "does not answer", f"see '{' '.join(command)}'")
    said = (looked.stdout.strip() or looked.stderr.strip()).removeprefix("store: ")
    return Finding("store", said, "" if looked.returncode == 0 else "do as it says, then again")


def check_room() -> Finding:
    """Check the number of cores and the free disk space."""
    free_gib = shutil.disk_usage(ROOT).free / 2**30
    state = f"{len(os.sched_getaffinity(0))} cores, {free_gib:.0f} GiB of disk free"
    short = free_gib < FREE_GIB_WANTED
    return Finding("room", state, f"free {FREE_GIB_WANTED} GiB of disk" if short else "")


CHECKS: tuple[Callable[[], Finding], ...] = (
    check_python,
    check_tools,
    check_venv,
    check_readers,
    check_driver,
    check_rendering,
    check_cluster,
    check_store,
    check_room,
)


def main() -> int:
    """Print every finding; the exit status is 1 if something is missing."""
    findings = [check() for check in CHECKS]
    for finding in findings:
        mark = "needs care" if finding.remedy else "well"
        sys.stdout.write(f"{mark:<11} {finding.subject}: {finding.state}\n")
        if finding.remedy:
            sys.stdout.write(f"{'':<11} to mend it: {finding.remedy}\n")
    return 1 if any(finding.remedy for finding in findings) else 0


def _pins() -> list[tuple[str, str]]:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pairs = (line.partition("==") for line in lines if "==" in line and not line.startswith("#"))
    return [(name.strip(), version.strip()) for name, _, version in pairs]


def _installed(name: str) -> str:
    try:
        return importlib.metadata.version(name).partition("+")[0]
    except importlib.metadata.PackageNotFoundError:
        return "none"


if __name__ == "__main__":
    sys.exit(main())
