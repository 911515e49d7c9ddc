"""`make export`: a run's dataset in a format that other grasp-learning code already loads."""

import json
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.artifacts import package_version, publish_bytes, read_provenance
from pipeline.artifacts.sharding import listed_shards
from pipeline.config import load_run_config
from pipeline.config.evaluation import PolicyName
from pipeline.errors import ArtifactError, MachineError
from pipeline.execution import RunFolder, progress, run_command
from pipeline.interchange.graspgen import write_graspgen, write_lists
from pipeline.interchange.parquet_shards import write_parquet
from pipeline.interchange.reading import grasps_by_object, read_shard
from pipeline.interchange.scene_exports import export_bop, export_usd
from pipeline.network.samples import SPLITS
from stages.graph import RUNS_DIR

MANIFEST = "manifest.json"
CLOSED_LOOP: PolicyName = "closed-loop"  # whose attempts are episodes


class Format(StrEnum):
    """What a run can be exported to."""

    ACRONYM = "acronym"
    GRASPGEN = "graspgen"
    WEBDATASET = "webdataset"
    PARQUET = "parquet"
    BOP = "bop"
    USD = "usd"
    LEROBOT = "lerobot"


class Counted(StrEnum):
    """What a manifest counts."""

    GRASPS = "grasps"
    SAMPLES = "samples"
    PICTURES = "pictures"
    SCENES = "scenes"
    FRAMES = "frames"


FROM = {  # format → artifact that is exported, and what is counted
    Format.ACRONYM: ("grasps", Counted.GRASPS),
    Format.GRASPGEN: ("grasps", Counted.GRASPS),
    Format.WEBDATASET: ("shards", Counted.SAMPLES),
    Format.PARQUET: ("shards", Counted.SAMPLES),
    Format.BOP: ("scenes", Counted.PICTURES),
    Format.USD: ("grasps", Counted.SCENES),
    Format.LEROBOT: ("evaluate", Counted.FRAMES),
}


def export_run(folder: RunFolder, wanted: Format, least_quality: float) -> Path:
    """Write ``<run>/export/<format>/``, its manifest last.

    Parameters
    ----------
    folder
        The run.
    wanted
        Format that is written.
    least_quality
        q from which a grasp counts as a success in formats that know only two.

    Returns
    -------
    The folder that was written.

    Raises
    ------
    ArtifactError
        What is to be exported was not made yet.
    MachineError
        The package that writes the format is not installed.
    """
    of_objects = wanted in (Format.ACRONYM, Format.GRASPGEN)
    stage, counted = FROM[wanted]
    source = folder.artifact(stage)
    if not source.is_file():
        name, goal = folder.path.name, "eval" if stage == "evaluate" else "dataset"
        raise ArtifactError(f"{source} is missing", f"Make it first: make {goal} RUN={name}")
    into = folder.path / "export" / wanted
    (into / MANIFEST).unlink(missing_ok=True)
    try:
        if of_objects:
            count = export_grasps(folder, into, wanted, least_quality)
        elif wanted in (Format.BOP, Format.USD):
            count = export_scenes(folder, into, wanted)
        elif wanted is Format.LEROBOT:
            count = export_episodes(folder, source, into)
        else:
            count = export_samples(source, into, wanted)
    except ModuleNotFoundError as error:
        raise MachineError(
            f"Format {wanted} needs the package {error.name}, which is not installed",
            "Install it: pip install -c constraints.txt -e '.[export]'",
        ) from error
    manifest = {
        "format": str(wanted),
        str(counted): count,
        "source": {source.name: read_provenance(source).key},
        "softgrip": package_version(),
    }
    if of_objects:
        manifest["success"] = f"q >= {least_quality}"
        manifest["frame"] = "origin at the pad's centre at first touch, +z along the approach"
    publish_bytes(into / MANIFEST, (json.dumps(manifest, indent=2) + "\n").encode())
    return into


def export_grasps(folder: RunFolder, into: Path, wanted: Format, least_quality: float) -> int:
    """One file an object; how many grasps."""
    write = partial(write_graspgen, into, least_quality=least_quality)
    if wanted is Format.ACRONYM:
        from pipeline.interchange.acronym import write_acronym  # h5py is an extra

        friction = load_run_config(folder.config).gripper.friction
        write = partial(write_acronym, into, least_quality=least_quality, friction=friction)
    found = grasps_by_object(
        folder.artifact("objects"), folder.artifact("scenes"), folder.artifact("grasps")
    )
    for grasps in progress(found, len(found), f"export: {wanted}", "object"):
        write(grasps)
    if wanted is Format.GRASPGEN:
        write_lists(into, [(grasps.item.name, grasps.split) for grasps in found])
    return sum(map(len, found))


def export_scenes(folder: RunFolder, into: Path, wanted: Format) -> int:
    """A folder or a file a scene; how many pictures, or scenes."""
    objects, scenes = folder.artifact("objects"), folder.artifact("scenes")
    if wanted is Format.BOP:
        return export_bop(objects, scenes, into)
    config = load_run_config(folder.config)
    radius_m, side_m = config.gripper.pad.radius_m, config.scenes.table_side_m
    return export_usd(objects, scenes, folder.artifact("grasps"), into, radius_m, side_m)


def export_episodes(folder: RunFolder, source: Path, into: Path) -> int:
    """An episode an attempt of the closed loop; how many frames."""
    from pipeline.interchange.episodes import read_episodes  # PyAV is an extra
    from pipeline.interchange.lerobot import write_lerobot

    fps = round(load_run_config(folder.config).evaluate.policy.rate_hz)
    return write_lerobot(into, read_episodes(source, CLOSED_LOOP), fps)


def export_samples(source: Path, into: Path, wanted: Format) -> int:
    """One file a shard, named by split; how many samples."""
    write, suffix = write_parquet, ".parquet"
    if wanted is Format.WEBDATASET:
        from pipeline.interchange.tar_shards import write_webdataset  # webdataset is an extra

        write, suffix = write_webdataset, ".tar"
    total = 0
    for split in SPLITS:
        shards = listed_shards(source, [split])
        first = 0
        for number, shard in enumerate(progress(shards, len(shards), f"export: {split}", "shard")):
            samples, names = read_shard(shard)
            write(into / f"{split}-{number:06d}{suffix}", samples, names, f"{split}-", first)
            first += len(samples)
        total += first
    return total


def export(
    wanted: Annotated[Format, typer.Option("--format", envvar="FORMAT", help="which format")],
    run: Annotated[str, typer.Option(envvar="RUN", help="name of the run")] = "default",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
    success_quality: Annotated[
        float, typer.Option(min=0, max=1, help="q from which on a grasp counts as a success")
    ] = 0.5,
) -> None:
    """Write a run's dataset in another format, to runs/<run>/export/<format>/."""
    into = export_run(RunFolder(runs_dir / run), wanted, success_quality)
    logger.info("export: {}", into)


if __name__ == "__main__":
    run_command(export)
