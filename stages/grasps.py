"""Stage 3, grasps: scenes → labelled grasps, Algorithm 1 of the supplement.

Assumptions: A-1 quasi-static physics with Coulomb friction (pipeline/gripper/limits),
A-2 airtight, rigid objects (the catalogue's closed meshes), A-3 no object weight and no
torques about x, y (the wrench of pipeline/gripper/wrench has four rows).
"""

import shutil
import time
from collections import Counter
from pathlib import Path

import numpy as np
from jaxtyping import Int

from pipeline.artifacts.sharding import shard_path, write_index
from pipeline.asking.cache import QUERY_CACHE, keep_rows
from pipeline.config import RunConfig
from pipeline.execution import StageContext, Summary, progress, run_in_order, stage_command
from pipeline.execution.driver_cost import DriverClock
from pipeline.execution.items import grasps_basis
from pipeline.labelling.scene import noise_draws
from pipeline.labelling.shown_pads import SHOWN_SCENES
from pipeline.messages.grasps import portions_by_key
from pipeline.messages.scenes import read_keys, scene_places
from pipeline.spread import choose_evenly
from stages.graph import GRASPS, inputs_of
from stages.grasp_shards import Portion, ShardJob, ShardResult, portion_key, synthesize_shard


def build(stage: StageContext) -> Summary:
    """Synthesize labelled grasps on every scene, one shard a scene."""
    began, scenes, config = time.process_time(), stage.upstream("scenes"), stage.config
    basis, places = grasps_basis(stage.key, config), scene_places(scenes)
    count = len(places)
    former = former_portions(stage, basis)
    recorded = choose_evenly(count, SHOWN_SCENES)
    pads, provenance = max(1, config.recording.grasps // len(recorded)), stage.provenance()
    jobs = [
        ShardJob(
            scene=places[index],
            portions=tuple(
                Portion(number, grasps, former.get((index, number)))
                for number, grasps in enumerate(portions)
            ),
            basis=basis,
            pads=pads if index in recorded else 0,
            shard=shard_path(stage.shards, index, count),
            rows=stage.folder.state(stage.name) / f"{index:05d}.arrow",
            objects=stage.upstream("objects"),
            config=config,
            provenance=provenance,
        )
        for index, portions in enumerate(config.grasps.of_scenes(count))
    ]
    limit_s, store = stage.item_limit_s, stage.store
    done = run_in_order(
        synthesize_shard, jobs, stage.workers, stage.executor, limit_s=limit_s, store=store
    )
    results, clock = [], DriverClock(began, stage.has_workers)
    for result in progress(done, count, "grasps", "scene"):
        clock.book(result.spent_s, result.entry.samples)
        results.append(result)
    histogram = np.sum([result.histogram for result in results], axis=0)
    stage.drawing.seconds += sum(result.recording_s for result in results)
    entries = [result.entry for result in results]
    write_index(stage.output, provenance, entries, histogram)
    with stage.checking.running():
        rows = [job.rows for job in jobs]
        keep_rows("grasps", stage.output, stage.folder.state(QUERY_CACHE), rows)
    stage.checking.seconds += sum(result.rows_s for result in results)
    shutil.rmtree(stage.folder.state(stage.name))
    taken_over = sum(result.taken_over for result in results)
    made = sum(len(job.portions) for job in jobs) - taken_over
    grown = {"taken_over": taken_over, "made": made, "items_basis": basis}
    return summary(results, histogram, config) | grown | clock.cost()


def former_portions(stage: StageContext, basis: str) -> dict[tuple[int, int], Path]:
    """Scene and number of a portion → the shard that held it, of those of a former run.

    Only then the scenes' keys are read here: each worker reads that of its own scene.
    """
    if not (former := portions_by_key(stage.shards, besides=stage.key.digest)):
        return {}
    keys = read_keys(stage.upstream("scenes"))
    return {
        (index, number): former[key]
        for index, portions in enumerate(stage.config.grasps.of_scenes(len(keys)))
        for number, grasps in enumerate(portions)
        if (key := portion_key(basis, keys[index], number, grasps)) in former
    }


def summary(
    results: list[ShardResult], histogram: Int[np.ndarray, " tenths"], config: RunConfig
) -> Summary:
    """The stage's headline figures."""
    status: Counter[str] = Counter()
    for result in results:
        status.update(result.status)
    return {
        "grasps": sum(r.entry.samples // noise_draws(r.entry.split, config) for r in results),
        "clouds": int(histogram.sum()),
        "quality_histogram": histogram.tolist(),
        "status": dict(sorted(status.items())),
        "objects": len({name for result in results for name in result.object_names}),
        "scenes": len(results),
    }


if __name__ == "__main__":
    from pipeline.recording.grasps import draw_grasps  # not in workers: they draw nothing

    stage_command(GRASPS, build, inputs_of, draw=draw_grasps)
