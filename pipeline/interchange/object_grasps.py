"""Grasps sorted by object and in its frame, as datasets of single objects hold them.

The gripper's base frame of these formats has its +z along the approach, into the object; GCS has
its +z out of it. Both have their origin at the pad's centre where it first touches.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
import trimesh
from jaxtyping import Bool, Float, Int

from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import invert
from pipeline.labelling.grasps import GraspOrigin, LabelledGrasps

# Half a turn about x: its own inverse.
GCS_FROM_BASE = np.diag([1.0, -1.0, -1.0, 1.0])


@dataclass(frozen=True)
class ObjectGrasps:
    """All grasps of one object from all scenes; arrays of one length n.

    Attributes
    ----------
    item
        The object.
    split
        Its split: train, val or test.
    object_from_base
        Gripper base, +z along the approach, in the object's frame, shape (n, 4, 4).
    quality
        q as labelled in the scene, shape (n,).
    pressure
        p as labelled in the scene, shape (n,).
    wrench
        GW as labelled in the scene, shape (n, 4).
    level
        Level of Table II, shape (n,).
    scene
        Name of each grasp's scene, n of them: a label holds among the objects of its scene.
    """

    item: CatalogueObject
    split: str
    object_from_base: Float[np.ndarray, "n 4 4"]
    quality: Float[np.ndarray, " n"]
    pressure: Float[np.ndarray, " n"]
    wrench: Float[np.ndarray, "n 4"]
    level: Int[np.ndarray, " n"]
    scene: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.quality)

    def successful(self, least_quality: float) -> Bool[np.ndarray, " n"]:
        """What these formats call a success: a label of at least ``least_quality``."""
        return self.quality >= least_quality


def base_in_object(
    world_from_object: Float[np.ndarray, "4 4"], world_from_gripper: Float[np.ndarray, "n 4 4"]
) -> Float[np.ndarray, "n 4 4"]:
    """Poses of GCS in the world → poses of the formats' gripper base in the object's frame."""
    return np.asarray(invert(world_from_object) @ world_from_gripper @ GCS_FROM_BASE)


@dataclass(frozen=True, eq=False)
class PlacedGrasps:
    """Grasps of one scene in WCS; arrays of one length n.

    Attributes
    ----------
    world_from_gripper
        GCS at first touch, +z out of the object, shape (n, 4, 4).
    quality
        q, shape (n,).
    pressure
        p, shape (n,).
    body_id
        The object under the pad, shape (n,).
    """

    world_from_gripper: Float[np.ndarray, "n 4 4"]
    quality: Float[np.ndarray, " n"]
    pressure: Float[np.ndarray, " n"]
    body_id: Int[np.ndarray, " n"]


def placed_grasps(grasps: LabelledGrasps) -> PlacedGrasps:
    """What a scene's file shows of labelled grasps."""
    return PlacedGrasps(
        grasps.world_from_gripper, grasps.quality, grasps.pressure, grasps.body_id.astype(np.int64)
    )


def join_placed(parts: Sequence[PlacedGrasps]) -> PlacedGrasps:
    """Grasps of one scene from several batches, in order; at least one."""
    return PlacedGrasps(
        *(
            np.concatenate([getattr(part, field.name) for part in parts])
            for field in fields(PlacedGrasps)
        )
    )


def split_by_body(
    origin: GraspOrigin,
    grasps: LabelledGrasps,
    objects: Mapping[str, tuple[CatalogueObject, str]],
    poses: Mapping[tuple[str, int], Float[np.ndarray, "4 4"]],
) -> Iterator[ObjectGrasps]:
    """Sort the grasps of a batch by body, each in the frame of its object.

    Parameters
    ----------
    origin
        The scene of the batch.
    grasps
        Its grasps in WCS.
    objects
        Name of an object → the object and its split.
    poses
        Scene and body id → ``world_from_object``, shape (4, 4).

    Yields
    ------
    ObjectGrasps
        The grasps of each body that has any, in the order of body ids.
    """
    for body in np.unique(grasps.body_id):
        rows = np.flatnonzero(grasps.body_id == body)
        name = origin.object_names[int(grasps.object_index[rows[0]])]
        item, split = objects[name]
        world_from_object = poses[origin.scene_id, int(body)]
        yield ObjectGrasps(
            item=item,
            split=split,
            object_from_base=base_in_object(world_from_object, grasps.world_from_gripper[rows]),
            quality=grasps.quality[rows],
            pressure=grasps.pressure[rows],
            wrench=grasps.wrench[rows],
            level=np.full(len(rows), origin.level),
            scene=(origin.scene_id,) * len(rows),
        )


def join_grasps(parts: Sequence[ObjectGrasps]) -> ObjectGrasps:
    """Join several sets of one object's grasps, in order; at least one."""
    arrays = ("object_from_base", "quality", "pressure", "wrench", "level")
    return ObjectGrasps(
        item=parts[0].item,
        split=parts[0].split,
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in arrays},
        scene=sum((part.scene for part in parts), ()),
    )


def obj_text(mesh: Mesh) -> str:
    """A mesh as Wavefront OBJ, in metres, to a hundredth of a micrometre."""
    surface = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
    return str(surface.export(file_type="obj", include_normals=False, digits=8))
