"""Stage 2, scenes: objects → clutter of the nine levels, settled and rendered in SAPIEN."""

import shutil
import time
from collections import Counter, deque
from collections.abc import Collection, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from loguru import logger

from pipeline.artifacts import ArtifactWriter, publish_bytes
from pipeline.artifacts.sharding import is_current
from pipeline.clutter.gaps import gap_mm_by_level
from pipeline.clutter.settled import (
    CLUTTERS_FILE,
    read_settled_clutters,
    settled_by,
)
from pipeline.config import RunConfig
from pipeline.errors import SceneError
from pipeline.execution import (
    StageContext,
    Summary,
    generator,
    progress,
    run_in_order,
    stage_command,
)
from pipeline.execution.busy import BusyClock
from pipeline.execution.items import scene_key, scenes_basis
from pipeline.execution.rendering_nodes import run_on_rendering_nodes
from pipeline.messages.objects import catalogue
from pipeline.messages.scenes import numbers_by_key, read_scene, write_scene
from pipeline.recording.scenes import draw_scenes
from pipeline.sensing.rendering import Renderer, new_renderer, render_views
from pipeline.world.cameras import scene_cameras
from pipeline.world.scene import ClutterScene
from stages.clutters import SceneJob, scene_jobs, settled_clutter
from stages.graph import SCENES, inputs_of

WAITING_TO_BE_WRITTEN = 4  # rendered scenes, some MB each
AHEAD = 16  # clutters a worker may be ahead of rendering: a stack takes longer than others


def build(stage: StageContext) -> Summary:
    """Build, settle and render clutter scenes of every level, from each split's objects."""
    basis = scenes_basis(stage.key, stage.config)
    known = read_settled_clutters(stage.folder.state(CLUTTERS_FILE), basis)
    jobs, clock = scene_jobs(stage, known), BusyClock()
    kept = kept_scenes(jobs, stage.output)
    keys = {name: item.key for name, (item, _) in catalogue(stage.upstream("objects")).items()}
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        scenes, left_out = make_scenes(stage, jobs, kept, artifact, clock)
        now = known.with_clutters({one.scene_id: settled_by(one, keys) for one in scenes})
        publish_bytes(stage.folder.state(CLUTTERS_FILE), now.to_json().encode())
    if (own := stage.folder.state("scenes")).is_dir():  # not where all were taken over
        shutil.rmtree(own)
    taken_over = sum(path == stage.output for path, _ in kept.values())
    figures = {"taken_over": taken_over, "made": len(scenes) - taken_over, "left_out": left_out}
    figures |= {"items_basis": basis, "render_share": clock.share()}
    return summary(scenes, keys) | figures


def make_scenes(
    stage: StageContext,
    jobs: list[SceneJob],
    kept: Mapping[str, tuple[Path, int]],
    artifact: ArtifactWriter,
    clock: BusyClock,
) -> tuple[list[ClutterScene], dict[str, str]]:
    """Settle, render and write clutters; the scenes, and why others are left out.

    Finished scenes lie in files of their own. Workers settle; one process a node renders, for a
    renderer keeps the GPU or all cores busy by itself; a thread writes what is rendered.
    """
    left_out: dict[str, str] = {}
    missing = [job for job in jobs if job.scene_id not in kept]
    limit_s, store = stage.item_limit_s, stage.store
    settled = run_in_order(
        settled_clutter, missing, stage.workers, stage.executor, AHEAD, limit_s, store
    )
    asked, built = stage.config.cameras.renderer, zip(missing, settled, strict=True)
    rendered = run_on_rendering_nodes(rendered_scene, built, stage.executor, asked, limit_s, store)
    made = iter(progress(rendered, len(missing), "scenes", "scene"))
    renderer = renderer_of(stage.config).name
    scenes: list[ClutterScene] = []
    with ThreadPoolExecutor(1) as writer:
        writes: deque[Future[None]] = deque()
        for job in jobs:
            if job.scene_id not in kept:
                seen, busy_s = next(made)
                if isinstance(seen, SceneError):
                    logger.warning("left out: {}: {}", job.scene_id, seen)
                    left_out[job.scene_id] = seen.what
                    continue
                clock.book(busy_s)
            else:
                seen = read_scene(*kept[job.scene_id])
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


def kept_scenes(jobs: list[SceneJob], former: Path) -> dict[str, tuple[Path, int]]:
    """Where the scenes lie that need not be made: in files of their own, or the former artifact."""
    settled = {job.scene_id: job.settled for job in jobs if job.settled}
    keys = {scene_id: scene_key(jobs[0].basis, scene_id, of) for scene_id, of in settled.items()}
    numbers = numbers_by_key(former, set(keys.values()))
    kept = {name: (former, numbers[key]) for name, key in keys.items() if key in numbers}
    own = [job for job in jobs if is_current(job.path, job.provenance.key)]
    return kept | {job.scene_id: (job.path, 0) for job in own}


def rendered_scene(
    built: tuple[SceneJob, ClutterScene | SceneError],
) -> tuple[ClutterScene | SceneError, float]:
    """The scene with its views, kept in a file of its own, and the seconds it took to render."""
    job, clutter = built
    if isinstance(clutter, SceneError):
        return clutter, 0.0
    renderer, began = renderer_of(job.config), time.perf_counter()
    seen = with_views(job, clutter, renderer)
    busy_s = time.perf_counter() - began
    with ArtifactWriter(job.path, job.provenance) as artifact:
        write_scene(artifact, 0, seen, renderer.name)
    return seen, busy_s


def with_views(job: SceneJob, scene: ClutterScene, renderer: Renderer) -> ClutterScene:
    """The scene as each of its cameras sees it."""
    objects = {name: item for name, (item, _) in catalogue(job.objects).items()}
    rng = generator(job.seed, "cameras", job.scene_id)
    centres = np.array([placed.world_from_object[:3, 3] for placed in scene.objects])
    cameras = scene_cameras(job.config.cameras, centres, rng)
    return render_views(scene, objects, cameras, renderer)


@lru_cache(maxsize=1)
def renderer_of(config: RunConfig) -> Renderer:
    """The renderer; its first frame costs seconds, so it is kept."""
    return new_renderer(config.cameras.renderer, config.scenes)


def summary(scenes: list[ClutterScene], objects: Collection[str]) -> Summary:
    """The stage's headline figures."""
    placed = {one.object_name for scene in scenes for one in scene.objects}
    return {
        "scenes": len(scenes),
        "objects_in_no_scene": sum(name not in placed for name in objects),
        "by_split": dict(Counter(scene.split for scene in scenes)),
        "objects_placed": sum(len(scene.objects) for scene in scenes),
        "settle_time_s": round(sum(scene.settle_time_s for scene in scenes), 3),
        "gap_mm_by_level": gap_mm_by_level(scenes),
    }


if __name__ == "__main__":
    stage_command(SCENES, build, inputs_of, draw=draw_scenes)
