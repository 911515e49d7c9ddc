"""Bytes that take long to make, kept in a file for the next process that wants them."""

import hashlib
from collections.abc import Callable
from pathlib import Path

from loguru import logger

from pipeline.artifacts.publishing import publish_bytes
from pipeline.errors import SoftgripError

_DIGEST_BYTES = hashlib.sha256().digest_size


def kept_bytes(path: Path, make: Callable[[], bytes]) -> bytes:
    """What a file keeps, or what ``make`` makes where there is none, or a damaged one.

    Parameters
    ----------
    path
        The file; its name tells all that the bytes depend on. Where it cannot be written, nothing
        is kept and the next process makes the bytes again.
    make
        Makes the bytes, always the same for this path.

    Returns
    -------
    The bytes.
    """
    kept = read_kept(path)
    if kept is not None:
        return kept
    made = make()
    keep(path, made)
    return made


def keep(path: Path, made: bytes) -> None:
    """Write bytes down behind their digest; where that cannot be, it is told to the log alone."""
    try:
        publish_bytes(path, hashlib.sha256(made).digest() + made)
    except (SoftgripError, OSError) as error:
        logger.debug("{} is not kept: {}", path, error)


def read_kept(path: Path) -> bytes | None:
    """The bytes that `keep` wrote; None where they are missing or damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    digest, kept = data[:_DIGEST_BYTES], data[_DIGEST_BYTES:]
    return kept if hashlib.sha256(kept).digest() == digest else None
