"""Publishing files whole or not at all: written beside their place, flushed, renamed.

A file is first written to a scratch file whose name holds its writer's machine and process. Two
writers of one file therefore use different scratch files, and a scratch file of a process that was
killed can be told from one that is still being written.
"""

import errno
import functools
import hashlib
import os
import re
import secrets
import shutil
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline.errors import ArtifactError

HASH_BLOCK_BYTES = 1 << 20  # hashed at once: bounds the memory of a digest
FULL = (errno.ENOSPC, errno.EDQUOT)
FORBIDDEN = (errno.EACCES, errno.EPERM, errno.EROFS)
CANNOT_WRITE = FULL + FORBIDDEN

SCRATCH_SUFFIX = ".part"
LONGEST_NAME_BYTES = 255  # of a file, on every file system of Linux
# A writer on another machine cannot be asked whether it lives; none leaves its file alone so long.
ABANDONED_AFTER_S = 24 * 3600.0
_WRITER = re.compile(r"\.([0-9a-f]{8})-(\d+)-(\d+)-[0-9a-f]{8}\.part$")


@contextmanager
def published(path: Path) -> Iterator[Path]:
    """Write a file through a scratch file beside it, which replaces it when the block succeeds.

    On any failure the scratch file is removed and a former file at ``path`` stays.

    Parameters
    ----------
    path
        The file to write; missing folders are made.

    Yields
    ------
    Path
        The scratch file to write to.

    Raises
    ------
    ArtifactError
        The disk is full or the folder cannot be written.
    """
    scratch = scratch_beside(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield scratch
        with scratch.open("rb+") as file:
            os.fsync(file.fileno())
        scratch.replace(path)
        _flush_folder(path.parent)
    except OSError as error:
        raise write_error(path, error) from error
    finally:
        scratch.unlink(missing_ok=True)


@contextmanager
def published_folder(path: Path) -> Iterator[Path]:
    """Fill a folder under another name beside it, which becomes ``path`` when the block succeeds.

    On any failure, an interrupt too, the scratch folder is removed.

    Parameters
    ----------
    path
        The folder; it does not exist, and the one that it lies in does.

    Yields
    ------
    Path
        The scratch folder to fill.
    """
    scratch = scratch_beside(path)
    try:
        scratch.mkdir()
        yield scratch
        scratch.rename(path)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def scratch_beside(path: Path) -> Path:
    """A new hidden name beside ``path`` for a scratch file; it holds this machine and process."""
    ending = f".{this_process()}-{secrets.token_hex(4)}{SCRATCH_SUFFIX}"
    room = LONGEST_NAME_BYTES - len(ending) - 1
    return path.with_name(f".{path.name.encode()[:room].decode(errors='ignore')}{ending}")


def this_process() -> str:
    """A name of this process that no other has, on any machine."""
    return f"{_machine()}-{os.getpid()}-{_start_of(os.getpid())}"


def has_ended(process: str) -> bool:
    """Whether a process, named by `this_process`, was of this machine and is no more."""
    machine, _, rest = process.partition("-")
    pid, _, start = rest.partition("-")
    return machine == _machine() and _start_of(int(pid)) != int(start)


def remove_abandoned_scratch(folder: Path) -> list[Path]:
    """Remove scratch files of killed writers; what a running process writes stays.

    Parameters
    ----------
    folder
        Searched with all folders below it.

    Returns
    -------
    The scratch files and folders that were removed.
    """
    removed = []
    for scratch in sorted(folder.rglob(f".*{SCRATCH_SUFFIX}")):
        if not _is_abandoned(scratch):
            continue
        if scratch.is_dir():
            shutil.rmtree(scratch, ignore_errors=True)
        else:
            scratch.unlink(missing_ok=True)
        removed.append(scratch)
    return removed


def publish_bytes(path: Path, data: bytes) -> None:
    """Write a small file whole."""
    with published(path) as scratch:
        scratch.write_bytes(data)


def file_sha256(path: Path) -> str:
    """SHA-256 of a file's content, as hex."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(HASH_BLOCK_BYTES):
            digest.update(block)
    return digest.hexdigest()


def write_error(path: Path, error: OSError) -> ArtifactError:
    """The error for a file that could not be written: the system's reason, and the remedy."""
    if error.errno in FULL:
        return ArtifactError(
            f"{path} could not be written: the disk is full",
            "Free some space and run the same command again; finished shards are kept",
        )
    if error.errno in FORBIDDEN:
        return ArtifactError(
            f"{path} could not be written: {error.strerror}",
            f"Make {path.parent} writable and run the same command again",
        )
    return ArtifactError(
        f"{path} could not be written: {error}", "Mend this and run the same command again"
    )


def _is_abandoned(scratch: Path) -> bool:
    """Whether the writer named in a scratch file's name has ended, as far as can be told."""
    writer = _WRITER.search(scratch.name)
    if writer is not None and writer[1] == _machine():
        return _start_of(int(writer[2])) != int(writer[3])
    try:
        idle_s = time.time() - scratch.stat().st_mtime
    except FileNotFoundError:  # published, or removed by its writer, just now
        return False
    return idle_s > ABANDONED_AFTER_S


@functools.cache
def _machine() -> str:
    """Where a process number means one process: machine, its boot, and the container's numbers."""
    boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    numbers = Path("/proc/self/ns/pid").readlink()
    return hashlib.sha256(f"{socket.gethostname()} {boot} {numbers}".encode()).hexdigest()[:8]


def _start_of(pid: int) -> int:
    """When a process began [clock ticks since boot]; 0 where it has ended.

    A number is given to another process in time, and that one began later.
    """
    try:
        status = Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return 0
    fields = status.rpartition(")")[2].split()  # the name before may hold anything
    state, start_ticks = fields[0], fields[19]
    return 0 if state in "ZX" else int(start_ticks)


def _flush_folder(folder: Path) -> None:
    """Make the rename itself durable."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
