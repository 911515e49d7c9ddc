"""A run that lies in an object store: the machine that makes it keeps a copy in the run's folder.

Stages and Make work on the folder. At a stage's start the driver brings what the store has and the
folder has not, in its course what nodes have put there, and at its end it puts what is new. So the
store holds the run, and a folder that is lost, or empty on another machine, is filled from it.
"""

import json
import os
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from loguru import logger

from pipeline.artifacts.digests import MEMO
from pipeline.artifacts.object_store import ObjectStore, StoredObject
from pipeline.artifacts.publishing import SCRATCH_SUFFIX, publish_bytes
from pipeline.config.store import StoreConfig
from pipeline.config.tree import load_run_config
from pipeline.errors import ConfigError
from pipeline.execution.run_folder import RunFolder
from pipeline.execution.run_roots import LENT, RunRoots
from pipeline.execution.store_lease import CLOCK, LEASE, Lease
from pipeline.progress import progress

VARIABLE = "RUN_STORE"
NOTES = "store.json"  # in the run's state: what the store and the folder last had in common
STATE = ".state"
# Of one machine, or made again in no time: Make's stamps, locks, memories and caches.
OF_THIS_MACHINE = ("lock", "owner", "mesh_dir", "renderer.json", NOTES, "query", "samples", MEMO)
STAMPS = (".key", ".lock")
# On their way to a node: scattered samples, and files of a folder outside the run.
PASSING = ((STATE, "shards"), tuple(LENT.split("/")))
NOT_OF_STAGES = ("logs", "export", "publish", "real", "robot")  # folders that goals beside write
LOOKED_AT_S = 10.0  # a person waits for `make status`: no longer for a store that does not answer
PUT_EVERY_S = 30.0  # while local processes work: what a killed machine may lose


@dataclass(frozen=True)
class Place:
    """Where a run lies, as a node is told it.

    Attributes
    ----------
    url
        Of the run.
    cache_mib
        Files that a node keeps at once, at most [MiB].
    patience_s
        How long a request is tried again [s].
    """

    url: str
    cache_mib: int
    patience_s: float


@dataclass(frozen=True)
class Note:
    """What store and folder last had in common of one file.

    Attributes
    ----------
    version
        In the store.
    mark
        Size, date [ns] and inode in the folder.
    """

    version: str
    mark: tuple[int, int, int]


class RunStore:
    """A run's folder and its store.

    Parameters
    ----------
    store
        The run's objects.
    folder
        The run's folder here.
    place
        Where the run lies, as a node is told it.
    lease
        The right to make the run.
    """

    def __init__(self, store: ObjectStore, folder: RunFolder, place: Place, lease: Lease) -> None:
        self.place, self._store, self.folder, self._lease = place, store, folder, lease
        self._notes = read_notes(folder)
        self._lent: Path | None = None
        self._last_put = time.monotonic()

    @property
    def roots(self) -> RunRoots:
        """The folders here whose files an item may name."""
        return RunRoots(self.folder.path, self._lent, self.folder.cache)

    @contextmanager
    def lending(self, folder: Path, files: Sequence[Path]) -> Iterator[None]:
        """Within the block items may name files of a folder outside the run, too.

        Parameters
        ----------
        folder
            That folder, here.
        files
            Those of its files that are put for the nodes; they are removed after the block.

        Raises
        ------
        StoreError
            The store cannot be used, or another driver has taken the run.
        """
        self._lease.check()
        self._lent = folder
        for path in progress(files, len(files), "store: files that nodes read", "file"):
            self._store.put(self.roots.key_of(path), path)
        yield
        self._lent = None
        self.discard(self.folder.path / LENT)

    def pull(self) -> int:
        """Bring what is new in the store; what changed here alone stays. How many files came."""
        brought = 0
        for key, found in self._store.listed().items():
            if belongs_to_run(key) and self._is_wanted(found):
                self._fetch(key)
                brought += 1
        self.save_notes()
        return brought

    def bring(self, put: Iterable[str], removed: Iterable[str]) -> None:
        """Bring files that a node has put, and remove those that it has removed.

        Parameters
        ----------
        put
            Keys of files; those on their way from node to node come too, and are not noted.
        removed
            Keys of files.

        Raises
        ------
        StoreError
            The store cannot be used, or another driver has taken the run.
        """
        self._lease.check()
        for key in removed:
            (self.folder.path / key).unlink(missing_ok=True)
            self._notes.pop(key, None)
        for key in put:
            found = self._store.head(key)
            if found is not None and self._is_wanted(found):
                self._fetch(key)

    def put_now_and_then(self) -> None:
        """Put what is new, if the last time is some while ago."""
        if time.monotonic() - self._last_put > PUT_EVERY_S:
            self.put()

    def put(self) -> int:
        """Put what is new in the folder, and remove what is no more there. How many were put."""
        self._lease.check()
        here, put = files_of_run(self.folder), 0
        for key, path in here.items():
            try:
                mark, note = mark_of(path), self._notes.get(key)
                if note is None or note.mark != mark:
                    self._notes[key] = Note(self._store.put(key, path), mark)
                    put += 1
            except FileNotFoundError:  # a worker has just removed it
                continue
        for key in [key for key in self._notes if key not in here]:
            self._store.remove(key)
            del self._notes[key]
        self.save_notes()
        self._last_put = time.monotonic()
        return put

    @contextmanager
    def same(self, path: Path) -> Iterator[None]:
        """A file that gets another date within the block, and stays as it is in the store."""
        key = path.relative_to(self.folder.path).as_posix()
        note = self._notes.get(key)
        same = note is not None and note.mark == mark_of(path)
        yield
        if note is not None and same:
            self._notes[key] = Note(note.version, mark_of(path))

    def discard(self, below: Path) -> None:
        """Remove the objects of a folder that only nodes have filled."""
        begin = below.relative_to(self.folder.path).as_posix() + "/"
        for key in self._store.listed():
            if key.startswith(begin):
                self._store.remove(key)

    def save_notes(self) -> None:
        """Note what store and folder have in common."""
        noted = {key: [note.version, *note.mark] for key, note in sorted(self._notes.items())}
        publish_bytes(self.folder.state(NOTES), json.dumps(noted, indent=1).encode())

    def _is_wanted(self, found: StoredObject) -> bool:
        """Whether the store's file is to take the place of the folder's."""
        path, note = self.folder.path / found.key, self._notes.get(found.key)
        if not path.is_file():
            return True
        if found.key == self.folder.config.name:  # a person writes it, here
            if note is None and self._store.read(found.key) == path.read_bytes():
                self._notes[found.key] = Note(found.version, mark_of(path))
            return False
        return note is None or note.version != found.version

    def _fetch(self, key: str) -> None:
        path = self.folder.path / key
        found = self._store.fetch(key, path)
        if belongs_to_run(key):
            self._notes[key] = Note(found.version, mark_of(path))


@contextmanager
def opened(folder: RunFolder, config: StoreConfig, stage: str) -> Iterator[RunStore | None]:
    """A run's store, with the right to make the run; the folder has what the store has.

    Parameters
    ----------
    folder
        The run.
    config
        As run.toml says.
    stage
        What is made.

    Yields
    ------
    RunStore | None
        None where the run lies in its folder alone.

    Raises
    ------
    StoreError
        The store cannot be used, or another driver makes the run.
    """
    place = place_of(folder, config)
    if place is None:
        yield None
        return
    store = ObjectStore(place.url, place.patience_s)
    with Lease(store, stage, config.lease_s) as lease:
        run = RunStore(store, folder, place, lease)
        if brought := run.pull():
            logger.info("{}: {} files came from {}", stage, brought, place.url)
        try:
            yield run
        finally:
            run.save_notes()


def place_of(folder: RunFolder, config: StoreConfig) -> Place | None:
    """Where a run lies beside its folder: as RUN_STORE says, else run.toml; None: nowhere."""
    named = os.environ.get(VARIABLE, "")
    try:
        url = StoreConfig(url=named).url or config.url
    except ValueError as error:
        raise ConfigError(
            f"{VARIABLE} = '{named}' is no object store", "Write it as s3://bucket/prefix"
        ) from error
    if not url:
        return None
    parent = folder.path.absolute().parent
    within = (parent / folder.config.name).is_file()
    name = f"{parent.name}/{folder.path.name}" if within else folder.path.name
    return Place(f"{url.rstrip('/')}/{name}", config.cache_mib, config.patience_s)


def store_named_in(folder: RunFolder) -> StoreConfig:
    """The store that run.toml names; none where this softgrip cannot read it, as of an old run."""
    try:
        return load_run_config(folder.config).store
    except ConfigError:
        return StoreConfig()


def fetch_configuration(folder: RunFolder) -> None:
    """Bring run.toml where this machine has none and RUN_STORE names a store."""
    if folder.config.is_file() or not os.environ.get(VARIABLE):
        return
    config = StoreConfig()
    if place := place_of(folder, config):
        store = ObjectStore(place.url, place.patience_s)
        if store.head(folder.config.name) is not None:
            store.fetch(folder.config.name, folder.config)


def look(folder: RunFolder) -> list[str]:
    """What a run's store is and holds, in lines; none where the run lies in its folder alone.

    Parameters
    ----------
    folder
        The run.

    Returns
    -------
    Lines.

    Raises
    ------
    StoreError
        It cannot be read, or not be written.
    """
    fetch_configuration(folder)
    place = place_of(folder, load_run_config(folder.config).store)
    if place is None:
        return []
    store = ObjectStore(place.url, min(place.patience_s, LOOKED_AT_S))
    store.put(CLOCK, b"")
    held = [found for key, found in store.listed().items() if belongs_to_run(key)]
    size_mb = sum(found.size for found in held) / 1e6
    return [f"store: {place.url} can be written and holds {len(held)} files, {size_mb:.1f} MB"]


def belongs_to_run(key: str) -> bool:
    """Whether a file, named below the run's folder, is kept in the store by the driver."""
    parts = tuple(key.split("/"))
    if key in (LEASE, CLOCK) or parts[-1].endswith(SCRATCH_SUFFIX) or parts[:2] in PASSING:
        return False
    if parts[0] == STATE:
        own = parts[1] in OF_THIS_MACHINE or parts[1].startswith("hashes")
        return not own and not parts[-1].endswith(STAMPS)
    return len(parts) == 1 or parts[0] not in NOT_OF_STAGES


def files_of_run(folder: RunFolder) -> dict[str, Path]:
    """Key → file, of all that the driver keeps in the store; a run within this one has its own."""
    found = {}
    for root, folders, names in os.walk(folder.path):
        if Path(root) != folder.path and folder.config.name in names:
            folders.clear()
            continue
        for name in names:
            path = Path(root) / name
            key = path.relative_to(folder.path).as_posix()
            if belongs_to_run(key):
                found[key] = path
    return dict(sorted(found.items()))


def mark_of(path: Path) -> tuple[int, int, int]:
    """Size, date [ns] and inode of a file: others wherever it was written anew."""
    status = path.stat()
    return status.st_size, status.st_mtime_ns, status.st_ino


def read_notes(folder: RunFolder) -> dict[str, Note]:
    """What store and folder last had in common; nothing where that is not known."""
    try:
        noted = json.loads(folder.state(NOTES).read_text())
        return {key: Note(version, tuple(mark)) for key, (version, *mark) in noted.items()}
    except (FileNotFoundError, ValueError):
        return {}
