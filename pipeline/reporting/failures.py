"""Pictures of failed attempts: the clutter at its worst moment, with the pad where it was."""

import io
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import trimesh
from jaxtyping import Float
from PIL import Image

from pipeline.artifacts.tensors import from_tensor
from pipeline.config import ScenesConfig, StaticCameraConfig
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.mesh import Mesh
from pipeline.sensing.ray_rendering import RayRenderer
from pipeline.world.cameras import camera_at
from pipeline.world.scene import PlacedObject
from schemas.softgrip.v1.evaluation_pb2 import Attempt

CAMERA = StaticCameraConfig(width_px=400, height_px=300, vertical_fov_rad=0.7, sensor="ideal")
DISTANCE_M, ELEVATION_RAD, AZIMUTH_RAD = 0.5, 0.75, -0.9
PAD = "pad"
PAD_THICKNESS_M = 0.006


def failure_picture(
    attempt: Attempt,
    names: tuple[str, ...],
    objects: Mapping[str, CatalogueObject],
    config: ScenesConfig,
    pad_radius_m: float,
) -> bytes | None:
    """JPEG of an attempt when the pad was lowest, drawn by rays; None where nothing moved.

    names : the scene's objects by body id, from 1. The same attempt gives the same bytes.
    """
    pads = from_tensor(attempt.gripper_path).reshape(-1, 4, 4)
    bodies = from_tensor(attempt.object_paths).reshape(len(pads), -1, 4, 4)
    if not len(pads):
        return None
    lowest = int(np.argmin(pads[:, 2, 3]))
    placed = [
        PlacedObject(name, index + 1, pose)
        for index, (name, pose) in enumerate(zip(names, bodies[lowest], strict=True))
        if np.isfinite(pose).all()
    ]
    if not placed:
        return None
    shown = dict(objects)
    shown[PAD] = replace(objects[placed[0].object_name], mesh=pad_disc(pad_radius_m))
    placed.append(PlacedObject(PAD, len(names) + 1, pads[lowest]))
    camera = camera_at(
        "failure", CAMERA, pads[lowest][:3, 3], DISTANCE_M, ELEVATION_RAD, AZIMUTH_RAD
    )
    (view,) = RayRenderer(config).views(placed, shown, (replace(camera, near_m=0.02),))
    jpeg = io.BytesIO()
    paper = np.where(view.depth_m[..., None] > 0, view.colour, np.uint8(255))
    Image.fromarray(paper).save(jpeg, format="JPEG", quality=88)
    return jpeg.getvalue()


def pad_disc(radius_m: float) -> Mesh:
    """The pad as a disc whose lower face is the gripper's z = 0."""
    lift: Float[np.ndarray, "4 4"] = np.eye(4)
    lift[2, 3] = PAD_THICKNESS_M / 2
    disc = trimesh.creation.cylinder(radius_m, PAD_THICKNESS_M, sections=48, transform=lift)
    return Mesh(np.array(disc.vertices), np.array(disc.faces, dtype=np.int64))
