"""The clutters of a run as work items: what each is built of, and it, settled."""

from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

from pipeline.artifacts import Provenance
from pipeline.clutter.building import build_clutter
from pipeline.clutter.levels import clutter_ids, level_of
from pipeline.clutter.settled import SettledClutter, SettledClutters
from pipeline.config import RunConfig
from pipeline.errors import SceneError
from pipeline.execution import StageContext, derive_seed
from pipeline.execution.items import with_scene_key
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.messages.objects import catalogue
from pipeline.world.scene import ClutterScene


@dataclass(frozen=True)
class SceneJob:
    """One work item: one clutter of one level, of one split's objects."""

    scene_id: str
    level: int
    split: str
    path: Path
    settled: SettledClutter | None  # what it is built of again
    objects: Path
    config: RunConfig
    provenance: Provenance
    basis: str

    @property
    def seed(self) -> int:
        """What clutter and cameras are drawn from: test clutters have a seed of their own."""
        return self.config.scenes.test_seed if self.split == "test" else self.config.seed

    @property
    def drawn_from(self) -> int:
        """What this clutter is drawn from."""
        return derive_seed(self.seed, "scene", self.scene_id)


def scene_jobs(stage: StageContext, known: SettledClutters) -> list[SceneJob]:
    """Every clutter of the run, level by level."""
    counts = stage.config.scenes.clutters_per_level
    shared = (stage.upstream("objects"), stage.config, stage.provenance(), known.basis)
    jobs = []
    for level, split in product(sorted(stage.config.scenes.levels), stage.config.scenes.splits):
        for scene_id in clutter_ids(level, split, getattr(counts, split)):
            path = stage.shards / f"{scene_id}.mcap"
            job = SceneJob(scene_id, level, split, path, None, *shared)
            settled = known.stands(scene_id, job.drawn_from, pool_of(job))
            jobs.append(replace(job, settled=settled))
    return jobs


def settled_clutter(job: SceneJob) -> ClutterScene | SceneError:
    """One clutter at rest, without views; or why there is none, where such are left out."""
    try:
        return built_clutter(job)
    except SceneError as error:
        if job.config.scenes.impossible == "refused":
            raise
        return error


def built_clutter(job: SceneJob) -> ClutterScene:
    """One clutter at rest, without views."""
    pool = pool_of(job)
    if not pool:
        raise SceneError(
            f"Level {job.level} needs {level_of(job.level)[0]} objects of the {job.split} split, "
            f"and {job.objects} has none",
            "Add meshes, raise objects.limit, or leave the level out of scenes.levels",
        )
    of = (job.scene_id, job.level, job.split, pool)
    scene = build_clutter(*of, job.config.scenes, job.drawn_from, job.settled)
    return with_scene_key(scene, job.basis, pool)


def pool_of(job: SceneJob) -> list[CatalogueObject]:
    """The objects of its split and its level's class."""
    wanted, every = level_of(job.level)[0], catalogue(job.objects).values()
    return [item for item, of in every if of == job.split and item.shape_class == wanted]
