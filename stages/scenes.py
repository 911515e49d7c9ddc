"""Stage 2, scenes: objects → clutter of the nine levels, settled and rendered in SAPIEN."""

import shutil
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from loguru import logger

from pipeline.artifacts import ArtifactWriter, Provenance
from pipeline.artifacts.object_messages import read_objects
from pipeline.artifacts.scene_messages import read_scene, write_scene
from pipeline.artifacts.sharding import is_current
from pipeline.clutter.building import build_clutter
from pipeline.clutter.levels import level_of
from pipeline.clutter.scene import ClutterScene
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
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.recording.recording import recording, spread
from pipeline.recording.scenes import blueprint, show_scene
from pipeline.sensing.cameras import scene_cameras
from pipeline.sensing.rendering import Renderer, new_renderer, rendered
from stages.graph import SCENES, inputs_of


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


class RenderClock:
    """How much of the time since the first frame was spent rendering."""

    def __init__(self) -> None:
        self._first_frame_at: float | None = None
        self._rendering_s = 0.0

    @contextmanager
    def rendering(self) -> Iterator[None]:
        """Around the rendering of one scene."""
        started = time.perf_counter()
        yield
        ended = time.perf_counter()
        if self._first_frame_at is None:
            self._first_frame_at = ended  # shaders were compiled: not counted
        else:
            self._rendering_s += ended - started

    def share(self) -> float | None:
        """Rendering time over wall time since the first scene's frames; None before a second."""
        if self._first_frame_at is None or self._rendering_s == 0.0:
            return None
        return round(self._rendering_s / (time.perf_counter() - self._first_frame_at), 3)


def build(stage: StageContext) -> Summary:
    """Build, settle and render clutter scenes of every level, from each split's objects.

    Workers build clutters; this process alone renders them, one after the other: a driver keeps
    the GPU, or all cores, busy by itself.
    """
    jobs = scene_jobs(stage)
    todo = [job for job in jobs if not is_current(job.path, job.provenance.key)]
    built = run_in_order(settled_clutter, todo, stage.workers, stage.executor)
    clock = RenderClock()
    for job, scene in zip(todo, progress(built, len(todo), "scenes", "scene"), strict=True):
        render(job, scene, clock)
    parts = [job.path for job in jobs]
    publish(stage, parts)
    scenes = [read_scene(stage.output, index) for index in range(len(parts))]
    shutil.rmtree(stage.folder.state("scenes"))
    return summary(scenes) | {"render_share": clock.share()}


def scene_jobs(stage: StageContext) -> list[SceneJob]:
    """Every clutter of the run, level by level."""
    counts = stage.config.scenes.clutters_per_level
    jobs = []
    for level in sorted(stage.config.scenes.levels):
        for split, count in (("train", counts.train), ("val", counts.val), ("test", counts.test)):
            for number in range(count):
                scene_id = f"level{level}-{split}-{number:02d}"
                path = stage.folder.state("scenes") / f"{scene_id}.mcap"
                jobs.append(
                    SceneJob(
                        scene_id,
                        level,
                        split,
                        path,
                        stage.upstream("objects"),
                        stage.config,
                        stage.provenance(),
                    )
                )
    return jobs


def settled_clutter(job: SceneJob) -> ClutterScene:
    """One clutter at rest, without views."""
    shape_class, _ = level_of(job.level)
    pool = [
        item
        for item, split in catalogue(job.objects).values()
        if split == job.split and item.shape_class == shape_class
    ]
    if not pool:
        raise SceneError(
            f"Level {job.level} needs {shape_class} objects of the {job.split} split, "
            f"and {job.objects} has none",
            "Add meshes, raise objects.limit, or leave the level out of scenes.levels",
        )
    seed = derive_seed(job.config.seed, "scene", job.scene_id)
    return build_clutter(job.scene_id, job.level, job.split, pool, job.config.scenes, seed)


def render(job: SceneJob, scene: ClutterScene, clock: RenderClock) -> None:
    """One scene with its views, in a file of its own until all are there."""
    objects = {name: item for name, (item, _) in catalogue(job.objects).items()}
    rng = generator(job.config.seed, "cameras", job.scene_id)
    centres = np.array([placed.world_from_object[:3, 3] for placed in scene.objects])
    cameras = scene_cameras(job.config.cameras, centres, rng)
    renderer = renderer_of(job.config)
    with clock.rendering():
        seen = rendered(scene, objects, cameras, renderer)
    with ArtifactWriter(job.path, job.provenance) as artifact:
        write_scene(artifact, 0, seen, renderer.name)


@lru_cache(maxsize=1)
def catalogue(objects: Path) -> dict[str, tuple[CatalogueObject, str]]:
    """The object catalogue, read once a worker."""
    return read_objects(objects)


@lru_cache(maxsize=1)
def renderer_of(config: RunConfig) -> Renderer:
    """The renderer; its first frame costs seconds, so it is kept."""
    return new_renderer(config.cameras.renderer, config.scenes)


def publish(stage: StageContext, parts: list[Path]) -> None:
    """One recording and one artifact of all scenes, in order."""
    meshes = {n: item.mesh for n, (item, _) in catalogue(stage.upstream("objects")).items()}
    nsvr = {n: item.nsvr for n, (item, _) in catalogue(stage.upstream("objects")).items()}
    cameras = [view.camera.name for view in read_scene(parts[0], 0).views]
    opening = blueprint(cameras)
    with recording(stage.recording, stage.stage.name, stage.key.digest, opening) as stream:
        for step, index in enumerate(spread(len(parts), stage.config.recording.scenes)):
            show_scene(stream, step, read_scene(parts[index], 0), meshes, nsvr)
    name = renderer_of(stage.config).name
    logger.debug("scenes: rendered with {}", name)
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        for index, part in enumerate(parts):
            write_scene(artifact, index, read_scene(part, 0), name)


def summary(scenes: list[ClutterScene]) -> Summary:
    """The stage's headline figures."""
    gaps = {
        str(level): [
            round(1e3 * float(gap), 3)
            for scene in scenes
            if scene.level == level
            for gap in scene.gaps_m
        ]
        for level in sorted({scene.level for scene in scenes})
    }
    return {
        "scenes": len(scenes),
        "by_split": dict(Counter(scene.split for scene in scenes)),
        "objects_placed": sum(len(scene.objects) for scene in scenes),
        "settle_time_s": round(sum(scene.settle_time_s for scene in scenes), 3),
        "gap_mm_by_level": {
            level: {"least": min(found), "greatest": max(found)} for level, found in gaps.items()
        },
    }


if __name__ == "__main__":
    stage_command(SCENES, build, inputs_of)
