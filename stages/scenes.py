"""Stage 2, scenes: objects → clutter of the nine levels, settled and rendered in SAPIEN."""

import shutil
from collections import Counter, deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import rerun as rr

from pipeline.artifacts import ArtifactWriter, Provenance
from pipeline.artifacts.sharding import is_current
from pipeline.clutter.building import build_clutter
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
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scene, write_scene
from pipeline.recording.recording import recording, spread
from pipeline.recording.scenes import blueprint, show_scene
from pipeline.sensing.rendering import Renderer, new_renderer, rendered
from pipeline.world.cameras import camera_names, scene_cameras
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


def build(stage: StageContext) -> Summary:
    """Build, settle and render clutter scenes of every level, from each split's objects.

    Workers build clutters ahead; this process renders them one after the other, as a driver
    keeps the GPU or all cores busy by itself; a thread writes what is rendered.
    """
    jobs = scene_jobs(stage)
    missing = [job for job in jobs if not is_current(job.path, job.provenance.key)]
    settled = run_in_order(settled_clutter, missing, stage.workers, stage.executor, AHEAD)
    built = iter(progress(settled, len(missing), "scenes", "scene"))
    clock = BusyClock()
    scenes: list[ClutterScene] = []
    with ExitStack() as files, ThreadPoolExecutor(1) as writer:
        publication = files.enter_context(Publication.opened(stage, len(jobs)))
        writes: deque[Future[None]] = deque()
        for job in jobs:
            if job in missing:
                seen = render(job, next(built), clock)
                save(job, seen, renderer_of(job.config).name)
            else:
                seen = read_scene(job.path, 0)
            writes.append(writer.submit(publication.add, seen))
            if len(writes) > WAITING_TO_BE_WRITTEN:
                writes.popleft().result()
            scenes.append(replace(seen, views=()))
        for write in writes:
            write.result()
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


def render(job: SceneJob, scene: ClutterScene, clock: BusyClock) -> ClutterScene:
    """The scene with its views."""
    objects = {name: item for name, (item, _) in catalogue(job.objects).items()}
    rng = generator(job.config.seed, "cameras", job.scene_id)
    centres = np.array([placed.world_from_object[:3, 3] for placed in scene.objects])
    cameras = scene_cameras(job.config.cameras, centres, rng)
    renderer = renderer_of(job.config)
    with clock.busy():
        return rendered(scene, objects, cameras, renderer)


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


class Publication:
    """The stage's recording and artifact, to which scenes are added in order."""

    def __init__(
        self, stage: StageContext, scenes: int, artifact: ArtifactWriter, stream: rr.RecordingStream
    ) -> None:
        self._artifact = artifact
        self._stream = stream
        self._drawing = stage.drawing
        items = catalogue(stage.upstream("objects"))
        self._meshes = {name: item.mesh for name, (item, _) in items.items()}
        self._nsvr = {name: item.nsvr for name, (item, _) in items.items()}
        shown = spread(scenes, stage.config.recording.scenes)
        self._step_of = {index: step for step, index in enumerate(shown)}
        self._renderer = renderer_of(stage.config).name
        self._added = 0

    @classmethod
    @contextmanager
    def opened(cls, stage: StageContext, scenes: int) -> Iterator["Publication"]:
        """Both files; when the block ends well the recording appears first, the artifact last."""
        opening = blueprint(camera_names(stage.config.cameras))
        with (
            ArtifactWriter(stage.output, stage.provenance()) as artifact,
            recording(stage, opening, amid_work=True) as stream,
        ):
            yield cls(stage, scenes, artifact, stream)

    def add(self, scene: ClutterScene) -> None:
        """The next scene."""
        index, self._added = self._added, self._added + 1
        if index in self._step_of:
            with self._drawing.running():
                show_scene(self._stream, self._step_of[index], scene, self._meshes, self._nsvr)
        write_scene(self._artifact, index, scene, self._renderer)


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
