"""Stage 2, scenes: objects → clutter of the nine levels, settled and rendered in SAPIEN."""

import time
from collections import Counter
from collections.abc import Collection, Iterator

from loguru import logger

from pipeline.artifacts import publish_bytes
from pipeline.clutter.gaps import gap_mm_by_level
from pipeline.clutter.settled import CLUTTERS_FILE, read_settled_clutters, settled_by
from pipeline.errors import SceneError
from pipeline.execution import StageContext, Summary, progress, run_in_order, stage_command
from pipeline.execution.busy import BusyClock
from pipeline.execution.driver_cost import DriverClock
from pipeline.execution.items import scenes_basis
from pipeline.execution.rendering_nodes import run_on_rendering_nodes
from pipeline.messages.objects import catalogue
from pipeline.messages.scenes import scene_of, write_scene_index
from pipeline.world.scene import ClutterScene
from stages.clutters import SceneJob, scene_jobs
from stages.graph import SCENES, inputs_of
from stages.scene_files import SceneFile, held_scene, rendered_scene, settled

AHEAD = 16  # clutters a worker may be ahead of rendering: a stack takes longer than others


def build(stage: StageContext) -> Summary:
    """Build, settle and render clutter scenes of every level, from each split's objects."""
    began, basis = time.process_time(), scenes_basis(stage.key, stage.config)
    known = read_settled_clutters(stage.folder.state(CLUTTERS_FILE), basis)
    jobs, busy = scene_jobs(stage, known), BusyClock()
    keys = {name: item.key for name, (item, _) in catalogue(stage.upstream("objects")).items()}
    driver = DriverClock(began, stage.has_workers)
    files: list[SceneFile] = []
    left_out: dict[str, str] = {}
    for job, found in zip(jobs, scene_files(stage, jobs), strict=True):
        if isinstance(found, SceneError):
            logger.warning("left out: {}: {}", job.scene_id, found)
            left_out[job.scene_id] = found.what
            continue
        if found.busy_s:
            busy.book(found.busy_s)
        driver.book(found.rendered_s + found.settled_s, 1, spent_here(stage, found))
        files.append(found)
    if not files:
        raise SceneError(
            f"Not one of {len(jobs)} clutters can be built of {stage.upstream('objects')}: "
            f"{next(iter(left_out.values()))}",
            "Add meshes, or lower scenes.objects_per_clutter",
        )
    records = [one.record for one in files]
    scenes = [scene_of(record) for record in records]
    write_scene_index(stage.output, stage.provenance(), records, [one.entry for one in files])
    now = known.with_clutters({one.scene_id: settled_by(one, keys) for one in scenes})
    publish_bytes(stage.folder.state(CLUTTERS_FILE), now.to_json().encode())
    taken_over = sum(one.taken_over for one in files)
    figures = {"taken_over": taken_over, "made": len(files) - taken_over, "left_out": left_out}
    figures |= {"items_basis": basis, "render_share": busy.share()}
    return summary(scenes, keys) | figures | driver.cost("scenes")


def scene_files(stage: StageContext, jobs: list[SceneJob]) -> Iterator[SceneFile | SceneError]:
    """The scenes' files in order, and why others are left out.

    Finished scenes lie in files of their own, and so do those of a former run. Workers settle; one
    process a node renders, for a renderer keeps the GPU or all cores busy by itself.
    """
    there = [job for job in jobs if job.path.is_file()]
    limit_s, store = stage.item_limit_s, stage.store
    looked = run_in_order(
        held_scene, there, stage.workers, stage.executor, limit_s=limit_s, store=store
    )
    # Before others are settled: what they are made of may take the place of a former file.
    held = {j.scene_id: one for j, one in zip(there, looked, strict=True) if one is not None}
    missing = [job for job in jobs if job.scene_id not in held]
    at_rest = run_in_order(settled, missing, stage.workers, stage.executor, AHEAD, limit_s, store)
    asked, built = stage.config.cameras.renderer, zip(missing, at_rest, strict=True)
    rendered = run_on_rendering_nodes(rendered_scene, built, stage.executor, asked, limit_s, store)
    made = iter(progress(rendered, len(missing), "scenes", "scene"))
    for job in jobs:
        yield held[job.scene_id] if job.scene_id in held else next(made)


def spent_here(stage: StageContext, made: SceneFile) -> float:
    """Processor time that the driver itself spent on a scene as a worker does [s]."""
    settling = 0.0 if stage.has_workers else made.settled_s
    return settling + (made.rendered_s if stage.executor == "local" else 0.0)


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
    from pipeline.recording.scenes import draw_scenes  # not in workers: they draw nothing

    stage_command(SCENES, build, inputs_of, draw=draw_scenes)
