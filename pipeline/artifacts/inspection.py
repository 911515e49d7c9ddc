"""Contents of an artifact, and whether the files it was made from are unchanged."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from pipeline.artifacts.named_inputs import (
    FAMILIES_FILE,
    MASSES_FILE,
    named_inputs,
    noted_mesh_dir,
)
from pipeline.artifacts.provenance import Input, Provenance
from pipeline.artifacts.publishing import file_sha256
from pipeline.artifacts.reading import open_artifact
from pipeline.config import load_run_config
from pipeline.errors import ArtifactError, ConfigError
from schemas.softgrip.v1.grasps_pb2 import ShardIndex

MESHES = "meshes/"  # inputs of this name lie in the mesh folder
RUN_FILE = "run.toml"
ARTIFACT_SUFFIX = ".mcap"
INDEX_NAME = ShardIndex.DESCRIPTOR.full_name


@dataclass(frozen=True)
class Contents:
    """What an artifact records of itself.

    Attributes
    ----------
    path
        The file.
    size_bytes
        Its size [bytes].
    provenance
        What made it.
    counts
        Topic → (schema, messages).
    attachments
        Name → size [bytes].
    shards
        File → samples, of a sharded artifact's index; empty for others.
    """

    path: Path
    size_bytes: int
    provenance: Provenance
    counts: dict[str, tuple[str, int]]
    attachments: dict[str, int]
    shards: dict[str, int]


@dataclass(frozen=True)
class Finding:
    """One file compared with what is recorded of it.

    Attributes
    ----------
    path
        The file.
    problem
        What differs, in words; empty where nothing does.
    """

    path: Path
    problem: str = ""


def read_contents(path: Path) -> Contents:
    """Read provenance, schemas, counts, attachments and shards of an artifact.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    What it records of itself.

    Raises
    ------
    ArtifactError
        The file is missing, damaged or of another version.
    """
    with open_artifact(path) as artifact:
        counts = artifact.counts()
        sharded = any(schema == INDEX_NAME for schema, _ in counts.values())
        return Contents(
            path=path,
            size_bytes=path.stat().st_size,
            provenance=artifact.provenance,
            counts=dict(sorted(counts.items())),
            attachments=artifact.attachment_sizes(),
            shards={s.path: s.samples for s in artifact.one(ShardIndex).shards} if sharded else {},
        )


def verify_files(path: Path, mesh_dir: Path | None) -> Iterator[Finding]:
    """Compare a file, and everything it was made from up to the meshes, with the recorded digests.

    Every byte of every artifact is read, each file once, however many others name it.

    Parameters
    ----------
    path
        The artifact to begin with.
    mesh_dir
        Folder of the meshes; None: the folder that Make noted in each run, and where it noted none,
        meshes are reported as not compared.

    Yields
    ------
    Finding
        One for each file.
    """
    digest = cache(file_sha256)
    waiting, seen, places = [path.resolve()], set(), dict[Path, _Places]()
    while waiting:
        file = waiting.pop()
        if file in seen:
            continue
        seen.add(file)
        run = run_folder(file)
        if run not in places:
            places[run] = _places_of(run, mesh_dir)
            if places[run].problem:
                yield Finding(run / RUN_FILE, places[run].problem)
        try:
            inputs, shards = _read_named_files(file)
        except ArtifactError as error:
            yield Finding(file, str(error))
            continue
        yield Finding(file)
        for entry in shards:
            found = _compared(entry, file.parent, file, digest)
            if found.problem:
                yield found
            else:
                waiting.append(found.path)
        for entry in inputs:
            found = _compared_input(entry, run, places[run], file, digest)
            if found.problem or found.path.suffix != ARTIFACT_SUFFIX:
                yield found
            else:
                waiting.append(found.path.resolve())


@dataclass(frozen=True)
class _Places:
    """Where inputs of a run lie that are not in its folder."""

    meshes: Path | None
    named: dict[str, Path]
    problem: str = ""
    """Why what run.toml names is not known, in words."""


def _places_of(run: Path, mesh_dir: Path | None) -> _Places:
    meshes, config = mesh_dir or noted_mesh_dir(run), run / RUN_FILE
    if not config.is_file():
        return _Places(meshes, {})
    try:
        return _Places(meshes, named_inputs(run, load_run_config(config), meshes))
    except (ArtifactError, ConfigError) as error:
        return _Places(meshes, {}, str(error))


def _compared_input(
    entry: Input, run: Path, places: _Places, by: Path, digest: Callable[[Path], str]
) -> Finding:
    """One input compared: of the mesh folder, of where run.toml says, else of the run's folder."""
    if entry.path in places.named:
        place = places.named[entry.path]
        return _compared(Input(place.name, entry.sha256), place.parent, by, digest)
    with_meshes = entry.path.startswith(MESHES) or entry.path in (FAMILIES_FILE, MASSES_FILE)
    if not with_meshes:
        return _compared(entry, run, by, digest)
    if places.meshes is None:
        return Finding(Path(entry.path), "not compared: name the folder by --mesh-dir")
    name = entry.path.removeprefix(MESHES)
    return _compared(Input(name, entry.sha256), places.meshes, by, digest)


def run_folder(path: Path) -> Path:
    """The folder of the run a file belongs to: the nearest one with a run.toml, else its own."""
    for folder in path.resolve().parents:
        if (folder / RUN_FILE).is_file():
            return folder
    return path.resolve().parent


def _read_named_files(file: Path) -> tuple[tuple[Input, ...], list[Input]]:
    """What a whole file names: what it was made from, and its shards."""
    with open_artifact(file) as artifact:
        artifact.check()
        shards: list[Input] = []
        if any(schema == INDEX_NAME for schema, _ in artifact.counts().values()):
            shards = [Input(s.path, s.sha256) for s in artifact.one(ShardIndex).shards]
        return artifact.provenance.inputs, shards


def _compared(entry: Input, folder: Path, by: Path, digest: Callable[[Path], str]) -> Finding:
    path = folder / entry.path
    if not path.resolve().is_relative_to(folder.resolve()):
        return Finding(path, f"{by.name} names it, and it leads out of {folder}")
    if not path.is_file():
        return Finding(path, f"missing, though {by.name} was made from it")
    if (found := digest(path)) != entry.sha256:
        return Finding(
            path,
            f"changed since {by.name} was made: SHA-256 was {entry.sha256[:12]}, "
            f"is {found[:12]}; make {by.name} again",
        )
    return Finding(path)
