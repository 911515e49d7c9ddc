"""Stage 3, grasps: scenes → labelled grasps, Algorithm 1 of the supplement.

Assumptions: A-1 quasi-static physics with Coulomb friction (pipeline/gripper/limits),
A-2 airtight, rigid objects (the catalogue's closed meshes), A-3 no object weight and no
torques about x, y (the wrench of pipeline/gripper/wrench has four rows).
"""

from collections import Counter
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact
from pipeline.artifacts.sharding import is_current, shard_entry, shard_path, write_index
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
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.mesh import Mesh
from pipeline.gripper import GraspStatus, LabelBatch, Pad, build_pad, label_batch
from pipeline.gripper.draping import drape
from pipeline.gripper.limits import LIMIT_NAMES
from pipeline.gripper.quality import triangle_pressure
from pipeline.labelling.balancing import flattened, quality_histogram, rare_grasps
from pipeline.labelling.heights import pad_heights
from pipeline.labelling.sampling import (
    Candidates,
    Proposal,
    VisibleSurface,
    joined,
    propose,
    propose_nearby,
)
from pipeline.messages.grasps import (
    GraspOrigin,
    LabelledGrasps,
    ShownPads,
    grasp_batch,
    grasps_of,
    pads_message,
    pads_of,
)
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_placed, read_scene, scene_count
from pipeline.recording.grasps import ShownGrasp, blueprint, show_grasps
from pipeline.recording.recording import recording
from pipeline.sensing.depth_noise import disturb
from pipeline.sensing.sub_cloud import merged_sub_clouds
from pipeline.spread import spread
from pipeline.stopwatch import Stopwatch
from pipeline.world.cameras import PinholeCamera, pixel_rays, shown_whole
from pipeline.world.raycasting import RayScene
from pipeline.world.scene import ClutterScene, PlacedObject
from pipeline.world.table import table_mesh
from pipeline.world.view import CameraView
from schemas.softgrip.v1.grasps_pb2 import DrapedPads, GraspBatch
from stages.graph import GRASPS, inputs_of

TOPIC, PADS_TOPIC = "/grasps", "/pads"
RECORDED_SCENES = 4
Picture = tuple[Float[np.ndarray, "_ _"], PinholeCamera]  # depth [m], and what took it
ROUND = 512  # grasps labelled at once: bounds the memory of their rays


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
    recorded = spread(count, RECORDED_SCENES)
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
        )
        for index in range(count)
    ]
    done = run_in_order(synthesize_shard, jobs, stage.workers, stage.executor)
    results = list(progress(done, count, "grasps", "scene"))
    quality = np.concatenate([result.quality for result in results])
    stage.drawing.seconds += sum(result.recording_s for result in results)
    record(stage, {index: results[index].shard for index in recorded}, quality)
    entries = [shard_entry(r.shard, stage.output.parent, len(r.quality), r.split) for r in results]
    write_index(stage.output, stage.provenance(), entries, quality_histogram(quality))
    return summary(results, quality)


def synthesize_shard(job: ShardJob) -> ShardResult:
    """Make, or keep, the shard of one scene."""
    draping = Stopwatch()
    if not is_current(job.shard, job.provenance.key):
        scene = read_scene(job.scenes, job.scene_index)
        meshes = {name: item.mesh for name, (item, _) in catalogue(job.objects).items()}
        rng = generator(job.config.seed, "grasps", scene.scene_id)
        surfaces = ray_scene(scene, meshes, job.config)
        batches = synthesize(scene, surfaces, job.config, job.grasps, rng)
        size = job.config.grasps.samples_per_message
        with ArtifactWriter(job.shard, job.provenance) as artifact:
            written = 0
            for origin, grasps in batches:
                for start in range(0, len(grasps), size):
                    part = grasps.rows(start, min(start + size, len(grasps)))
                    artifact.write(TOPIC, grasp_batch(origin, part), log_time_ns=written)
                    written += len(part)
            if job.pads:
                with draping.running():
                    pads = draped_pads([grasps for _, grasps in batches], surfaces[0], job)
                    artifact.write(PADS_TOPIC, pads_message(pads), log_time_ns=written)
    return replace(examined(job.shard), recording_s=draping.seconds)


def draped_pads(batches: list[LabelledGrasps], rays: RayScene, job: ShardJob) -> ShownPads:
    """Pads of some of a scene's grasps, from its worst label to its best, draped again."""
    pad, gripper = pad_of(job.config), job.config.gripper
    quality, frames, contact = (
        np.concatenate([getattr(grasps, name) for grasps in batches])
        for name in ("quality", "world_from_gripper", "contact_mask")
    )
    chosen = np.argsort(quality, kind="stable")[spread(len(quality), job.pads)]
    heights, _ = pad_heights(frames[chosen], rays, pad, job.config.grasps.clearance_m)
    draped = drape(pad, heights)
    pressure = [
        triangle_pressure(pad, gripper, z, touching)
        for z, touching in zip(draped, contact[chosen], strict=True)
    ]
    return ShownPads(chosen, draped, np.array(pressure))


@lru_cache(maxsize=1)
def catalogue(objects: Path) -> dict[str, tuple[CatalogueObject, str]]:
    """The object catalogue, read once a worker."""
    return read_objects(objects)


@lru_cache(maxsize=1)
def pad_of(config: RunConfig) -> Pad:
    """S-1.02, S-1.03: the pad in GCS, within Table I's steps, built once a worker."""
    return build_pad(config.gripper.pad)


def synthesize(
    scene: ClutterScene,
    surfaces: tuple[RayScene, Int[np.ndarray, " bodies"]],
    config: RunConfig,
    wanted: int,
    rng: np.random.Generator,
) -> list[tuple[GraspOrigin, LabelledGrasps]]:
    """Algorithm 1 on every object of a scene, from each of its viewpoints.

    Parameters
    ----------
    surfaces
        Of the scene, by `ray_scene`. S-1.01, the object's pose in SE(3), is where physics left
        it.
    """
    placed = scene.objects
    names = tuple(sorted({item.object_name for item in placed}))
    rays, body_ids = surfaces
    index_of_body = {item.body_id: names.index(item.object_name) for item in placed}
    # S-1.13 - S-1.15: the cameras' pictures, disturbed.
    measured = [
        (disturb(view, rng) if config.sensing.disturbed else view.depth_m, view.camera)
        for view in scene.views
    ]
    surfaces_seen = [
        visible_surface(view, rays, body_ids, config.gripper.pad.radius_m) for view in scene.views
    ]
    able = [
        number
        for number, surface in enumerate(surfaces_seen)
        if len(surface.contacts(config.grasps.seen_angle_max_rad))
    ]
    if not able:
        raise SceneError(
            f"No camera of scene {scene.scene_id} sees a surface face on and whole in its picture",
            "Raise grasps.seen_angle_max_rad, or change where the cameras stand",
        )
    batches = []
    for number, share in zip(able, spread_evenly(wanted, len(able)), strict=True):
        view = scene.views[number]
        kept = kept_grasps(surfaces_seen[number], rays, body_ids, config, share, rng)
        grasps = with_clouds(*kept, measured[number], measured, config, rng)
        index = np.array([index_of_body[int(body)] for body in grasps.body_id], dtype=np.int64)
        origin = GraspOrigin(
            scene_id=scene.scene_id,
            viewpoint=view.camera.name,
            level=scene.level,
            split=scene.split,
            object_names=names,
            limit_names=LIMIT_NAMES,
            status_names=tuple(status.name.lower() for status in GraspStatus),
            proposal_names=tuple(proposal.name.lower() for proposal in Proposal),
        )
        batches.append((origin, replace(grasps, object_index=index)))
    return batches


def ray_scene(
    scene: ClutterScene, meshes: dict[str, Mesh], config: RunConfig
) -> tuple[RayScene, Int[np.ndarray, " bodies"]]:
    """The true surfaces of a scene, table last, and the body id of each of its bodies."""
    placed = scene.objects
    bodies = [meshes[item.object_name].transformed(item.world_from_object) for item in placed]
    table = table_mesh(config.scenes.table_side_m)
    return RayScene([*bodies, table]), np.array([*(item.body_id for item in placed), 0])


def kept_grasps(
    surface: VisibleSurface,
    rays: RayScene,
    body_ids: np.ndarray,
    config: RunConfig,
    wanted: int,
    rng: np.random.Generator,
) -> tuple[Candidates, LabelBatch, Float[np.ndarray, " n"]]:
    """Propose, label and balance: what is kept, with the chance that each had to be."""
    tried = int(np.ceil(wanted * config.grasps.oversampling))
    candidates, labels = label_rounds(surface, rays, body_ids, config, tried, rng)
    kept, probability = flattened(labels.q, wanted, config.grasps.balance, rng)
    return candidates.take(kept), labels.take(kept), probability


def with_clouds(
    candidates: Candidates,
    labels: LabelBatch,
    probability: Float[np.ndarray, " n"],
    picture: Picture,
    pictures: list[Picture],
    config: RunConfig,
    rng: np.random.Generator,
) -> LabelledGrasps:
    """S-1.14, S-1.15: transform and desample, from all pictures for some, from one for the rest.

    Parameters
    ----------
    probability
        With which each was kept.
    picture
        Of the view that proposed them.
    """
    merged = rng.random(len(candidates)) < config.grasps.merged_share
    frames, radius_m = candidates.world_from_contact, config.gripper.pad.radius_m
    cells = config.sensing.grid_cells
    cloud = np.empty((len(merged), cells, cells, 3), dtype=np.float32)
    mask = np.empty((len(merged), cells, cells), dtype=np.bool_)
    for rows, seen in ((merged, pictures), (~merged, [picture])):
        found = merged_sub_clouds(seen, frames[rows], config.sensing, radius_m)
        cloud[rows], mask[rows] = found
    first_touch = frames.copy()
    first_touch[:, :3, 3] += labels.touch_height_m[:, None] * first_touch[:, :3, 2]
    return LabelledGrasps(
        object_index=candidates.body_id,
        body_id=candidates.body_id,
        world_from_gripper=first_touch,
        quality=labels.q,
        pressure=labels.pressure,
        wrench=labels.wrench,
        limit_slack=labels.slacks,
        weight_summary=labels.weights,
        contact_mask=labels.contact,
        status=labels.status - min(GraspStatus),
        iterations=labels.iterations,
        tilt_rad=candidates.tilt_rad,
        proposal=candidates.proposal,
        keep_probability=probability,
        cloud=cloud,
        cloud_mask=mask,
        touch_height_m=labels.touch_height_m,
        pictures=np.where(merged, len(pictures), 1),
    )


def label_rounds(
    surface: VisibleSurface,
    rays: RayScene,
    body_ids: np.ndarray,
    config: RunConfig,
    tried: int,
    rng: np.random.Generator,
) -> tuple[Candidates, LabelBatch]:
    """S-1.04 - S-1.12 in two rounds: over all that is seen face on, then near what is rare.

    Parameters
    ----------
    surface
        With at least one of its `contacts`.
    """
    pad = pad_of(config)
    tried_on = surface.body_id[surface.contacts(config.grasps.seen_angle_max_rad)]
    bodies = np.unique(tried_on)
    parts = {int(body): surface.of_body(body) for body in bodies}
    first = tried - int(tried * config.grasps.nearby_share)
    candidates = joined(
        [
            propose(parts[int(body)], count, config.grasps, rng)
            for body, count in zip(bodies, spread_evenly(first, len(bodies)), strict=True)
        ]
    )
    labels = label_candidates(candidates, rays, body_ids, pad, config)
    origins = rare_grasps(labels.q, tried - first, rng)
    near = joined(
        [
            propose_nearby(
                parts[int(body)],
                candidates.take(origins[candidates.body_id[origins] == body]),
                config.grasps,
                rng,
            )
            for body in bodies
        ]
    )
    near_labels = label_candidates(near, rays, body_ids, pad, config)
    return joined([candidates, near]), LabelBatch.joined([labels, near_labels])


def label_candidates(
    candidates: Candidates,
    rays: RayScene,
    body_ids: np.ndarray,
    pad: Pad,
    config: RunConfig,
) -> LabelBatch:
    """S-1.07 - S-1.12 for every candidate: its pad's heights by rays, then the label."""
    parts = []
    for start in range(0, len(candidates), ROUND):
        frames = candidates.world_from_contact[start : start + ROUND]
        heights, below = pad_heights(frames, rays, pad, config.grasps.clearance_m)
        on_target = body_ids[below] == candidates.body_id[start : start + ROUND, None]
        parts.append(label_batch(pad, config.gripper, heights, on_target & (below >= 0)))
    return LabelBatch.joined(parts)


def visible_surface(
    view: CameraView, rays: RayScene, body_ids: np.ndarray, radius_m: float
) -> VisibleSurface:
    """What the camera sees of the objects: exact points and normals under its pixels.

    Parameters
    ----------
    radius_m
        How far around a contact the picture must show the scene, r_G.
    """
    origin, directions = pixel_rays(view.camera, view.segmentation > 0)
    hits = rays.cast(np.broadcast_to(origin, directions.shape), directions)
    body = np.where(hits.body >= 0, body_ids[hits.body], 0)
    seen = body > 0
    if not seen.any():
        raise SceneError(
            f"Camera {view.camera.name} sees no object",
            "Change cameras.static.elevations_rad or azimuths_rad",
        )
    points = origin + hits.distance_m[seen, None] * directions[seen]
    whole = shown_whole(view.camera, points, radius_m)
    return VisibleSurface(points, rays.normals_at(hits)[seen], body[seen], origin, whole)


def spread_evenly(total: int, parts: int) -> list[int]:
    """``total`` in ``parts`` whole numbers that differ by one at most."""
    return [total // parts + (i < total % parts) for i in range(parts)]


def examined(shard: Path) -> ShardResult:
    """What a finished shard holds, read back from the file itself."""
    quality, names, split = [], set(), ""
    status: Counter[str] = Counter()
    with open_artifact(shard) as artifact:
        for _, message in artifact.messages(GraspBatch):
            origin, grasps = grasps_of(message)
            split = origin.split
            quality.append(grasps.quality)
            names |= {origin.object_names[i] for i in np.unique(grasps.object_index)}
            status.update(origin.status_names[s] for s in grasps.status)
    return ShardResult(shard, split, np.concatenate(quality), tuple(sorted(names)), dict(status))


def record(stage: StageContext, shards: dict[int, Path], quality: np.ndarray) -> None:
    """The recording: grasps of some scenes by their index, spread over their labels."""
    meshes = {n: item.mesh for n, (item, _) in catalogue(stage.upstream("objects")).items()}
    with recording(stage, blueprint()) as stream:
        shown: list[ShownGrasp] = []
        for index, shard in shards.items():
            placed = read_placed(stage.upstream("scenes"), index)
            shown += shown_grasps(placed, shard)
        show_grasps(stream, shown, meshes, pad_of(stage.config), quality)


def shown_grasps(placed: tuple[PlacedObject, ...], shard: Path) -> list[ShownGrasp]:
    """The grasps of a shard that have their pads in it."""
    with open_artifact(shard) as artifact:
        batches = [grasps_of(message) for _, message in artifact.messages(GraspBatch)]
        pads = pads_of(artifact.one(DrapedPads))
    rows = [(origin, batch, row) for origin, batch in batches for row in range(len(batch))]
    shown = []
    for number, height, pressure in zip(pads.grasp, pads.height_m, pads.pressure, strict=True):
        origin, grasps, row = rows[number]
        shown.append(ShownGrasp(placed, origin, grasps, row, height, pressure))
    return shown


def summary(results: list[ShardResult], quality: np.ndarray) -> Summary:
    """The stage's headline figures."""
    status: Counter[str] = Counter()
    for result in results:
        status.update(result.status)
    return {
        "grasps": len(quality),
        "quality_histogram": quality_histogram(quality).tolist(),
        "status": dict(sorted(status.items())),
        "objects": len({name for result in results for name in result.object_names}),
        "scenes": len(results),
    }


if __name__ == "__main__":
    stage_command(GRASPS, build, inputs_of)
