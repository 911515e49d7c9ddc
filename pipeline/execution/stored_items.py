"""A work item on a node that has no folder in common with the driver.

An item names its files by paths below the run's folder, or below one that is lent to the run. They
travel as keys, and on the node they are paths below a folder of the process that works on it.
Before the job, files that the store has are brought there; after it, files that the job has written
are put, each if nobody else has written it meanwhile, and those that it has removed are removed. So
jobs know nothing of stores.

A node keeps what it has brought by version, for all its processes; a process has links to it.
"""

import functools
import hashlib
import os
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.artifacts.object_store import ObjectStore, TakenError
from pipeline.artifacts.publishing import (
    file_sha256,
    published,
    remove_abandoned_scratch,
    scratch_beside,
)
from pipeline.errors import StoreError
from pipeline.execution.packed_items import ItemPacker, unpack_item
from pipeline.execution.run_roots import LENT, RunRoots, is_in_store
from pipeline.execution.run_store import Place, mark_of

CACHE_VARIABLE = "RUN_STORE_CACHE"  # of a node: where it keeps files; else the system's folder
_MIB = 2**20  # bytes, as the prefix says


@dataclass(frozen=True)
class Done:
    """What `timed` says of a job, and the keys of the files that its node has put and removed."""

    result: Any
    put: tuple[str, ...]
    removed: tuple[str, ...]


def run_from_store(sent: bytes, place: Place, program: str) -> bytes:
    """On a node: a packed job and items in, `Done` out, packed.

    Parameters
    ----------
    sent
        Job and items, of `ItemPacker.pack`.
    place
        Where the run lies.
    program
        Module that is ``__main__`` where the item comes from.

    Returns
    -------
    `Done`, packed.
    """
    node = node_folder(place)
    keys: dict[str, None] = {}

    def path_of(key: str) -> Path:
        keys[key] = None
        return node.roots.path_of(key)

    job, items = unpack_item(sent, {"__main__": program}, path_of)
    node.bring([key for key in keys if is_in_store(key)])
    result = timed(job, items)
    put, removed = node.put_back()
    return ItemPacker(node.roots.key_of).pack(Done(result, tuple(put), tuple(removed)))


def timed(job: Callable[[Any], Any], items: Sequence[Any]) -> tuple[float, list[Any]]:
    """How long a job takes with some items [s], and what it makes of each."""
    began = time.perf_counter()
    made = [job(item) for item in items]
    return time.perf_counter() - began, made


class NodeFolder:
    """The files of one run that a process on a node works with.

    Parameters
    ----------
    place
        Where the run lies.
    root
        Folder of the node, for all its processes.
    store
        The run's objects; None: those that the place names.
    """

    def __init__(self, place: Place, root: Path, store: ObjectStore | None = None) -> None:
        name = hashlib.sha256(place.url.encode()).hexdigest()[:16]
        root.mkdir(parents=True, exist_ok=True)
        remove_abandoned_scratch(root)  # of processes that were killed
        self._place = place
        self._store = store or ObjectStore(place.url, place.patience_s)
        self._kept = root / f"{name}.files"
        self._kept.mkdir(exist_ok=True)
        self.run = scratch_beside(root / name)
        self.run.mkdir()
        self.roots = RunRoots(self.run, self.run / LENT, root / f"{name}.cache")
        self._brought: dict[str, str | None] = {}  # key → version in the store
        self._marks: dict[str, tuple[int, int, int] | None] = {}  # key → the file as brought

    def bring(self, keys: Sequence[str]) -> None:
        """Have those of some files that the store has, as they are there now, and no others."""
        for path in sorted(self.run.rglob("*")):
            if path.is_file() and path.relative_to(self.run).as_posix() not in keys:
                path.unlink()
        before, marks = self._brought, self._marks
        self._brought, self._marks = {}, {}
        for key in keys:
            path = self.run / key
            found = self._store.head(key) if key != "." else None
            self._brought[key] = found.version if found else None
            if found is None:
                if path.is_file():
                    path.unlink()
            elif before.get(key) != found.version or marks[key] != _mark(path):
                path.parent.mkdir(parents=True, exist_ok=True)
                path.unlink(missing_ok=True)
                self._link(key, found.version, path)
            self._marks[key] = _mark(path)

    def put_back(self) -> tuple[list[str], list[str]]:
        """Put what was written since files were brought, and remove what was removed.

        Returns
        -------
        The keys of those that were put, and of those that were removed.

        Raises
        ------
        StoreError
            The store cannot be used, or another run wrote other bytes there.
        """
        put: list[str] = []
        removed: list[str] = []
        for key, version in self._brought.items():
            path, mark = self.run / key, self._marks[key]
            if not path.is_file():
                if mark is not None:
                    self._store.remove(key)
                    removed.append(key)
            elif _mark(path) != mark:
                self._put(key, path, version)
                path.unlink()  # who needs it brings it: a node keeps no more than it reads
                put.append(key)
        return put, removed

    def _put(self, key: str, path: Path, instead_of: str | None) -> None:
        try:
            self._store.put_if(key, path, instead_of)
        except TakenError as error:
            there = self._kept / f"compared-{os.getpid()}"
            try:
                self._store.fetch(key, there)
                same = file_sha256(there) == file_sha256(path)
            finally:
                there.unlink(missing_ok=True)
            if not same:
                raise StoreError(
                    f"{self._store.url}/{key} was written by another process, with other content",
                    "See that one machine alone makes this run, and run the same command again",
                ) from error

    def _link(self, key: str, version: str, path: Path) -> None:
        """A link to the node's copy of an object, which is brought where there is none."""
        name = hashlib.sha256(f"{key} {version}".encode()).hexdigest()
        kept = self._kept / name
        for _ in range(2):  # another process may free the copy between the two
            if not kept.is_file():
                self._make_room()
                self._store.fetch(key, kept)
            try:
                os.utime(kept)
                path.hardlink_to(kept)
            except FileNotFoundError:
                continue
            return
        with published(path) as scratch:
            self._store.fetch(key, scratch)

    def _make_room(self) -> None:
        """Free the copies that were used least recently, where all are more than are kept."""
        found = []
        for path in self._kept.iterdir():
            try:
                status = path.stat()
            except FileNotFoundError:  # another process frees it too
                continue
            found.append((status.st_mtime_ns, status.st_size, path))
        held = sum(size for _, size, _ in found)
        for _, size, path in sorted(found):
            if held <= self._place.cache_mib * _MIB:
                return
            path.unlink(missing_ok=True)
            held -= size


@functools.cache
def node_folder(place: Place) -> NodeFolder:
    """The folder of this process for a run; it stays, so that what was read is known again."""
    named = os.environ.get(CACHE_VARIABLE)
    return NodeFolder(
        place, Path(named or Path(tempfile.gettempdir()) / f"softgrip-{os.getuid()}" / "store")
    )


def _mark(path: Path) -> tuple[int, int, int] | None:
    return mark_of(path) if path.is_file() else None
