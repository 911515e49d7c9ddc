"""Files appear whole or not at all: written beside their place, flushed, renamed."""

import errno
import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline.errors import ArtifactError

HASH_BLOCK_BYTES = 1 << 20
FULL = (errno.ENOSPC, errno.EDQUOT)
FORBIDDEN = (errno.EACCES, errno.EPERM, errno.EROFS)
CANNOT_WRITE = FULL + FORBIDDEN


@contextmanager
def published(path: Path) -> Iterator[Path]:
    """Yield a scratch path beside ``path``; on success it becomes ``path``.

    On any failure the scratch file goes and what stood at ``path`` stays.

    Raises
    ------
    ArtifactError : the disk is full or the folder cannot be written.
    """
    scratch = path.with_name(f".{path.name}.part")
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
    """What the system says of a file that could not be written, with what to do about it."""
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


def _flush_folder(folder: Path) -> None:
    """Make the rename itself durable."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
