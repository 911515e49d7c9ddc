"""Failed attempts: what a report says of them, and a picture of each at its worst moment."""

import io
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float
from PIL import Image

from pipeline.artifacts import open_artifact
from pipeline.artifacts.tensors import from_tensor
from pipeline.config import RunConfig, ScenesConfig, StaticCameraConfig
from pipeline.execution import RunFolder
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.mesh import Mesh
from pipeline.messages.objects import read_objects
from pipeline.reporting.facts import read_failures
from pipeline.sensing.ray_rendering import RayRenderer
from pipeline.world.cameras import camera_at
from pipeline.world.scene import PlacedObject
from schemas.softgrip.v1.evaluation_pb2 import Attempt
from schemas.softgrip.v1.scenes_pb2 import Scene

# A picture of the size that a page has room for.
CAMERA = StaticCameraConfig(width_px=400, height_px=300, vertical_fov_rad=0.7, sensor="ideal")
# From where an object and its neighbours fill the picture.
DISTANCE_M, ELEVATION_RAD, AZIMUTH_RAD = 0.5, 0.75, -0.9
PAD = "pad"
PAD_THICKNESS_M = 0.006  # the pad is drawn this thick


def failures_of(
    folder: RunFolder, config: RunConfig, policy: str, at_most: int
) -> tuple[list[dict[str, Any]], dict[str, bytes]]:
    """Some failed attempts of a policy: a row each, and name to JPEG of those that moved.

    A row's ``picture`` is the name of its picture, empty where nothing moved.
    """
    objects = {name: item for name, (item, _) in read_objects(folder.artifact("objects")).items()}
    with open_artifact(folder.artifact("scenes")) as artifact:
        names = {
            scene.scene_id: tuple(placed.object_name for placed in scene.objects)
            for _, scene in artifact.messages(Scene)
        }
    rows, pictures = [], {}
    for number, attempt in enumerate(read_failures(folder.artifact("evaluate"), policy, at_most)):
        bodies, radius = names[attempt.scene_id], config.gripper.pad.radius_m
        jpeg = failure_picture(attempt, bodies, objects, config.scenes, radius)
        name = f"failure-{number}.jpg" if jpeg else ""
        if jpeg:
            pictures[name] = jpeg
        rows.append(
            {
                "cause": attempt.cause,
                "scene_id": attempt.scene_id,
                "number": attempt.attempt,
                "target": attempt.target or "nothing",
                "predicted": attempt.predicted_quality,
                "reached": attempt.reached_quality,
                "pressure": attempt.seal_pressure,
                "picture": name,
            }
        )
    return rows, pictures


def failure_picture(
    attempt: Attempt,
    names: tuple[str, ...],
    objects: Mapping[str, CatalogueObject],
    config: ScenesConfig,
    pad_radius_m: float,
) -> bytes | None:
    """JPEG of an attempt when the pad was lowest, drawn by rays; None where nothing moved.

    Parameters
    ----------
    attempt
        Of the closed loop.
    names
        The scene's objects by body id, from 1.
    objects
        Catalogue entry of each by its name.
    config
        Section scenes: the table that is drawn.
    pad_radius_m
        r_G [m].

    Returns
    -------
    The bytes of a JPEG, the same for the same attempt, or None.
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
