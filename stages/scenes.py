"""Stage 2, scenes: objects → clutter of the nine levels, settled and rendered in SAPIEN."""

import shutil
from collections import Counter, deque
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from pathlib import Path

import numpy as np
from loguru import logger

from pipeline.artifacts import ArtifactWriter, Provenance
from pipeline.artifacts.sharding import is_current
from pipeline.clutter.building import build_clutter
from pipeline.clutter.gaps import gap_mm_by_level
from pipeline.clutter.levels import level_of
from pipeline.config import RunConfig
from pipeline.errors import SceneError
from pipeline.execution import (
    StageContext,
    Summary,
    derive_seed,
    generator,
    progress,
    run_in_order,
    stage_command,
)
from pipeline.execution.busy import BusyClock
from pipeline.execution.items import scenes_basis, with_scene_key
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scene, write_scene
from pipeline.recording.scenes import draw_scenes
from pipeline.sensing.rendering import Renderer, new_renderer, render_views
from pipeline.world.cameras import scene_cameras
from pipeline.world.scene import ClutterScene
from stages.graph import SCENES, inputs_of

WAITING_TO_BE_WRITTEN = 4  # rendered scenes, some MB each
AHEAD = 16  # clutters a worker may be ahead of rendering: a stack takes longer than others


@dataclass(frozen=True)
class SceneJob:
    """One work item: one clutter of one level, of one split's objects."""

    scene_id: str
    level: int
    split: str
    path: Path
    objects: Path
    config: RunConfig
    provenance: Provenance
    basis: str

    @property
    def seed(self) -> int:
        """What clutter and cameras are drawn from: test clutters have a seed of their own."""
        return self.config.scenes.test_seed if self.split == "test" else self.config.seed


def build(stage: StageContext) -> Summary:
    """Build, settle and render clutter scenes of every level, from each split's objects."""
    jobs, clock = scene_jobs(stage), BusyClock()
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        scenes, left_out = make_scenes(stage, jobs, artifact, clock)
    shutil.rmtree(stage.folder.state("scenes"))
    return summary(scenes) | {"left_out": left_out, "render_share": clock.share()}


def make_scenes(
    stage: StageContext, jobs: list[SceneJob], artifact: ArtifactWriter, clock: BusyClock
) -> tuple[list[ClutterScene], dict[str, str]]:
    """Every scene into its own file and the artifact; returned without views, with what cannot be.

    Workers build clutters ahead; this process renders them one after the other, as a driver
    keeps the GPU or all cores busy by itself; a thread writes what is rendered.
    """
    left_out: dict[str, str] = {}
    missing = [job for job in jobs if not is_current(job.path, job.provenance.key)]
    settled = run_in_order(settled_clutter, missing, stage.workers, stage.executor, AHEAD)
    built = iter(progress(settled, len(missing), "scenes", "scene"))
    renderer = renderer_of(stage.config).name
    scenes: list[ClutterScene] = []
    with ThreadPoolExecutor(1) as writer:
        writes: deque[Future[None]] = deque()
        for job in jobs:
            if job in missing:
                clutter = next(built)
                if isinstance(clutter, SceneError):
                    logger.warning("left out: {}: {}", job.scene_id, clutter)
                    left_out[job.scene_id] = clutter.what
                    continue
                seen = render(job, clutter, clock)
                save(job, seen, renderer)
            else:
                seen = read_scene(job.path, 0)
            writes.append(writer.submit(write_scene, artifact, len(scenes), seen, renderer))
            if len(writes) > WAITING_TO_BE_WRITTEN:
                writes.popleft().result()
            scenes.append(replace(seen, views=()))
        for write in writes:
            write.result()
    if not scenes:
        raise SceneError(
            f"Not one of {len(jobs)} clutters can be built of {stage.upstream('objects')}: "
            f"{next(iter(left_out.values()))}",
            "Add meshes, or lower scenes.objects_per_clutter",
        )
    return scenes, left_out


def scene_jobs(stage: StageContext) -> list[SceneJob]:
    """Every clutter of the run, level by level."""
    counts, basis = stage.config.scenes.clutters_per_level, scenes_basis(stage.key, stage.config)
    shared = (stage.upstream("objects"), stage.config, stage.provenance(), basis)
    jobs = []
    for level, split in product(sorted(stage.config.scenes.levels), stage.config.scenes.splits):
        for number in range(getattr(counts, split)):
            scene_id = f"level{level}-{split}-{number:02d}"
            path = stage.folder.state("scenes") / f"{scene_id}.mcap"
            jobs.append(SceneJob(scene_id, level, split, path, *shared))
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
    seed = derive_seed(job.seed, "scene", job.scene_id)
    scene = build_clutter(job.scene_id, job.level, job.split, pool, job.config.scenes, seed)
    return with_scene_key(scene, job.basis, pool)


def pool_of(job: SceneJob) -> list[CatalogueObject]:
    """The objects of its split and its level's class."""
    wanted, _ = level_of(job.level)
    every = catalogue(job.objects).values()
    return [item for item, of in every if of == job.split and item.shape_class == wanted]


def render(job: SceneJob, scene: ClutterScene, clock: BusyClock) -> ClutterScene:
    """The scene with its views."""
    objects = {name: item for name, (item, _) in catalogue(job.objects).items()}
    rng = generator(job.seed, "cameras", job.scene_id)
    centres = np.array([placed.world_from_object[:3, 3] for placed in scene.objects])
    cameras = scene_cameras(job.config.cameras, centres, rng)
    renderer = renderer_of(job.config)
    with clock.busy():
        return render_views(scene, objects, cameras, renderer)


def save(job: SceneJob, scene: ClutterScene, renderer: str) -> None:
    """A rendered scene in a file of its own, kept until all are there."""
    with ArtifactWriter(job.path, job.provenance) as artifact:
        write_scene(artifact, 0, scene, renderer)


@lru_cache(maxsize=1)
def catalogue(objects: Path) -> dict[str, tuple[CatalogueObject, str]]:
    """The object catalogue, read once a worker."""
    return read_objects(objects)


@lru_cache(maxsize=1)
def renderer_of(config: RunConfig) -> Renderer:
    """The renderer; its first frame costs seconds, so it is kept."""
    return new_renderer(config.cameras.renderer, config.scenes)


def summary(scenes: list[ClutterScene]) -> Summary:
    """The stage's headline figures."""
    return {
        "scenes": len(scenes),
        "by_split": dict(Counter(scene.split for scene in scenes)),
        "objects_placed": sum(len(scene.objects) for scene in scenes),
        "settle_time_s": round(sum(scene.settle_time_s for scene in scenes), 3),
        "gap_mm_by_level": gap_mm_by_level(scenes),
    }


if __name__ == "__main__":
    stage_command(SCENES, build, inputs_of, draw=draw_scenes)
