"""Stage 3, grasps: scenes → labelled grasps, Algorithm 1 of the supplement.

Assumptions: A-1 quasi-static physics with Coulomb friction (pipeline/gripper/limits),
A-2 airtight, rigid objects (the catalogue's closed meshes), A-3 no object weight and no
torques about x, y (the wrench of pipeline/gripper/wrench has four rows).
"""

from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property
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
from pipeline.execution.items import grasps_basis, item_key
from pipeline.labelling.balancing import quality_histogram
from pipeline.labelling.scene import label_scene, noise_draws, scene_surfaces
from pipeline.labelling.shown_pads import SHOWN_SCENES, drape_some_again
from pipeline.messages.grasps import (
    PADS_TOPIC,
    GraspMessage,
    grasp_messages,
    grasps_of,
    pads_message,
    portions_by_key,
    read_grasps,
    read_portion,
    write_messages,
)
from pipeline.messages.objects import catalogue
from pipeline.messages.scenes import read_keys, read_scene
from pipeline.recording.grasps import draw_grasps
from pipeline.spread import choose_evenly
from pipeline.stopwatch import Stopwatch
from pipeline.world.raycasting import RayScene
from pipeline.world.scene import ClutterScene
from stages.graph import GRASPS, inputs_of


@dataclass(frozen=True)
class Portion:
    """Grasps of one scene that are drawn and balanced by themselves."""

    number: int
    grasps: int
    key: str
    former: Path | None  # the shard that held it before


@dataclass(frozen=True)
class ShardJob:
    """One work item: the grasps of one scene."""

    scene_index: int
    portions: tuple[Portion, ...]
    pads: int  # of its grasps, shown in the recording
    shard: Path
    objects: Path
    scenes: Path
    config: RunConfig
    provenance: Provenance


@dataclass(frozen=True)
class ShardResult:
    """What the driver needs to know of a finished shard."""

    shard: Path
    split: str
    quality: Float[np.ndarray, " n"]
    object_names: tuple[str, ...]
    status: dict[str, int]
    taken_over: int = 0  # portions
    recording_s: float = 0.0  # processor time of draping the pads that are shown


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
    return summary(results, quality, config) | grown


def synthesize_shard(job: ShardJob) -> ShardResult:
    """Make, or keep, the shard of one scene."""
    if is_current(job.shard, job.provenance.key):
        return examined(job.shard)
    draping, world = Stopwatch(), LabelledWorld(job)
    former = {p: read_portion(p.former, p.key) for p in job.portions if p.former}
    portions = [former.get(portion) or world.labelled(portion) for portion in job.portions]
    messages = [message for portion in portions for message in portion]
    with ArtifactWriter(job.shard, job.provenance) as artifact:
        written = write_messages(artifact, messages)
        if job.pads:
            with draping.running():
                labelled = [grasps_of(rows)[1] for rows, _ in messages]
                pads = drape_some_again(labelled, job.pads, world.surfaces, job.config)
                artifact.write(PADS_TOPIC, pads_message(pads), log_time_ns=written)
    found = examined(job.shard)
    taken_over = sum(map(bool, former.values()))
    return replace(found, taken_over=taken_over, recording_s=draping.seconds)


@dataclass(frozen=True)
class LabelledWorld:
    """The scene of a shard, read when grasps are made on it and not before."""

    job: ShardJob

    @cached_property
    def scene(self) -> ClutterScene:
        """What its cameras saw, and where its objects lie."""
        return read_scene(self.job.scenes, self.job.scene_index)

    @cached_property
    def surfaces(self) -> RayScene:
        """Its true surfaces."""
        meshes = {name: item.mesh for name, (item, _) in catalogue(self.job.objects).items()}
        return scene_surfaces(self.scene, meshes, self.job.config.scenes.table_side_m)

    def labelled(self, portion: Portion) -> list[GraspMessage]:
        """Label a portion of its grasps; the first is drawn from the stream of the scene."""
        config, stream = self.job.config, (portion.number,) if portion.number else ()
        rng = generator(config.seed, "grasps", self.scene.scene_id, *stream)
        batches = label_scene(self.scene, self.surfaces, config, portion.grasps, rng)
        size, rounded = config.grasps.samples_per_message, config.sensing.rounded
        return grasp_messages(batches, size, rounded, portion.key)


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
