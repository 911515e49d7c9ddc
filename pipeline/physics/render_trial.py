"""Which renderer works on this machine: ``python -m pipeline.physics.render_trial`` prints JSON.

It runs in a process of its own because graphics drivers leave threads and settings behind.
"""

import json
import sys
from importlib.metadata import version
from pathlib import Path

from pipeline.artifacts.publishing import file_sha256
from pipeline.errors import MachineError
from pipeline.physics.vulkan import MANIFEST_FOLDERS, new_render_system

DIGEST_LENGTH = 12  # hexadecimal digits that tell two drivers apart


def try_renderer() -> str:
    """Name SAPIEN's version, device and driver files; empty where SAPIEN cannot render."""
    try:
        system = new_render_system()
    except MachineError:
        return ""
    drivers = " ".join(f"{p.name} {file_sha256(p)[:DIGEST_LENGTH]}" for p in loaded_drivers())
    return f"SAPIEN {version('sapien')} on {system.device.name}, {drivers or 'unknown driver'}"


def manifests() -> list[Path]:
    """Files that name the Vulkan drivers of this machine."""
    return [path for folder in MANIFEST_FOLDERS for path in sorted(folder.glob("*.json"))]


def loaded_drivers() -> list[Path]:
    """Vulkan drivers that are loaded into this process, of those that a manifest names."""
    # A manifest names libX.so.0, and what is mapped is the file behind that link, libX.so.550.54.
    named = {
        Path(json.loads(manifest.read_text())["ICD"]["library_path"]).name.split(".so")[0]
        for manifest in manifests()
    }
    lines = Path("/proc/self/maps").read_text().splitlines()
    mapped = {Path(line.split(maxsplit=5)[5]) for line in lines if "/" in line}
    return sorted(path for path in mapped if path.name.split(".so")[0] in named)


def main() -> None:
    """Print the renderer, and the files and folders that the answer depends on."""
    renderer = try_renderer()
    watched = [str(path) for path in (*MANIFEST_FOLDERS, *manifests(), *loaded_drivers())]
    sys.stdout.write(json.dumps({"renderer": renderer, "watched": watched}))


if __name__ == "__main__":
    main()
