"""Stage 3, grasps: scenes → labelled grasps, Algorithm 1 of the supplement.

Assumptions: A-1 quasi-static physics with Coulomb friction (pipeline/gripper/limits),
A-2 airtight, rigid objects (the catalogue's closed meshes), A-3 no object weight and no
torques about x, y (the wrench of pipeline/gripper/wrench has four rows).
"""

import time
from collections import Counter

import numpy as np

from pipeline.artifacts.sharding import shard_entry, shard_path, write_index
from pipeline.config import RunConfig
from pipeline.execution import StageContext, Summary, progress, run_in_order, stage_command
from pipeline.execution.driver_cost import driver_cost
from pipeline.execution.items import grasps_basis, item_key
from pipeline.labelling.balancing import quality_histogram
from pipeline.labelling.scene import noise_draws
from pipeline.labelling.shown_pads import SHOWN_SCENES
from pipeline.messages.grasps import portions_by_key
from pipeline.messages.scenes import read_keys
from pipeline.recording.grasps import draw_grasps
from pipeline.spread import choose_evenly
from stages.graph import GRASPS, inputs_of
from stages.grasp_shards import Portion, ShardJob, ShardResult, synthesize_shard


def build(stage: StageContext) -> Summary:
    """Synthesize labelled grasps on every scene, one shard a scene."""
    scenes, config, former = stage.upstream("scenes"), stage.config, portions_by_key(stage.shards)
    count = len(keys := read_keys(scenes))
    recorded = choose_evenly(count, SHOWN_SCENES)
    basis = grasps_basis(stage.key, config)
    pads = max(1, config.recording.grasps // len(recorded))
    jobs = [
        ShardJob(
            scene_index=index,
            portions=tuple(
                Portion(number, grasps, key, former.get(key))
                for number, grasps in enumerate(portions)
                for key in [item_key(basis, scene=keys[index], grasps=grasps, portion=number)]
            ),
            pads=pads if index in recorded else 0,
            shard=shard_path(stage.shards, index, count),
            objects=stage.upstream("objects"),
            scenes=scenes,
            config=config,
            provenance=stage.provenance(),
        )
        for index, portions in enumerate(config.grasps.of_scenes(count))
    ]
    began = time.process_time()
    done = run_in_order(
        synthesize_shard, jobs, stage.workers, stage.executor, limit_s=stage.item_limit_s
    )
    results = list(progress(done, count, "grasps", "scene"))
    quality = np.concatenate([result.quality for result in results])
    stage.drawing.seconds += sum(result.recording_s for result in results)
    entries = [shard_entry(r.shard, stage.output.parent, len(r.quality), r.split) for r in results]
    write_index(stage.output, stage.provenance(), entries, quality_histogram(quality))
    taken_over = sum(result.taken_over for result in results)
    made = sum(len(job.portions) for job in jobs) - taken_over
    grown = {"taken_over": taken_over, "made": made, "items_basis": basis}
    spent_s = sum(result.spent_s for result in results)
    driver_s = time.process_time() - began - (0.0 if stage.has_workers else spent_s)
    cost = driver_cost(driver_s, spent_s, sum(len(r.quality) for r in results if r.spent_s))
    return summary(results, quality, config) | grown | cost


def summary(results: list[ShardResult], quality: np.ndarray, config: RunConfig) -> Summary:
    """The stage's headline figures."""
    status: Counter[str] = Counter()
    for result in results:
        status.update(result.status)
    return {
        "grasps": sum(len(r.quality) // noise_draws(r.split, config) for r in results),
        "clouds": len(quality),
        "quality_histogram": quality_histogram(quality).tolist(),
        "status": dict(sorted(status.items())),
        "objects": len({name for result in results for name in result.object_names}),
        "scenes": len(results),
    }


if __name__ == "__main__":
    stage_command(GRASPS, build, inputs_of, draw=draw_grasps)
