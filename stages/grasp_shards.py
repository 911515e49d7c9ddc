"""The shards of stage grasps as work items: the grasps of one scene, labelled and written."""

import time
from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Int
from loguru import logger

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact
from pipeline.artifacts.sharding import is_current, shard_entry
from pipeline.asking.cache import publish_rows
from pipeline.asking.label_rows import grasp_part
from pipeline.config import RunConfig
from pipeline.errors import SceneError
from pipeline.execution import generator
from pipeline.execution.items import item_key
from pipeline.labelling.balancing import TENTHS, quality_histogram
from pipeline.labelling.scene import label_scene, scene_surfaces
from pipeline.labelling.shown_pads import drape_some_again
from pipeline.messages.grasps import (
    PADS_TOPIC,
    GraspMessage,
    grasp_messages,
    grasps_of,
    pads_message,
    read_grasps,
    read_portion,
    write_messages,
)
from pipeline.messages.objects import catalogue
from pipeline.messages.scenes import read_key, read_scene
from pipeline.stopwatch import Stopwatch
from pipeline.world.raycasting import RayScene
from pipeline.world.scene import ClutterScene
from schemas.softgrip.v1.grasps_pb2 import ShardEntry


@dataclass(frozen=True)
class Portion:
    """Grasps of one scene that are drawn and balanced by themselves."""

    number: int
    grasps: int
    former: Path | None  # the shard that held it before


@dataclass(frozen=True)
class ShardJob:
    """One work item: the grasps of one scene."""

    scene: tuple[Path, int]  # file that holds it, and its number there
    portions: tuple[Portion, ...]
    basis: str  # of the keys of portions
    pads: int  # of its grasps, shown in the recording
    shard: Path
    rows: Path  # gets the rows of its grasps, as `make query` and the stage's check ask them
    objects: Path
    config: RunConfig
    provenance: Provenance


@dataclass(frozen=True)
class ShardResult:
    """What the driver needs to know of a finished shard."""

    entry: ShardEntry  # the digest is taken where the file was written
    histogram: Int[np.ndarray, " tenths"]  # of its grasps by tenth of q
    object_names: tuple[str, ...]
    status: dict[str, int]
    rows_s: float  # processor time of writing its rows
    taken_over: int = 0  # portions
    recording_s: float = 0.0  # processor time of draping the pads that are shown
    spent_s: float = 0.0  # processor time of all of it, where it was made


def portion_key(basis: str, scene_key: str, number: int, grasps: int) -> str:
    """What a portion of the grasps of a scene depends on, as a digest."""
    return item_key(basis, scene=scene_key, grasps=grasps, portion=number)


def synthesize_shard(job: ShardJob) -> ShardResult:
    """Make, or keep, the shard of one scene."""
    if is_current(job.shard, job.provenance.key):
        return examined(job)
    draping, world, began = Stopwatch(), LabelledWorld(job), time.process_time()
    former = {p: world.taken_over(p, p.former) for p in job.portions if p.former}
    portions = [former.get(portion) or world.labelled(portion) for portion in job.portions]
    messages = [message for portion in portions for message in portion]
    with ArtifactWriter(job.shard, job.provenance) as artifact:
        written = write_messages(artifact, messages)
        if job.pads and messages:
            with draping.running():
                labelled = [grasps_of(rows)[1] for rows, _ in messages]
                pads = drape_some_again(labelled, job.pads, world.surfaces, job.config)
                artifact.write(PADS_TOPIC, pads_message(pads), log_time_ns=written)
    found = examined(job)
    taken_over = sum(map(bool, former.values()))
    spent_s = time.process_time() - began
    return replace(found, taken_over=taken_over, recording_s=draping.seconds, spent_s=spent_s)


@dataclass(frozen=True)
class LabelledWorld:
    """The scene of a shard, read when grasps are made on it and not before."""

    job: ShardJob

    @cached_property
    def scene(self) -> ClutterScene:
        """What its cameras saw, and where its objects lie."""
        return read_scene(*self.job.scene)

    @cached_property
    def surfaces(self) -> RayScene:
        """Its true surfaces."""
        meshes = {name: item.mesh for name, (item, _) in catalogue(self.job.objects).items()}
        return scene_surfaces(self.scene, meshes, self.job.config.scenes.table_side_m)

    def taken_over(self, portion: Portion, former: Path) -> list[GraspMessage]:
        """A portion of its grasps as a former shard holds it; no image is read."""
        scene_key = read_key(*self.job.scene)
        key = portion_key(self.job.basis, scene_key, portion.number, portion.grasps)
        return read_portion(former, key)

    def labelled(self, portion: Portion) -> list[GraspMessage]:
        """Label a portion of its grasps; the first is drawn from the stream of the scene."""
        config, stream = self.job.config, (portion.number,) if portion.number else ()
        rng = generator(config.seed, "grasps", self.scene.scene_id, *stream)
        try:
            batches = label_scene(self.scene, self.surfaces, config, portion.grasps, rng)
        except SceneError as error:
            if config.scenes.impossible == "refused":
                raise
            logger.warning("left out: {}", error)
            return []
        size, rounded = config.grasps.samples_per_message, config.sensing.rounded
        key = portion_key(self.job.basis, self.scene.key, portion.number, portion.grasps)
        return grasp_messages(batches, size, rounded, key)


def examined(job: ShardJob) -> ShardResult:
    """What a finished shard holds, read back from the file itself; its rows are written."""
    rows, writing, first = [], Stopwatch(), 0
    histogram, names, split = np.zeros(TENTHS, dtype=np.int64), set(), ""
    status: Counter[str] = Counter()
    with open_artifact(job.shard) as artifact:
        for origin, grasps in read_grasps(artifact, clouds=False):
            split = origin.split
            histogram += quality_histogram(grasps.quality)
            names |= {origin.object_names[i] for i in np.unique(grasps.object_index)}
            status.update(origin.status_names[s] for s in grasps.status)
            with writing.running():
                rows.append(grasp_part(origin, grasps, first))
            first += len(grasps)
    with writing.running():
        publish_rows(job.rows, "grasps", rows)
    # A shard of a scene that was left out holds no grasp to tell the split.
    split = split or LabelledWorld(job).scene.split
    entry = shard_entry(job.shard, job.shard.parent.parent, int(histogram.sum()), split)
    return ShardResult(entry, histogram, tuple(sorted(names)), dict(status), writing.seconds)
