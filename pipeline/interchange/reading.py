"""Reading a run for export: grasps by object, and samples by shard."""

from pathlib import Path

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.artifacts.sharding import listed_shards
from pipeline.interchange.object_grasps import (
    ObjectGrasps,
    PlacedGrasps,
    join_grasps,
    join_placed,
    placed_grasps,
    split_by_body,
)
from pipeline.messages.clouds import with_clouds
from pipeline.messages.grasps import read_grasps
from pipeline.messages.objects import read_objects
from pipeline.messages.samples import samples_of
from pipeline.network.samples import Samples, join_samples
from schemas.softgrip.v1.samples_pb2 import SampleBatch
from schemas.softgrip.v1.scenes_pb2 import Scene


def grasps_by_object(objects: Path, scenes: Path, grasps: Path) -> list[ObjectGrasps]:
    """Every object that has grasps, in the catalogue's order, with all of them.

    Parameters
    ----------
    objects
        Artifact of stage objects.
    scenes
        Artifact of stage scenes.
    grasps
        Artifact of stage grasps (its index).

    Returns
    -------
    One entry an object.

    Raises
    ------
    ArtifactError
        One of them, or a shard of grasps, is missing or damaged.
    """
    catalogue = read_objects(objects)
    with open_artifact(scenes) as artifact:
        poses = {
            (scene.scene_id, placed.body_id): from_tensor(placed.world_from_object)
            for _, scene in artifact.messages(Scene)
            for placed in scene.objects
        }
    parts: dict[str, list[ObjectGrasps]] = {}
    for shard in listed_shards(grasps):
        with open_artifact(shard) as artifact:
            for origin, found in read_grasps(artifact, clouds=False):
                for part in split_by_body(origin, found, catalogue, poses):
                    parts.setdefault(part.item.name, []).append(part)
    return [join_grasps(parts[name]) for name in catalogue if name in parts]


def grasps_by_scene(grasps: Path) -> dict[str, PlacedGrasps]:
    """Every scene's grasps in WCS, from all viewpoints.

    Parameters
    ----------
    grasps
        Artifact of stage grasps (its index).

    Returns
    -------
    Id of a scene → its grasps.

    Raises
    ------
    ArtifactError
        A shard is missing or damaged.
    """
    parts: dict[str, list[PlacedGrasps]] = {}
    for shard in listed_shards(grasps):
        with open_artifact(shard) as artifact:
            for origin, found in read_grasps(artifact, clouds=False):
                parts.setdefault(origin.scene_id, []).append(placed_grasps(found))
    return {scene: join_placed(found) for scene, found in parts.items()}


def read_shard(shard: Path) -> tuple[Samples, tuple[str, ...]]:
    """All samples of a shard, and the names that their ``object_index`` points into."""
    with open_artifact(shard) as artifact:
        messages = list(with_clouds(artifact, SampleBatch))
    samples = join_samples([samples_of(rows, clouds) for rows, clouds in messages])
    return samples, tuple(messages[0][0].object_names)
