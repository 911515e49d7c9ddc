"""The Vulkan driver SAPIEN renders with: a GPU's, or Mesa's software one (lavapipe).

``python3 -m pipeline.machine.vulkan_driver`` installs the software driver where
there is no GPU and the user may; otherwise it prints the exact commands.
Lavapipe before Mesa 24.3 lacks what SAPIEN needs, so Debian 12 takes its
driver from backports, from the mirror the machine already uses.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

PACKAGE = "mesa-vulkan-drivers"
OLDEST_MESA = (24, 3)  # the first whose lavapipe SAPIEN can render with
ICD_FOLDERS = (Path("/usr/share/vulkan/icd.d"), Path("/etc/vulkan/icd.d"))
APT_SOURCES = Path("/etc/apt/sources.list.d")
APT_TIMEOUT_S = 600  # a slow mirror needs minutes, a dead one for ever


def has_gpu() -> bool:
    """Whether an NVIDIA GPU with its Vulkan driver is there."""
    return Path("/dev/nvidiactl").exists() and any(
        folder.joinpath("nvidia_icd.json").is_file() for folder in ICD_FOLDERS
    )


def software_icd() -> Path | None:
    """The lavapipe manifest, where installed."""
    found = sorted(icd for folder in ICD_FOLDERS for icd in folder.glob("lvp_icd*.json"))
    return found[0] if found else None


def mesa_version() -> tuple[int, ...] | None:
    """Version of the installed Mesa Vulkan drivers, as dpkg knows it; None if unknown."""
    if shutil.which("dpkg-query") is None:
        return None
    query = subprocess.run(
        ["dpkg-query", "-W", "-f", "${Version}", PACKAGE],
        capture_output=True,
        text=True,
        check=False,
    )
    return _parsed(query.stdout) if query.returncode == 0 else None


def is_ready() -> bool:
    """Whether SAPIEN can render here."""
    if has_gpu():
        return True
    version = mesa_version()
    return software_icd() is not None and (version is None or version >= OLDEST_MESA)


def install_commands() -> list[list[str]]:
    """What to run, as root, to get a software driver that is new enough."""
    commands = [["apt-get", "update", "-q"]]
    install = ["apt-get", "install", "-y", "-q", PACKAGE, "libvulkan1"]
    release = _release()
    if release.get("ID") == "debian" and release.get("VERSION_ID") == "12":
        install[3:3] = ["-t", f"{release['VERSION_CODENAME']}-backports"]
    return [*commands, install]


def backports_source() -> str | None:
    """A deb822 entry for Debian 12's backports, on the mirror already configured."""
    release = _release()
    if release.get("ID") != "debian" or release.get("VERSION_ID") != "12":
        return None
    suite = release["VERSION_CODENAME"]
    for listing in sorted(APT_SOURCES.glob("*.sources")):
        text = listing.read_text()
        if f"{suite}-backports" in text:
            return None
        for paragraph in re.split(r"\n\s*\n", text):
            if re.search(rf"^Suites:.*\b{suite}\b(?!-security)", paragraph, re.MULTILINE):
                lines = [line for line in paragraph.splitlines() if not line.startswith("#")]
                return (
                    "\n".join(
                        f"Suites: {suite}-backports" if line.startswith("Suites:") else line
                        for line in lines
                    )
                    + "\n"
                )
    return None


def install() -> bool:
    """Install the software driver; False if it could not be.

    Only for root, on machines with apt-get.
    """
    source = backports_source()
    if source is not None:
        APT_SOURCES.joinpath("softgrip-backports.sources").write_text(source)
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for command in install_commands():
        done = subprocess.run(
            command,
            env=environment,
            check=False,
            timeout=APT_TIMEOUT_S,
            stdout=subprocess.DEVNULL,
            stdin=subprocess.DEVNULL,
        )
        if done.returncode != 0:
            return False
    return is_ready()


def may_install() -> bool:
    """Whether this user is root on a machine with apt-get."""
    return os.geteuid() == 0 and shutil.which("apt-get") is not None


def advice() -> str:
    """The commands that a user with sudo has to run."""
    lines = []
    source = backports_source()
    if source is not None:
        target = APT_SOURCES / "softgrip-backports.sources"
        lines.append(f"printf '%b' {source!r} | sudo tee {target}")
    lines += [" ".join(["sudo", *command]) for command in install_commands()]
    return "\n".join(f"    {line}" for line in lines)


def main() -> int:
    """Make a driver available, or say how."""
    if is_ready():
        return 0
    if may_install():
        sys.stderr.write("No Vulkan driver that SAPIEN can use: installing Mesa's software one\n")
        if install():
            return 0
        sys.stderr.write("The installation failed; ")
    sys.stderr.write(
        "No usable Vulkan driver: scenes will be rendered with Embree rays instead. "
        f"For SAPIEN's renderer run\n{advice()}\n"
    )
    return 0


def _parsed(version: str) -> tuple[int, ...] | None:
    match = re.match(r"(?:\d+:)?(\d+)\.(\d+)", version)
    return (int(match[1]), int(match[2])) if match else None


def _release() -> dict[str, str]:
    path = Path("/etc/os-release")
    if not path.is_file():
        return {}
    pairs = (line.partition("=") for line in path.read_text().splitlines() if "=" in line)
    return {name: value.strip('"') for name, _, value in pairs}


if __name__ == "__main__":
    sys.exit(main())
