"""The files of stage scenes as work items: one scene rendered and written, or taken over."""

import time
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from pipeline.artifacts import ArtifactWriter, open_artifact
from pipeline.artifacts.sharding import is_current, shard_entry
from pipeline.config import RunConfig
from pipeline.errors import ArtifactError, SceneError
from pipeline.execution import generator
from pipeline.execution.items import scene_key
from pipeline.messages.objects import catalogue
from pipeline.messages.scenes import read_record, read_scene, write_scene
from pipeline.sensing.rendering import Renderer, new_renderer, render_views
from pipeline.world.scene import ClutterScene
from pipeline.world.scene_cameras import scene_cameras
from schemas.softgrip.v1.grasps_pb2 import ShardEntry
from schemas.softgrip.v1.scenes_pb2 import Scene
from stages.clutters import SceneJob, settled_clutter


@dataclass(frozen=True)
class Settled:
    """A clutter at rest, or why there is none."""

    scene: ClutterScene | SceneError
    spent_s: float  # processor time


@dataclass(frozen=True)
class SceneFile:
    """What the driver needs to know of a finished scene: its pictures stay in the file."""

    record: Scene
    entry: ShardEntry  # the digest is taken where the file was written
    taken_over: bool = False
    busy_s: float = 0.0  # wall time of rendering
    rendered_s: float = 0.0  # processor time of rendering and writing, where that was done
    settled_s: float = 0.0  # processor time of settling, where that was done


def settled(job: SceneJob) -> Settled:
    """One clutter at rest, without views; or why there is none, where such are left out."""
    began = time.process_time()
    scene = settled_clutter(job)
    return Settled(scene, time.process_time() - began)


def rendered_scene(built: tuple[SceneJob, Settled]) -> SceneFile | SceneError:
    """Render a clutter and write it to its file; a reason to leave it out is handed on."""
    job, at_rest = built
    if isinstance(at_rest.scene, SceneError):
        return at_rest.scene
    renderer, began, spent_s = renderer_of(job.config), time.perf_counter(), time.process_time()
    seen = with_views(job, at_rest.scene, renderer)
    busy_s = time.perf_counter() - began
    record, entry = written(job, seen, renderer.name)
    spent_s = time.process_time() - spent_s
    return SceneFile(record, entry, busy_s=busy_s, rendered_s=spent_s, settled_s=at_rest.spent_s)


def held_scene(job: SceneJob) -> SceneFile | None:
    """What the scene's file holds already, of this run or of a former one; None: make it.

    A former scene that rests on the same as today's is written again, for a file says what run it
    is of. One of which a byte is damaged is not taken over.
    """
    if is_current(job.path, job.provenance.key):
        return SceneFile(read_record(job.path), entry_of(job))
    if job.settled is None:
        return None
    try:
        former = read_record(job.path)
        if former.key != scene_key(job.basis, job.scene_id, job.settled):
            return None
        with open_artifact(job.path) as artifact:
            artifact.check()
        record, entry = written(job, read_scene(job.path, 0), former.renderer)
    except ArtifactError:
        return None
    return SceneFile(record, entry, taken_over=True)


def written(job: SceneJob, scene: ClutterScene, renderer: str) -> tuple[Scene, ShardEntry]:
    """The record of a scene and the entry of its file, which is written."""
    with ArtifactWriter(job.path, job.provenance) as artifact:
        write_scene(artifact, 0, scene, renderer)
    return read_record(job.path), entry_of(job)


def entry_of(job: SceneJob) -> ShardEntry:
    """The entry of a scene's file in the index."""
    return shard_entry(job.path, job.path.parent.parent, 1, job.split)


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
