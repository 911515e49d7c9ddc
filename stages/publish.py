"""`make publish`: a run's dataset as a folder for a dataset hub or an archive.

In ``runs/<run>/publish``: all shards, a Parquet preview, the catalogue, the recording of the
samples, a card with the licence, Croissant metadata, loading examples, checksums written last.
"""

import json
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.artifacts import package_version, publish_bytes, read_provenance
from pipeline.artifacts.checksums import SUMS, write_checksums
from pipeline.artifacts.sharding import listed_shards
from pipeline.config import load_run_config
from pipeline.errors import ArtifactError, MachineError
from pipeline.execution import RunFolder, run_command
from pipeline.housekeeping.listing import disk_use_bytes, size_in_words
from pipeline.interchange.croissant import croissant_metadata
from pipeline.interchange.hub import (
    EXAMPLES,
    PREVIEW,
    PREVIEW_SAMPLE_BYTES,
    check_room,
    copy_files,
    not_there,
    remove_former,
    write_examples,
    write_preview,
)
from pipeline.network.samples import SPLITS
from pipeline.reporting.facts import read_catalogue, read_summary
from pipeline.reporting.page import markdown_page
from pipeline.reporting.words import describe_meshes
from stages.graph import RUNS_DIR

NAME = "publish"
PUBLISHED = ("objects.mcap", "shards.mcap", "shards.rrd")


def publish_run(folder: RunFolder, into: Path) -> int:
    """Write the folder.

    Parameters
    ----------
    folder
        The run.
    into
        The folder that is written; files in it that are already right stay.

    Returns
    -------
    How many files its list of checksums names.

    Raises
    ------
    ArtifactError
        The dataset was not made.
    MachineError
        The disk is too small, or mlcroissant is not installed.
    """
    run = folder.path.name
    missing = [name for name in PUBLISHED if not (folder.path / name).is_file()]
    if missing:
        raise ArtifactError(
            f"{folder.path / missing[0]} is missing", f"Make it first: make dataset RUN={run}"
        )
    config = load_run_config(folder.config)
    shards = listed_shards(folder.artifact("shards"))
    files = [folder.path / name for name in PUBLISHED] + shards
    pairs = [(path, into / path.relative_to(folder.path)) for path in files]
    splits = [one for one in SPLITS if listed_shards(folder.artifact("shards"), [one])]
    rows = config.dataset.preview_samples
    lacking = not_there(pairs)
    size = sum(disk_use_bytes(source) for source, _ in lacking)
    check_room(into, size + len(splits) * rows * PREVIEW_SAMPLE_BYTES)
    (into / SUMS).unlink(missing_ok=True)
    copy_files(lacking)
    preview = {split: into / PREVIEW / f"{split}.parquet" for split in splits}
    remove_former(into, {target for _, target in pairs} | set(preview.values()))
    counts = {
        split: write_preview(folder.artifact("shards"), split, path, rows)
        for split, path in preview.items()
    }
    write_examples(into)
    catalogue = read_catalogue(folder.artifact("objects"))
    meshes, licence, licence_text = describe_meshes(folder, config, catalogue)
    samples = (read_summary(folder.summary("shards")) or {}).get("samples", {})
    title = config.dataset.title or f"softgrip, run {run}"
    headline = (
        f"{sum(samples.values())} grasps of a soft vacuum gripper on "
        f"{len(catalogue.objects)} objects in clutter, each with its quality and what a depth "
        "camera saw of it."
    )
    facts = {
        "title": title,
        "headline": headline,
        "objects": len(catalogue.objects),
        "splits": dict(Counter(item.split for item in catalogue.objects)),
        "samples": samples,
        "preview": counts,
        "meshes": meshes,
        "licence": licence,
        "licence_text": licence_text,
        "version": package_version(),
        "key": read_provenance(folder.artifact("shards")).key,
        "examples": EXAMPLES,
    }
    publish_bytes(into / "README.md", markdown_page("card.md.jinja", facts).encode())
    publish_bytes(into / "LICENSE", f"{meshes}\n{licence}\n\n{licence_text}".encode())
    try:
        metadata = croissant_metadata(
            into, preview, title, headline, licence, config.dataset.version
        )
    except ModuleNotFoundError as error:
        raise MachineError(
            f"Croissant metadata needs the package {error.name}, which is not installed",
            "Install it: pip install -c constraints.txt -e '.[export]'",
        ) from error
    publish_bytes(into / "croissant.json", (json.dumps(metadata, indent=1) + "\n").encode())
    return write_checksums(into)


def publish(
    run: Annotated[str, typer.Option(envvar="RUN", help="name of the run")] = "default",
    into: Annotated[Path | None, typer.Option(help="folder; else runs/<run>/publish")] = None,
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
) -> None:
    """Write a run's dataset as a folder that a dataset hub or an archive takes."""
    folder = RunFolder(runs_dir / run)
    target = into or folder.path / NAME
    count = publish_run(folder, target)
    logger.info("publish: {}, {} files, {}", target, count, size_in_words(disk_use_bytes(target)))


if __name__ == "__main__":
    run_command(publish)
