"""The runs of a folder: size, stages, headline figures, origin."""

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.artifacts import read_provenance
from pipeline.errors import ArtifactError
from pipeline.execution.running import read_summary
from pipeline.execution.sealing import is_sealed
from pipeline.execution.stage import RunFolder

RUN_FILE = "run.toml"
DEEPEST = 3  # levels, as in runs/paper/folds/fold-0
EMBEDDED = "embedded objects"
MESHES = "meshes/"  # before the name of each mesh file in a provenance
TEST_ERROR, SUCCESS = "test |e|", "success"
KILO = 1000.0  # the prefix of kB over that of B


@dataclass(frozen=True)
class RunFacts:
    """One run as the list shows it.

    Attributes
    ----------
    name
        Its folder within the folder of runs; "paper/holdout" for a run within a run.
    size_bytes
        What its files take on disk, runs within it included [bytes].
    made
        Stages whose artifact is there, in the order of the pipeline.
    headline
        Figure → value, from the summaries; only figures that are there.
    made_from
        The mesh folder, or the embedded objects, and the network that was given to it.
    sealed
        Whether it is sealed.
    """

    name: str
    size_bytes: int
    made: tuple[str, ...]
    headline: dict[str, float]
    made_from: str
    sealed: bool


def run_folders(runs_dir: Path) -> Iterator[RunFolder]:
    """Every folder with a run.toml, runs within runs after the run that they lie in."""
    yield from _runs_within(runs_dir, DEEPEST)


def _runs_within(place: Path, levels: int) -> Iterator[RunFolder]:
    if levels == 0 or not place.is_dir():
        return
    for path in sorted(place.iterdir()):
        if path.is_symlink() or not path.is_dir() or path.name.startswith("."):
            continue
        if (path / RUN_FILE).is_file():
            yield RunFolder(path)
        yield from _runs_within(path, levels - 1)


def facts_of(folder: RunFolder, runs_dir: Path, stages: tuple[str, ...]) -> RunFacts:
    """Read what the list shows of a run.

    Parameters
    ----------
    folder
        The run.
    runs_dir
        Folder of all runs.
    stages
        Names of all stages, in the order of the pipeline.

    Returns
    -------
    Its facts; a damaged summary gives no figures.
    """
    return RunFacts(
        name=folder.path.relative_to(runs_dir).as_posix(),
        size_bytes=disk_use_bytes(folder.path),
        made=tuple(name for name in stages if folder.artifact(name).is_file()),
        headline=headline_figures(folder),
        made_from=origin(folder),
        sealed=is_sealed(folder),
    )


def disk_use_bytes(path: Path) -> int:
    """What a file, or all files of a folder, hold [bytes]; 0 where there is nothing."""
    if path.is_file():
        return path.stat().st_size
    return sum(_size_bytes(file) for file in path.rglob("*"))


def free_disk_bytes(folder: RunFolder) -> int:
    """Free bytes where a run lies."""
    return shutil.disk_usage(folder.path if folder.path.is_dir() else Path()).free


def _size_bytes(file: Path) -> int:
    try:
        return file.lstat().st_size if file.is_file() else 0
    except FileNotFoundError:  # a run that is being made
        return 0


def headline_figures(folder: RunFolder) -> dict[str, float]:
    """Objects, scenes, grasps, test error with one prediction, success of the closed loop.

    Parameters
    ----------
    folder
        The run.

    Returns
    -------
    Figure → value; counts as they are, errors and shares in [0, 1].
    """
    figures: dict[str, Any] = {}
    for figure, stage in (("objects", "objects"), ("scenes", "scenes"), ("grasps", "grasps")):
        figures[figure] = read_summary(folder, stage).get(stage)
    figures[TEST_ERROR] = read_summary(folder, "train").get("test_mae_single")
    policies = read_summary(folder, "evaluate").get("policies")
    if isinstance(policies, dict) and policies:
        figures[SUCCESS] = next(iter(policies.values())).get("rate")  # the first is judged
    return {name: float(f) for name, f in figures.items() if isinstance(f, int | float)}


def origin(folder: RunFolder) -> str:
    """What a run's objects and network came from, in words; a run without artifacts has none."""
    if not folder.artifact("objects").is_file():
        return ""
    given = read_summary(folder, "holdout").get("network")
    return str(folder.noted_mesh_dir or _recorded(folder.artifact("objects"))) + (
        f"; network {given}" if isinstance(given, str) else ""
    )


def _recorded(objects: Path) -> str:
    """What a file of objects says that it was made from: Make notes a folder, and no one else."""
    try:
        inputs = read_provenance(objects).inputs
    except ArtifactError:
        return "damaged objects"
    meshes = sum(used.path.startswith(MESHES) for used in inputs)
    return f"{meshes} mesh files" if meshes else EMBEDDED


def size_in_words(size_bytes: float) -> str:
    """A size with three digits and its unit, as «1.23 GB»."""
    size, units = float(size_bytes), ["B", "kB", "MB", "GB"]
    while size >= KILO and len(units) > 1:
        size /= KILO
        units.pop(0)
    return f"{size:.3g} {units[0]}"


def as_table(rows: list[list[str]]) -> str:
    """Lines with columns of equal width; the first row is the head."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(f"{c:<{w}}" for c, w in zip(row, widths, strict=True)) for row in rows]
    return "\n".join(line.rstrip() for line in lines) + "\n"
