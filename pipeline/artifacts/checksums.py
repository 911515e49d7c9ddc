"""SHA256SUMS of a folder that is handed on, in the form that `sha256sum -c` reads."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from pipeline.artifacts.inspection import Finding
from pipeline.artifacts.publishing import file_sha256, publish_bytes
from pipeline.errors import ArtifactError

SUMS = "SHA256SUMS"
DIGITS = 64  # hexadecimal, of a SHA-256


def write_checksums(folder: Path) -> int:
    """Record the digest of every file of a folder; how many there are."""
    files = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.name != SUMS]
    lines = [f"{file_sha256(path)}  {path.relative_to(folder).as_posix()}\n" for path in files]
    publish_bytes(folder / SUMS, "".join(lines).encode())
    return len(files)


def read_checksums(folder: Path) -> dict[str, str]:
    """File → recorded digest.

    Parameters
    ----------
    folder
        A folder that was handed on.

    Returns
    -------
    The digests, in the order of the list.

    Raises
    ------
    ArtifactError
        The list is missing or damaged, or names a file outside the folder.
    """
    path = folder / SUMS
    if not path.is_file():
        raise ArtifactError(
            f"{folder} has no {SUMS}", "Name an .mcap, or a folder that make publish wrote"
        )
    found = {}
    for line in path.read_text(errors="replace").splitlines():
        digest, _, name = line.partition("  ")
        inside = (folder / name).resolve().is_relative_to(folder.resolve())
        if len(digest) != DIGITS or set(digest) - set("0123456789abcdef") or not name or not inside:
            raise ArtifactError(f"{path} is damaged at '{line[:80]}'", "Fetch the folder again")
        found[name] = digest
    return found


def compare_digests(folder: Path, recorded: Mapping[str, str]) -> Iterator[Finding]:
    """Compare files of a folder with their recorded digests.

    Parameters
    ----------
    folder
        The folder.
    recorded
        File below it → SHA-256 of what it held.

    Yields
    ------
    Finding
        One for each file, in the order given.
    """
    for name, digest in recorded.items():
        path = folder / name
        if not path.is_file():
            yield Finding(path, "missing")
        elif (found := file_sha256(path)) != digest:
            yield Finding(path, f"changed: SHA-256 was {digest[:12]}, is {found[:12]}")
        else:
            yield Finding(path)


def verify_folder(folder: Path) -> Iterator[Finding]:
    """Compare every file of a folder with its list of digests.

    Parameters
    ----------
    folder
        A folder that was handed on.

    Yields
    ------
    Finding
        One for each file of the list, then one for each file that the list does not name.

    Raises
    ------
    ArtifactError
        The list is missing or damaged.
    """
    recorded = read_checksums(folder)
    yield from compare_digests(folder, recorded)
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and path.name != SUMS and name not in recorded:
            yield Finding(path, f"not in {SUMS}")
