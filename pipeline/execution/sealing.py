"""A sealed run is finished: it stays usable on another machine or with another softgrip.

The seal lists every file of the run with its digest. While it is there, no goal makes a file of
the run anew, whatever changed in code, packages or meshes; readers read the files as they are.
"""

import json
from dataclasses import dataclass
from pathlib import Path

from pipeline.artifacts import package_version, publish_bytes
from pipeline.artifacts.checksums import compare_digests
from pipeline.artifacts.publishing import file_sha256
from pipeline.errors import ArtifactError
from pipeline.execution.stage import RunFolder

SEAL = "seal.json"
KEPT_APART = (".state", "logs")  # bookkeeping and logs are no results


@dataclass(frozen=True)
class Seal:
    """What a run's seal records.

    Attributes
    ----------
    softgrip
        Version that sealed it.
    files
        File of the run → SHA-256 of its content.
    """

    softgrip: str
    files: dict[str, str]


def seal_path(folder: RunFolder) -> Path:
    """The file that seals a run."""
    return folder.path / SEAL


def is_sealed(folder: RunFolder) -> bool:
    """Whether a run is sealed."""
    return seal_path(folder).is_file()


def seal(folder: RunFolder) -> Seal:
    """Seal a run: record all its files.

    Parameters
    ----------
    folder
        The run.

    Returns
    -------
    What was recorded.

    Raises
    ------
    ArtifactError
        The run holds no artifact.
    """
    files = {
        path.relative_to(folder.path).as_posix(): file_sha256(path) for path in result_files(folder)
    }
    if not any(name.endswith(".mcap") for name in files):
        raise ArtifactError(
            f"{folder.path} holds no artifact, and there is nothing to seal",
            f"Make it first: make dataset RUN={folder.path.name}",
        )
    made = Seal(package_version(), files)
    text = json.dumps({"softgrip": made.softgrip, "files": files}, indent=1, sort_keys=True)
    publish_bytes(seal_path(folder), (text + "\n").encode())
    return made


def read_seal(folder: RunFolder) -> Seal:
    """Read a run's seal.

    Parameters
    ----------
    folder
        The run.

    Returns
    -------
    What it records.

    Raises
    ------
    ArtifactError
        The seal is missing or damaged.
    """
    path = seal_path(folder)
    try:
        found = json.loads(path.read_text())
        files = found["files"]
        if not all(isinstance(text, str) for pair in files.items() for text in pair):
            raise TypeError("a digest is no text")
        return Seal(str(found["softgrip"]), dict(files))
    except FileNotFoundError as error:
        name = folder.path.name
        raise ArtifactError(f"{folder.path} is not sealed", f"make seal RUN={name}") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ArtifactError(
            f"{path} is damaged ({error})", "Copy the run again from where it was sealed"
        ) from error


def broken_files(folder: RunFolder) -> list[str]:
    """Say what differs from the seal, one sentence a file; empty where nothing does.

    Parameters
    ----------
    folder
        The run.

    Returns
    -------
    A sentence for each file that is missing or changed.

    Raises
    ------
    ArtifactError
        The seal is missing or damaged.
    """
    recorded = dict(sorted(read_seal(folder).files.items()))
    findings = compare_digests(folder.path, recorded)
    return [f"{found.path}: {found.problem}" for found in findings if found.problem]


def unseal(folder: RunFolder) -> None:
    """Take the seal off, so that the run is made anew where it is stale."""
    read_seal(folder)
    seal_path(folder).unlink()


def result_files(folder: RunFolder) -> list[Path]:
    """Every file of a run but its bookkeeping, its logs and its seal; a run within it counts."""
    found = []
    for path in sorted(folder.path.rglob("*")):
        parts = path.relative_to(folder.path).parts
        if path.is_file() and path.name != SEAL and not set(parts) & set(KEPT_APART):
            found.append(path)
    return found


def refuse_sealed(folder: RunFolder) -> None:
    """Refuse to make anything in a sealed run.

    Parameters
    ----------
    folder
        The run.

    Raises
    ------
    ArtifactError
        The run, or the run that it lies in, is sealed.
    """
    for place in (folder, RunFolder(folder.path.parent)):
        if is_sealed(place):
            name = place.path.name
            raise ArtifactError(
                f"{place.path} is sealed, and stays as it is",
                f"Take another RUN, or take the seal off: make unseal RUN={name}",
            )
