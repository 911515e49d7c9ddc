"""Clutter scenes ↔ softgrip.v1.Scene, their images on foxglove topics beside it.

The artifact holds the record of scene i on ``/scenes`` at log time i seconds, and names a file for
each scene. That file holds the record again, for every viewpoint colour, depth, segmentation and
normals as foxglove.RawImage, the camera as foxglove.CameraCalibration, and all poses as
foxglove.FrameTransforms, so that a viewer shows it as it is. Artifacts of older versions hold all
of this themselves, scene i at log time i seconds; such are read as well.
"""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import cast, get_args

import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from pipeline.artifacts.names import file_name
from pipeline.artifacts.provenance import Provenance
from pipeline.artifacts.reading import Artifact, open_artifact
from pipeline.artifacts.sharding import (
    INDEX_TOPIC,
    index_message,
    listed_shards,
    read_index,
    remove_unnamed,
    shard_of,
)
from pipeline.artifacts.tensors import from_tensor, tensors_of, to_tensor
from pipeline.artifacts.writing import ArtifactWriter
from pipeline.clutter.levels import level_of
from pipeline.config.cameras import DepthSensor
from pipeline.errors import ArtifactError, ContentError
from pipeline.messages.foxglove import camera_calibration, frame_transforms, raw_image
from pipeline.world.cameras import PinholeCamera
from pipeline.world.scene import ClutterScene, PlacedObject
from pipeline.world.view import CameraView
from schemas.softgrip.v1 import scenes_pb2
from schemas.softgrip.v1.grasps_pb2 import ShardEntry

TOPIC = "/scenes"
NS_PER_SCENE = 1_000_000_000  # a second of log time a scene, so that viewers step through them

POSE, POSE_SHAPE = {"world_from_object": "f8"}, {"world_from_object": "4 4"}
CAMERA = {"intrinsics": "f8", "world_from_camera": "f8"}
CAMERA_SHAPES = {"intrinsics": "3 3", "world_from_camera": "4 4"}

# Name of an image → (encoding of foxglove.RawImage, dtype).
IMAGES = {
    "depth": ("32FC1", "<f4"),
    "colour": ("rgb8", "u1"),
    "segmentation": ("16UC1", "<u2"),
    "normals": ("rgb8", "u1"),
    "behind": ("32FC1", "<f4"),
}


def write_scene(artifact: ArtifactWriter, index: int, scene: ClutterScene, renderer: str) -> None:
    """Append scene ``index`` and, in chunks of their own, its images."""
    time_ns = index * NS_PER_SCENE
    artifact.end_chunk()
    artifact.write(TOPIC, scene_message(scene, renderer), time_ns)
    artifact.end_chunk()
    artifact.write("/tf", frame_transforms(_poses(scene), time_ns), time_ns)
    for view in scene.views:
        topic = f"/scene/{view.camera.name}"
        artifact.write(f"{topic}/calibration", camera_calibration(view.camera, time_ns), time_ns)
        for name, image in _images(view).items():
            raw = raw_image(image, *IMAGES[name], view.camera, time_ns)
            artifact.write(f"{topic}/{name}", raw, time_ns)


def scene_message(scene: ClutterScene, renderer: str) -> scenes_pb2.Scene:
    """The record of a scene, images left out."""
    shape_class, distribution = level_of(scene.level)
    return scenes_pb2.Scene(
        key=scene.key,
        generator=scene.generator,
        scene_id=scene.scene_id,
        level=scene.level,
        shape_class=shape_class,
        distribution=distribution,
        split=scene.split,
        seed=scene.seed,
        objects=[
            scenes_pb2.PlacedObject(
                object_name=placed.object_name,
                body_id=placed.body_id,
                world_from_object=to_tensor(placed.world_from_object),
                gap_m=float(gap),
            )
            for placed, gap in zip(scene.objects, scene.gaps_m, strict=True)
        ],
        contacts=to_tensor(np.asarray(scene.contacts, dtype=np.uint32).reshape(-1, 2)),
        settle_time_s=scene.settle_time_s,
        renderer=renderer,
        viewpoints=[
            scenes_pb2.Viewpoint(
                name=view.camera.name,
                width_px=view.camera.width_px,
                height_px=view.camera.height_px,
                intrinsics=to_tensor(view.camera.intrinsics),
                world_from_camera=to_tensor(view.camera.world_from_camera),
                sensor=view.camera.sensor,
                near_m=view.camera.near_m,
                far_m=view.camera.far_m,
            )
            for view in scene.views
        ],
    )


def write_scene_index(
    path: Path,
    provenance: Provenance,
    records: Sequence[scenes_pb2.Scene],
    entries: list[ShardEntry],
) -> None:
    """Publish the artifact once the files of all scenes are there; other files are removed.

    Parameters
    ----------
    path
        The artifact.
    provenance
        What made it.
    records
        Of the scenes, in order.
    entries
        What their files are, in the same order.
    """
    remove_unnamed(path, entries)
    with ArtifactWriter(path, provenance) as artifact:
        for index, record in enumerate(records):
            artifact.write(TOPIC, record, index * NS_PER_SCENE)
        artifact.end_chunk()
        artifact.write(INDEX_TOPIC, index_message(entries, np.zeros(0)), log_time_ns=0)


def scene_count(path: Path) -> int:
    """How many scenes an artifact holds."""
    with open_artifact(path) as artifact:
        return artifact.counts()[TOPIC][1]


def scene_places(path: Path) -> list[tuple[Path, int]]:
    """Where each scene lies with its images: a file, and the scene's number in it.

    Who works on one scene is given its place, and need not read what is known of all.

    Parameters
    ----------
    path
        The artifact, of any version.

    Returns
    -------
    Of each scene a file of its own and 0; of an older version this artifact and a number.
    """
    with open_artifact(path) as artifact:
        indexed, count = INDEX_TOPIC in artifact.counts(), artifact.counts()[TOPIC][1]
    if indexed:
        return [(file, 0) for file in listed_shards(path)]
    return [(path, number) for number in range(count)]


def read_scene(path: Path, index: int) -> ClutterScene:
    """Scene ``index`` of an artifact, or of a file that `scene_places` names, with its images."""
    with open_artifact(path) as artifact:
        if INDEX_TOPIC not in artifact.counts():
            return _whole_scene(artifact, index)
    entries = read_index(path).shards
    if index >= len(entries):
        raise ArtifactError(f"{path} holds no scene {index}", "Make the scenes again")
    with open_artifact(shard_of(path, entries[index])) as artifact:
        return _whole_scene(artifact, 0)


def read_record(path: Path) -> scenes_pb2.Scene:
    """The record of a scene that has a file of its own; no image is read."""
    with open_artifact(path) as artifact:
        return _message(artifact, 0)[0]


def scene_of(record: scenes_pb2.Scene) -> ClutterScene:
    """The scene that a record tells of, without what cameras saw: `views` is empty."""
    return _scene(record, ())


def read_placed(path: Path, index: int) -> tuple[PlacedObject, ...]:
    """The objects of scene ``index`` where they lie, no image read."""
    with open_artifact(path) as artifact:
        message, _ = _message(artifact, index)
        return _placed(message)


def read_key(path: Path, index: int) -> str:
    """The key of scene ``index``; no image is read."""
    with open_artifact(path) as artifact:
        return str(_message(artifact, index)[0].key)


def read_keys(path: Path) -> list[str]:
    """The key of every scene, in order; no image is read."""
    with open_artifact(path) as artifact:
        return [scene.key for _, scene in artifact.messages(scenes_pb2.Scene)]


def read_placements(path: Path) -> dict[str, tuple[PlacedObject, ...]]:
    """Scene id → its objects where they lie, in the order of the scenes; no image is read."""
    with open_artifact(path) as artifact:
        return {scene.scene_id: _placed(scene) for _, scene in artifact.messages(scenes_pb2.Scene)}


def read_scenes(path: Path) -> Iterator[ClutterScene]:
    """All scenes, in order, one in memory at a time."""
    for place in scene_places(path):
        yield read_scene(*place)


def read_unseen_scenes(path: Path) -> list[ClutterScene]:
    """All scenes, in order, without what cameras saw of them: `views` is empty."""
    with open_artifact(path) as artifact:
        return [scene_of(record) for _, record in artifact.messages(scenes_pb2.Scene)]


def _whole_scene(artifact: Artifact, index: int) -> ClutterScene:
    message, time_ns = _message(artifact, index)
    views = tuple(_view(artifact, viewpoint, time_ns) for viewpoint in message.viewpoints)
    return _scene(message, views)


def _message(artifact: Artifact, index: int) -> tuple[scenes_pb2.Scene, int]:
    """Scene ``index`` and its time [ns]. Raises ArtifactError where there is none."""
    for time_ns, message in artifact.messages(scenes_pb2.Scene, at_ns=index * NS_PER_SCENE):
        return message, time_ns
    raise ArtifactError(f"{artifact.path} holds no scene {index}", "Make the scenes again")


def _scene(message: scenes_pb2.Scene, views: tuple[CameraView, ...]) -> ClutterScene:
    contacts = from_tensor(message.contacts)
    return ClutterScene(
        scene_id=file_name(message.scene_id),
        level=message.level,
        split=message.split,
        seed=message.seed,
        objects=_placed(message),
        gaps_m=np.array([placed.gap_m for placed in message.objects]),
        contacts=tuple((int(a), int(b)) for a, b in contacts),
        settle_time_s=message.settle_time_s,
        key=message.key,
        generator=message.generator,
        views=views,
    )


def _placed(message: scenes_pb2.Scene) -> tuple[PlacedObject, ...]:
    return tuple(
        PlacedObject(placed.object_name, placed.body_id, **tensors_of(placed, POSE, POSE_SHAPE))
        for placed in message.objects
    )


def _view(artifact: Artifact, viewpoint: scenes_pb2.Viewpoint, time_ns: int) -> CameraView:
    if viewpoint.sensor not in get_args(DepthSensor):
        raise ContentError(f"Viewpoint '{viewpoint.name}' has sensor '{viewpoint.sensor}'")
    camera = PinholeCamera(
        name=viewpoint.name,
        width_px=viewpoint.width_px,
        height_px=viewpoint.height_px,
        **tensors_of(viewpoint, CAMERA, CAMERA_SHAPES),
        sensor=cast(DepthSensor, viewpoint.sensor),
        near_m=viewpoint.near_m,
        far_m=viewpoint.far_m,
    )
    images = {}
    for name, (encoding, dtype) in IMAGES.items():
        topic = f"/scene/{viewpoint.name}/{name}"
        for _, raw in artifact.messages(RawImage, topic, at_ns=time_ns):
            if raw.encoding != encoding:
                raise ArtifactError(
                    f"{artifact.path}: {topic} is {raw.encoding}, expected {encoding}",
                    "Make the scenes again",
                )
            shape = (raw.height, raw.width) + ((3,) if encoding == "rgb8" else ())
            if len(raw.data) != math.prod(shape) * np.dtype(dtype).itemsize:
                raise ContentError(f"{topic} holds {len(raw.data)} bytes, its shape is {shape}")
            images[name] = np.frombuffer(raw.data, dtype).reshape(shape)
    if missing := [name for name in IMAGES if name not in images and name != "behind"]:
        raise ContentError(f"Viewpoint '{viewpoint.name}' has no image {', '.join(missing)}")
    return CameraView(
        camera=camera,
        depth_m=images["depth"],
        colour=images["colour"],
        segmentation=images["segmentation"],
        normals=images["normals"],
        behind_m=images.get("behind"),
    )


def _images(view: CameraView) -> dict[str, np.ndarray]:
    images = {
        "depth": view.depth_m,
        "colour": view.colour,
        "segmentation": view.segmentation,
        "normals": view.normals,
    }
    if view.behind_m is not None:
        images["behind"] = view.behind_m
    return images


def _poses(scene: ClutterScene) -> dict[str, np.ndarray]:
    """World pose of every object and camera, by the name of its frame."""
    poses = {f"object_{p.body_id:02d}": p.world_from_object for p in scene.objects}
    return poses | {view.camera.name: view.camera.world_from_camera for view in scene.views}
