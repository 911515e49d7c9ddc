"""Stage 4, shards: labelled grasps → shuffled train, val and test shards, split by object.

Samples are shuffled in two passes (pipeline/network/shuffling), each in as many processes as there
are: first grasps are scattered to parts, then each part is permuted and becomes some shards. Who
writes a part writes its rows for `make query` too, so that the check reads no sample back.
"""

import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.artifacts.room import require_room
from pipeline.artifacts.sharding import is_current, write_index
from pipeline.asking.cache import QUERY_CACHE, keep_rows
from pipeline.errors import ArtifactError
from pipeline.execution import StageContext, Summary, progress, run_in_order, stage_command
from pipeline.execution.shuffle_plan import Part, ShufflePlan, plan_shuffle
from pipeline.execution.shuffling import Gathered, GatherJob, ScatterJob, gather, scatter_group
from pipeline.messages.samples import object_names_in
from pipeline.network.samples import SPLITS
from stages.graph import SHARDS, inputs_of


def build(stage: StageContext) -> Summary:
    """Shuffle the labelled grasps across scenes and write them as training shards."""
    plan = plan_shuffle(stage.config, stage.upstream("grasps"), stage.shards)
    for split in SPLITS:
        if not any(part.split == split for part in plan.parts):
            raise ArtifactError(
                f"There is no grasp of the {split} split in {stage.upstream('grasps')}",
                f"Give scenes.clutters_per_level.{split} at least one clutter",
            )
    workers = min(stage.workers, len(plan.groups))  # a small run is done before another starts
    names = scatter(stage, plan, workers)
    jobs = [
        GatherJob(
            part,
            tuple(files_of(stage, part).values()),
            names,
            stage.config,
            stage.provenance(),
            stage.output.parent,
            scattered(stage) / f"{part.number:05d}.arrow",
        )
        for part in plan.parts
    ]
    limit_s, store = stage.item_limit_s, stage.store
    done = run_in_order(gather, jobs, workers, stage.executor, limit_s=limit_s, store=store)
    gathered = list(progress(done, len(jobs), "shards: permuting", "part"))
    entries = [entry for found in gathered for entry in found.entries]
    histogram = np.sum([found.quality for found in gathered], axis=0)
    write_index(stage.output, stage.provenance(), entries, histogram)
    rows = [job.rows for job in jobs]
    with stage.checking.running():
        keep_rows("samples", stage.output, stage.folder.state(QUERY_CACHE), rows)
    stage.checking.seconds += sum(found.rows_s for found in gathered)
    shutil.rmtree(scattered(stage).parent)
    if store is not None:
        store.discard(scattered(stage).parent)
    return summary(plan.parts, gathered, names)


def scatter(stage: StageContext, plan: ShufflePlan, workers: int) -> tuple[str, ...]:
    """Send the grasps to their parts, but those that are shards already; the objects' names."""
    key = stage.key.digest
    folder = scattered(stage)
    for other in folder.parent.glob("*"):
        if other != folder:
            shutil.rmtree(other)  # of an interrupted shuffle of other grasps
    folder.mkdir(parents=True, exist_ok=True)
    shards = [shard for part in plan.parts for shard in part.shards]
    named = next((shard for shard in shards if is_current(shard, key)), None)
    todo = [part for part in plan.parts if not all(is_current(s, key) for s in part.shards)]
    files = {part.number: files_of(stage, part) for part in todo}
    jobs = [
        ScatterJob(
            sources,
            {part: of_group[at] for part, of_group in files.items() if at in of_group},
            stage.config,
            stage.provenance(),
        )
        for at, sources in enumerate(plan.groups)
    ]
    missing = [job for job in jobs if not all(is_current(p, key) for p in job.files.values())]
    grasps_bytes = sum(s.path.stat().st_size for job in missing for s in job.sources)
    at_once = min(1.0, workers / len(plan.parts)) if stage.executor == "local" else 1.0
    require_room(folder, int(grasps_bytes * (1 + at_once)), "Shuffling")
    done = run_in_order(
        scatter_group,
        jobs,
        workers,
        stage.executor,
        limit_s=stage.item_limit_s,
        store=stage.store,
        bring=False,  # gathered from the store
    )
    found = list(progress(done, len(jobs), "shards: reading grasps", "group"))
    # Whatever one shard names, all do: names are known before the first is written.
    return object_names_in(named) if named else tuple(dict.fromkeys(n for f in found for n in f))


def scattered(stage: StageContext) -> Path:
    """Folder of the first pass's files, for as long as the stage is not finished."""
    return stage.folder.state(stage.name) / stage.key.digest[:16]


def files_of(stage: StageContext, part: Part) -> dict[int, Path]:
    """Group → the file in which it sends samples to a part, where it sends any."""
    folder = scattered(stage) / f"{part.number:05d}"
    return {at: folder / f"{at:05d}.mcap" for at, count in enumerate(part.counts) if count}


def summary(parts: Sequence[Part], gathered: Sequence[Gathered], names: Sequence[str]) -> Summary:
    """The stage's headline figures."""
    of = {
        split: [g for p, g in zip(parts, gathered, strict=True) if p.split == split]
        for split in SPLITS
    }
    quality = {split: np.sum([g.quality for g in found], axis=0) for split, found in of.items()}
    seen = {
        split: sum(g.seen for g in found) / sum(g.cells for g in found)
        for split, found in of.items()
    }
    return {
        "samples": {split: int(counts.sum()) for split, counts in quality.items()},
        "shards": {split: sum(len(g.entries) for g in found) for split, found in of.items()},
        "objects": len(names),
        "quality_histogram": {split: counts.tolist() for split, counts in quality.items()},
        "seen_cells": {split: round(share, 4) for split, share in seen.items()},
        "empty_clouds": {split: sum(g.empty for g in found) for split, found in of.items()},
    }


if __name__ == "__main__":
    from pipeline.recording.shards import draw_shards  # not in workers: they draw nothing

    stage_command(SHARDS, build, inputs_of, draw=draw_shards)
