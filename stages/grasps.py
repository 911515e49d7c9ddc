"""Stage 3, grasps: scenes → labelled grasps, Algorithm 1 of the supplement.

Assumptions: A-1 quasi-static physics with Coulomb friction (pipeline/gripper/limits),
A-2 airtight, rigid objects (the catalogue's closed meshes), A-3 no object weight and no
torques about x, y (the wrench of pipeline/gripper/wrench has four rows).
"""

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact
from pipeline.artifacts.sharding import is_current, shard_entry, shard_path, write_index
from pipeline.config import RunConfig
from pipeline.execution import (
    StageContext,
    Summary,
    generator,
    progress,
    run_in_order,
    stage_command,
)
from pipeline.execution.items import GRASP_COUNTS, item_key, items_basis
from pipeline.labelling.balancing import quality_histogram
from pipeline.labelling.grasps import LabelledGrasps
from pipeline.labelling.scene import label_scene, noise_draws, scene_surfaces
from pipeline.labelling.shown_pads import SHOWN_SCENES, ShownPads, drape_again
from pipeline.messages.grasps import PADS_TOPIC, pads_message, read_grasps, write_grasps
from pipeline.messages.objects import catalogue
from pipeline.messages.scenes import read_scene, scene_count
from pipeline.recording.grasps import draw_grasps
from pipeline.spread import choose_evenly
from pipeline.stopwatch import Stopwatch
from pipeline.world.raycasting import RayScene
from stages.graph import GRASPS, inputs_of

GRASPS_OF = ("seed", "gripper", "sensing", "grasps")  # what the grasps of every scene rest on


@dataclass(frozen=True)
class ShardJob:
    """One work item: the grasps of one scene."""

    scene_index: int
    grasps: int
    pads: int  # of its grasps, shown in the recording
    shard: Path
    objects: Path
    scenes: Path
    config: RunConfig
    provenance: Provenance
    basis: str


@dataclass(frozen=True)
class ShardResult:
    """What the driver needs to know of a finished shard."""

    shard: Path
    split: str
    quality: Float[np.ndarray, " n"]
    object_names: tuple[str, ...]
    status: dict[str, int]
    recording_s: float = 0.0  # processor time of draping the pads that are shown


def build(stage: StageContext) -> Summary:
    """Synthesize labelled grasps on every scene, one shard a scene."""
    scenes = stage.upstream("scenes")
    count = scene_count(scenes)
    share, more = divmod(stage.config.grasps.count, count)
    recorded = choose_evenly(count, SHOWN_SCENES)
    basis = items_basis(stage.key, stage.config, GRASPS_OF, GRASP_COUNTS)
    pads = max(1, stage.config.recording.grasps // len(recorded))
    jobs = [
        ShardJob(
            scene_index=index,
            grasps=share + (index < more),
            pads=pads if index in recorded else 0,
            shard=shard_path(stage.shards, index, count),
            objects=stage.upstream("objects"),
            scenes=scenes,
            config=stage.config,
            provenance=stage.provenance(),
            basis=basis,
        )
        for index in range(count)
    ]
    done = run_in_order(synthesize_shard, jobs, stage.workers, stage.executor)
    results = list(progress(done, count, "grasps", "scene"))
    quality = np.concatenate([result.quality for result in results])
    stage.drawing.seconds += sum(result.recording_s for result in results)
    entries = [shard_entry(r.shard, stage.output.parent, len(r.quality), r.split) for r in results]
    write_index(stage.output, stage.provenance(), entries, quality_histogram(quality))
    return summary(results, quality, stage.config)


def synthesize_shard(job: ShardJob) -> ShardResult:
    """Make, or keep, the shard of one scene."""
    draping = Stopwatch()
    if not is_current(job.shard, job.provenance.key):
        scene = read_scene(job.scenes, job.scene_index)
        meshes = {name: item.mesh for name, (item, _) in catalogue(job.objects).items()}
        rng = generator(job.config.seed, "grasps", scene.scene_id)
        surfaces = scene_surfaces(scene, meshes, job.config.scenes.table_side_m)
        batches = label_scene(scene, surfaces, job.config, job.grasps, rng)
        size, rounded = job.config.grasps.samples_per_message, job.config.sensing.rounded
        key = item_key(job.basis, scene=scene.key, grasps=job.grasps)
        with ArtifactWriter(job.shard, job.provenance) as artifact:
            written = write_grasps(artifact, batches, size, rounded, key)
            if job.pads:
                with draping.running():
                    labelled = [grasps for _, grasps in batches]
                    pads = draped_pads(labelled, surfaces, job.pads, job.config)
                    artifact.write(PADS_TOPIC, pads_message(pads), log_time_ns=written)
    return replace(examined(job.shard), recording_s=draping.seconds)


def draped_pads(
    grasps: list[LabelledGrasps], surfaces: RayScene, pads: int, config: RunConfig
) -> ShownPads:
    """Pads of some of a scene's grasps, from its worst label to its best, draped again."""
    quality = np.concatenate([batch.quality for batch in grasps])
    chosen = np.argsort(quality, kind="stable")[choose_evenly(len(quality), pads)]
    return drape_again(grasps, chosen, surfaces, config)


def examined(shard: Path) -> ShardResult:
    """What a finished shard holds, read back from the file itself."""
    quality, names, split = [], set(), ""
    status: Counter[str] = Counter()
    with open_artifact(shard) as artifact:
        for origin, grasps in read_grasps(artifact, clouds=False):
            split = origin.split
            quality.append(grasps.quality)
            names |= {origin.object_names[i] for i in np.unique(grasps.object_index)}
            status.update(origin.status_names[s] for s in grasps.status)
    return ShardResult(shard, split, np.concatenate(quality), tuple(sorted(names)), dict(status))


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
