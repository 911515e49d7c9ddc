"""The labelled grasps of a whole run as columns, whatever scene and view they are of."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from pipeline.artifacts.reading import open_artifact
from pipeline.artifacts.sharding import listed_shards
from pipeline.messages.grasps import read_grasps


@dataclass(frozen=True, eq=False)
class GraspColumns:
    """Grasps of all scenes; arrays of one length n.

    Attributes
    ----------
    scene
        Number of the scene, shape (n,).
    world_from_gripper
        GCS at first touch, in WCS, shape (n, 4, 4).
    body_id
        Of the object within its scene, shape (n,).
    object_name
        Strings, shape (n,).
    quality, pressure
        q of S-1.12 and p of Eq. (2), shape (n,).
    cloud, cloud_mask
        What a camera saw, in units of r_G, shapes (n, g, g, 3) and (n, g, g).
    """

    scene: Int[np.ndarray, " n"]
    world_from_gripper: Float[np.ndarray, "n 4 4"]
    body_id: Int[np.ndarray, " n"]
    object_name: Shaped[np.ndarray, " n"]
    quality: Float[np.ndarray, " n"]
    pressure: Float[np.ndarray, " n"]
    cloud: Float[np.ndarray, "n g g 3"]
    cloud_mask: Bool[np.ndarray, "n g g"]


def read_columns(index: Path) -> GraspColumns:
    """All grasps of a run, by its index of shards: a shard a scene, in order."""
    parts: list[tuple[np.ndarray, ...]] = []
    for scene, shard in enumerate(listed_shards(index)):
        with open_artifact(shard) as artifact:
            for origin, grasps in read_grasps(artifact):
                parts.append(
                    (
                        np.full(len(grasps), scene),
                        grasps.world_from_gripper,
                        grasps.body_id.astype(np.int64),
                        np.array(origin.object_names)[grasps.object_index],
                        grasps.quality,
                        grasps.pressure,
                        grasps.cloud,
                        grasps.cloud_mask,
                    )
                )
    return GraspColumns(*map(np.concatenate, zip(*parts, strict=True)))
