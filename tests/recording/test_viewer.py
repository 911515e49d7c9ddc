"""The viewer without a screen is heard by this machine alone, and ends with its block."""

import ipaddress
import os
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from pipeline.errors import MachineError
from pipeline.recording import viewer
from pipeline.recording.viewer import off_screen_viewer

LISTENING = "0A"
PATIENCE_S = 30.0


def descendants(pid: int) -> list[int]:
    """Processes that a process started, and those that they started."""
    found: list[int] = []
    # A process or a thread may end while it is looked at.
    with suppress(FileNotFoundError, ProcessLookupError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            with suppress(FileNotFoundError, ProcessLookupError):
                for child in (task / "children").read_text().split():
                    found += [int(child), *descendants(int(child))]
    return found


def sockets_of(pids: list[int]) -> set[str]:
    """Inodes of the sockets that processes hold open."""
    links = []
    for pid in pids:
        # A running process closes files, and may end, while it is looked at.
        with suppress(FileNotFoundError, ProcessLookupError):
            for fd in Path(f"/proc/{pid}/fd").iterdir():
                with suppress(FileNotFoundError, ProcessLookupError):
                    links.append(str(fd.readlink()))
    return {link[8:-1] for link in links if link.startswith("socket:[")}


def listening_addresses(pids: list[int]) -> list[ipaddress.IPv4Address | ipaddress.IPv6Address]:
    """Addresses on which processes wait for connections, as the kernel tells them."""
    mine, found = sockets_of(pids), []
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == LISTENING and fields[9] in mine:
                words = bytes.fromhex(fields[1].partition(":")[0])
                # Words of four bytes, each in the machine's order.
                parts = [words[i : i + 4] for i in range(0, len(words), 4)]
                ordered = [p[::-1] if sys.byteorder == "little" else p for p in parts]
                found.append(ipaddress.ip_address(b"".join(ordered)))
    return found


def test_nothing_listens_beyond_this_machine_and_nothing_is_left() -> None:
    before = set(descendants(os.getpid()))
    try:
        with off_screen_viewer() as client:
            assert client.get_state().recordings == []
            started = [pid for pid in descendants(os.getpid()) if pid not in before]
            addresses = listening_addresses(started)
            assert addresses
            assert all(address.is_loopback for address in addresses), addresses
    except MachineError as error:
        pytest.skip(str(error))
    deadline = time.monotonic() + PATIENCE_S
    while left := [pid for pid in started if Path(f"/proc/{pid}/exe").exists()]:
        assert time.monotonic() < deadline, left
        time.sleep(0.05)


def test_a_viewer_that_does_not_start_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewer, "_viewer_command", lambda port: [sys.executable, "-c", "exit(3)"])
    with pytest.raises(MachineError, match="ended with code 3"), off_screen_viewer():
        pass
