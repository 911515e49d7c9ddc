"""About how long a make will take and how much disk, from what the same stages took before."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pipeline.artifacts import read_provenance
from pipeline.config import RunConfig
from pipeline.errors import ArtifactError
from pipeline.execution.running import read_summary
from pipeline.execution.stage import RunFolder
from pipeline.housekeeping.listing import MESHES, as_table, disk_use_bytes, size_in_words

MINUTE_S, HOUR_S = 60.0, 3600.0  # an hour has 60 minutes of 60 seconds


@dataclass(frozen=True)
class Taken:
    """What a stage took in a run, and how much work it was.

    Attributes
    ----------
    run
        Name of the run.
    units
        How much work its artifact is [units of `work_of`].
    made
        How much of it was made, and not taken over from an earlier artifact [the same].
    wall_time_s
        Wall time [s].
    size_bytes
        Artifact, shards and recording [bytes].
    """

    run: str
    units: float
    made: float
    wall_time_s: float
    size_bytes: int


@dataclass(frozen=True)
class Forecast:
    """What one stage will do.

    Attributes
    ----------
    stage
        Its name.
    reason
        Why it is made.
    wall_time_s
        About how long [s]; None where no run tells.
    size_bytes
        About how much disk [bytes]; None where no run tells.
    told_by
        The run whose figures were scaled; empty where none tells.
    """

    stage: str
    reason: str
    wall_time_s: float | None = None
    size_bytes: float | None = None
    told_by: str = ""


def work_of(
    stage: str, config: RunConfig, sources: int, further: Sequence[RunConfig] = ()
) -> float:
    """How much work a stage will be, by its configuration.

    Parameters
    ----------
    stage
        Name of the stage.
    config
        The run's configuration.
    sources
        Meshes and embedded objects that stage objects reads.
    further
        Configurations of the runs that ``train.further_runs`` names.

    Returns
    -------
    Objects [objects], clutters [scenes], grasps or samples [grasps, shards], samples times epochs
    [train], clutters times policies, of the contest and of each scale of the curve [evaluate].
    """
    per_level = config.scenes.clutters_per_level
    clutters = {split: getattr(per_level, split) for split in config.scenes.splits}
    levels = len(config.scenes.levels)
    grasps = sum(map(sum, config.grasps.of_scenes(max(levels * sum(clutters.values()), 1))))
    if stage == "objects":
        trained = 1 - config.split.val_fraction - config.split.test_fraction
        each = 1 + trained * config.objects.stretched_copies
        return (sources + config.objects.random_solids) * each
    if stage == "scenes":
        return float(levels * sum(clutters.values()))
    if stage in ("shards", "train"):
        share = clutters.get("train", 0) / max(sum(clutters.values()), 1)
        samples: float = grasps * (1 + share * (config.grasps.noise_draws - 1))
        if stage == "shards":
            return samples
        learnt = samples + sum(work_of("shards", other, sources) for other in further)
        return learnt * config.train.epochs
    if stage == "evaluate":
        picked = clutters.get(config.evaluate.split, 0)
        robot = config.evaluate.imperfection
        again = min(picked, robot.curve_clutters) * len(robot.curve_policies) * len(robot.curve)
        return float(levels * (picked * len(config.evaluate.policies) + again))
    return float(grasps)


def work_done(stage: str, summary: dict[str, Any]) -> float:
    """How much work a stage was, by its summary; in the units of `work_of`, 0 where untold."""
    if stage in ("objects", "scenes", "grasps"):
        return float(summary.get(stage, 0))
    samples = float(sum(_counts(summary.get("samples"))))
    if stage == "shards":
        return samples
    if stage == "train":
        return samples * float(summary.get("epochs", 0))
    groups = [summary.get("policies", {}), *summary.get("imperfection", {}).values()]
    return float(sum(found.get("clutters", 0) for group in groups for found in group.values()))


def share_made(summary: dict[str, Any]) -> float:
    """Share of a stage's items that were made, and not taken over [1]; 1 where it is not told."""
    made, kept = float(summary.get("made", 0)), float(summary.get("taken_over", 0))
    return made / (made + kept) if made + kept > 0 else 1.0


def _counts(value: object) -> list[float]:
    """The numbers within a summary's entry, whatever it is grouped by."""
    if isinstance(value, dict):
        return [number for inner in value.values() for number in _counts(inner)]
    return [float(value)] if isinstance(value, int | float) else []


def taken_by(folder: RunFolder, stage: str, config: RunConfig, scans: bool) -> Taken | None:
    """What a stage took in a run; None where it was not made, or is of another kind.

    Parameters
    ----------
    folder
        The run that may tell.
    stage
        Name of the stage.
    config
        Configuration of the run to be made: one network takes many times as long as another.
    scans
        Whether the run to be made reads a folder of meshes: a scan takes several times as long to
        be repaired and cut into convex parts as an embedded object.

    Returns
    -------
    Work, time and disk.
    """
    summary = read_summary(folder, stage)
    units = work_done(stage, summary) if summary else 0.0
    made = units * share_made(summary)
    if made <= 0 or not folder.artifact(stage).is_file():
        return None
    if stage == "train" and (
        summary.get("layers") != config.network.layers
        or summary.get("channels") != list(config.network.channels)
    ):
        return None
    if stage == "objects" and scans != reads_scans(folder):
        return None
    files = (folder.artifact(stage), folder.shards(stage), folder.recording(stage))
    size = sum(map(disk_use_bytes, files))
    return Taken(folder.path.name, units, made, float(summary["wall_time_s"]), size)


def reads_scans(folder: RunFolder) -> bool:
    """Whether the objects of a run are of a folder of meshes; False where that cannot be read."""
    try:
        inputs = read_provenance(folder.artifact("objects")).inputs
    except ArtifactError:
        return False
    return any(used.path.startswith(MESHES) for used in inputs)


def forecast(
    stage: str,
    reason: str,
    config: RunConfig,
    sources: int,
    others: Sequence[RunFolder],
    kept: float = 0.0,
    scans: bool = False,
    further: Sequence[RunConfig] = (),
) -> Forecast:
    """Scale what the run of most equal work took; of objects, the run that was slowest on each.

    Convex parts are kept beside all runs, and a run that found its own there took little time.

    Parameters
    ----------
    stage
        Name of the stage.
    reason
        Why it is made.
    config
        The run's configuration.
    sources
        Meshes and embedded objects that stage objects reads.
    others
        Runs that may tell; the run itself, made earlier, among them.
    kept
        How much of the work is there already and is taken over [units of `work_of`].
    scans
        Whether the run reads a folder of meshes.
    further
        Configurations of the runs that ``train.further_runs`` names.

    Returns
    -------
    Time, proportional to the work that is left, and disk, to all of it; none where no run tells.
    """
    units = work_of(stage, config, sources, further)
    new = max(units - kept, 0.0)
    reason = in_short(reason)
    if kept > 0:
        reason += f"; {min(kept, units):.0f} of {units:.0f} {stage} are taken over"
    told = [taken for folder in others if (taken := taken_by(folder, stage, config, scans))]
    if not told or units <= 0:
        return Forecast(stage, reason)
    if stage == "objects":
        nearest = max(told, key=lambda taken: taken.wall_time_s / taken.made)
    else:
        nearest = min(told, key=lambda taken: abs(math.log(taken.made / (new or units))))
    time_s = nearest.wall_time_s * new / nearest.made
    return Forecast(stage, reason, time_s, nearest.size_bytes * units / nearest.units, nearest.run)


def in_short(reason: str) -> str:
    """The first of many reasons, and how many more there are."""
    first, *more = reason.split("; ")
    return f"{first}, and {len(more)} more reasons" if len(more) > 1 else reason


def duration_in_words(seconds: float) -> str:
    """A duration as «40 s», «12 min» or «3.5 h»."""
    if seconds < 2 * MINUTE_S:
        return f"{seconds:.0f} s"
    if seconds < 2 * HOUR_S:
        return f"{seconds / MINUTE_S:.0f} min"
    return f"{seconds / HOUR_S:.1f} h"


def as_lines(forecasts: Sequence[Forecast], free_bytes: int) -> list[str]:
    """Say what a make will do: a line a stage, the sum, and whether the disk is large enough.

    Parameters
    ----------
    forecasts
        The stages that are made.
    free_bytes
        Free disk [bytes].

    Returns
    -------
    Lines to read; one alone where nothing is made.
    """
    if not forecasts:
        return ["nothing to make: all is up to date"]
    rows = [["stage", "why", "about", "disk", "told by"]]
    for one in forecasts:
        time = "not known" if one.wall_time_s is None else duration_in_words(one.wall_time_s)
        disk = "not known" if one.size_bytes is None else size_in_words(one.size_bytes)
        told = f"run {one.told_by}" if one.told_by else "no run yet"
        rows.append([one.stage, one.reason, time, disk, told])
    time_s, size = total_s(forecasts), sum(one.size_bytes or 0.0 for one in forecasts)
    at_least = "" if all(one.told_by for one in forecasts) else "at least "
    lines = as_table(rows).splitlines()
    lines.append(
        f"in all {at_least}about {duration_in_words(time_s)} and {size_in_words(size)}; "
        f"{size_in_words(free_bytes)} of disk are free"
    )
    if size > free_bytes:
        lines.append("The disk is too small: free some ('make prune' shows what can go)")
    return lines


def total_s(forecasts: Sequence[Forecast]) -> float:
    """Wall time of all stages whose time is known [s]."""
    return sum(one.wall_time_s or 0.0 for one in forecasts)
