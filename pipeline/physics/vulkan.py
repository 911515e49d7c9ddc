"""Which Vulkan driver renders: the machine's GPU, or Mesa's lavapipe on the CPU."""

import os
import sys
from pathlib import Path

import sapien

from pipeline.errors import MachineError

_LAVAPIPE_MANIFESTS = "lvp_icd*.json"
MANIFEST_FOLDERS = (
    Path("/etc/vulkan/icd.d"),
    Path("/usr/local/share/vulkan/icd.d"),
    Path("/usr/share/vulkan/icd.d"),
)
# CoACD's library and SAPIEN's share symbols that the linker makes one a process. With CoACD's
# taken, lavapipe's pictures have the right depth and no light (coacd 1.0.14, sapien 3.0.3).
_COACD_CAME_FIRST = "coacd" in sys.modules
USER_CHOICES = ("VK_ICD_FILENAMES", "VK_DRIVER_FILES")


def gpu_present() -> bool:
    """Whether the kernel offers a GPU to this process."""
    devices = Path("/dev")
    return any(devices.glob("nvidia[0-9]*")) or any(devices.glob("dri/renderD*"))


def choose_vulkan_driver() -> None:
    """Name lavapipe to the Vulkan loader where there is no GPU and the user named no driver.

    Must run before the process's first render system. Does nothing where a GPU is present,
    where VK_ICD_FILENAMES or VK_DRIVER_FILES is set, or where lavapipe is not installed.
    """
    if gpu_present() or any(os.environ.get(name) for name in USER_CHOICES):
        return
    for folder in MANIFEST_FOLDERS:
        for manifest in sorted(folder.glob(_LAVAPIPE_MANIFESTS)):
            os.environ["VK_ICD_FILENAMES"] = str(manifest)
            return


def new_render_system() -> sapien.render.RenderSystem:
    """A SAPIEN render system on the chosen driver.

    Returns
    -------
    The system.

    Raises
    ------
    MachineError
        No Vulkan driver can render, or pictures would have no light.
    """
    if _COACD_CAME_FIRST:
        raise MachineError(
            "coacd was imported before sapien, and pictures rendered then are black",
            "Import sapien first, or coacd only where convex parts are computed",
        )
    choose_vulkan_driver()
    try:
        return sapien.render.RenderSystem()
    except RuntimeError as error:
        raise MachineError(
            f"no Vulkan driver on this machine can render ({error})",
            "Run `make doctor` for the command that installs Mesa's lavapipe (24.3 or newer), "
            "or render with Embree rays, which need no driver.",
        ) from error
