"""Artifacts → the columns of `schemas.tables`, part by part; no cloud and no picture is read."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from pipeline.artifacts import from_tensor, open_artifact, read_provenance
from pipeline.artifacts.sharding import read_index
from pipeline.asking.columns import Part, Words, one_word, words
from pipeline.clutter.levels import level_of
from pipeline.errors import ArtifactError
from pipeline.geometry.shape import ShapeClass
from pipeline.labelling.grasps import GraspOrigin, LabelledGrasps
from pipeline.messages.grasps import read_grasps
from pipeline.messages.samples import samples_of
from pipeline.network.samples import Samples
from schemas.softgrip.v1.evaluation_pb2 import Attempt
from schemas.softgrip.v1.objects_pb2 import CatalogueObject, RefusedMesh
from schemas.softgrip.v1.samples_pb2 import SampleBatch
from schemas.softgrip.v1.scenes_pb2 import Scene
from schemas.softgrip.v1.training_pb2 import Epoch

CLASSES = tuple(str(shape_class) for shape_class in ShapeClass)


def pose_columns(world_from_thing: Float[np.ndarray, "n 4 4"]) -> dict[str, np.ndarray]:
    """Poses as places [m] and unit quaternions of the part with w >= 0."""
    quaternion = Rotation.from_matrix(world_from_thing[:, :3, :3]).as_quat(
        canonical=True, scalar_first=True
    )
    places = dict(zip(("x_m", "y_m", "z_m"), world_from_thing[:, :3, 3].T, strict=True))
    return places | dict(zip(("qw", "qx", "qy", "qz"), quaternion.T, strict=True))


def object_rows(path: Path) -> Iterator[Part]:
    """Rows of table objects."""
    with open_artifact(path) as artifact:
        found = [message for _, message in artifact.messages(CatalogueObject)]
    same = ("split", "shape_class", "family", "source", "source_sha256", "unit", "unit_origin")
    numbers = ("scale", "extent_m", "area_m2", "volume_m3", "nsvr", "mass_kg")
    yield {
        "object": words([item.name for item in found]),
        **{name: words([getattr(item, name) for item in found]) for name in same},
        "repairs": words([", ".join(item.repairs) for item in found]),
        **{name: np.array([getattr(item, name) for item in found]) for name in numbers},
        "material": words([item.material for item in found]),
        "faces": np.array([item.mesh.faces.shape[0] for item in found]),
        "convex_parts": np.array([len(item.convex_parts) for item in found]),
        "copies": np.array([len(item.copies) for item in found]),
        "key": words([item.key for item in found]),
    }


def refused_rows(path: Path) -> Iterator[Part]:
    """Rows of table refused."""
    with open_artifact(path) as artifact:
        found = [message for _, message in artifact.messages(RefusedMesh)]
    same = ("source", "reason", "remedy")
    yield {name: words([getattr(item, name) for item in found]) for name in same}


def scene_rows(path: Path) -> Iterator[Part]:
    """Rows of table scenes."""
    with open_artifact(path) as artifact:
        found = [message for _, message in artifact.messages(Scene)]
    same = ("shape_class", "distribution", "split", "renderer", "key")
    yield {
        "scene": words([scene.scene_id for scene in found]),
        **{name: words([getattr(scene, name) for scene in found]) for name in same},
        "level": np.array([scene.level for scene in found]),
        "seed": np.array([scene.seed for scene in found], dtype=np.uint64),
        "objects": np.array([len(scene.objects) for scene in found]),
        "contacts": np.array([len(from_tensor(scene.contacts)) for scene in found]),
        "settle_time_s": np.array([scene.settle_time_s for scene in found]),
        "viewpoints": np.array([len(scene.viewpoints) for scene in found]),
    }


def placed_rows(path: Path) -> Iterator[Part]:
    """Rows of table placed_objects."""
    with open_artifact(path) as artifact:
        found = [
            (scene.scene_id, placed)
            for _, scene in artifact.messages(Scene)
            for placed in scene.objects
        ]
    poses = [from_tensor(placed.world_from_object) for _, placed in found]
    yield {
        "scene": words([scene for scene, _ in found]),
        "object": words([placed.object_name for _, placed in found]),
        "body_id": np.array([placed.body_id for _, placed in found]),
        **pose_columns(np.array(poses)),
        "gap_m": np.array([placed.gap_m for _, placed in found]),
    }


def grasp_rows(path: Path) -> Iterator[Part]:
    """Rows of table grasps, a message at a time."""
    for shard, _ in whole_shards(path):
        first = 0
        with open_artifact(shard) as artifact:
            for origin, grasps in read_grasps(artifact, clouds=False):
                yield grasp_part(origin, grasps, first)
                first += len(grasps)


def grasp_part(origin: GraspOrigin, grasps: LabelledGrasps, first: int) -> Part:
    """Rows of one message of grasps, the first of which has number ``first`` in its scene."""
    rows = len(grasps)
    shape_class, _ = level_of(origin.level)
    weights, wrench = grasps.weight_summary, grasps.wrench
    return {
        "scene": one_word(origin.scene_id, rows),
        "grasp": first + np.arange(rows),
        "viewpoint": one_word(origin.viewpoint, rows),
        "level": np.full(rows, origin.level),
        "shape_class": one_word(shape_class, rows),
        "split": one_word(origin.split, rows),
        "object": Words(origin.object_names, grasps.object_index),
        "body_id": grasps.body_id,
        **pose_columns(grasps.world_from_gripper),
        "q": grasps.quality,
        "p": grasps.pressure,
        **dict(zip(("f_x", "f_y", "f_z", "tau_z"), wrench.T, strict=True)),
        "least_slack": grasps.limit_slack.min(axis=1),
        "tightest_limit": Words(origin.limit_names, grasps.limit_slack.argmin(axis=1)),
        **dict(zip(("w_least", "w_greatest", "w_deviation"), weights.T, strict=True)),
        "contact_share": grasps.contact_mask.mean(axis=1),
        "status": Words(origin.status_names, grasps.status),
        "iterations": grasps.iterations,
        "tilt_rad": grasps.tilt_rad,
        "proposal": Words(origin.proposal_names, grasps.proposal),
        "keep_probability": grasps.keep_probability,
        "touch_height_m": grasps.touch_height_m,
        "pictures": grasps.pictures,
    }


def sample_rows(path: Path) -> Iterator[Part]:
    """Rows of table samples, a message at a time."""
    for shard, split in whole_shards(path):
        with open_artifact(shard) as artifact:
            for first, message in artifact.messages(SampleBatch):
                yield sample_part(samples_of(message), tuple(message.object_names), split, first)


def sample_part(samples: Samples, object_names: tuple[str, ...], split: str, first: int) -> Part:
    """Rows of some samples, the first of which has number ``first`` in its split."""
    return {
        "split": one_word(split, len(samples)),
        "sample": first + np.arange(len(samples)),
        "object": Words(object_names, samples.object_index),
        "shape_class": Words(CLASSES, samples.shape_class),
        "level": samples.level,
        "q": samples.quality,
        "p": samples.pressure,
        "proposal_weight": samples.proposal_weight,
        "pictures": samples.pictures,
    }


def epoch_rows(path: Path) -> Iterator[Part]:
    """Rows of table epochs."""
    with open_artifact(path) as artifact:
        found = [message for _, message in artifact.messages(Epoch)]
    same = ("epoch", "train_loss", "train_mae", "val_mae", "learning_rate", "samples")
    yield {name: np.array([getattr(epoch, name) for epoch in found]) for name in same}


def attempt_rows(path: Path) -> Iterator[Part]:
    """Rows of table attempts."""
    with open_artifact(path) as artifact:
        found = [_attempt_figures(message) for _, message in artifact.messages(Attempt)]
    texts = ("scene", "policy", "outcome", "cause", "object", "judge")
    names = found[0] if found else {}
    yield {
        name: words([str(row[name]) for row in found])
        if name in texts
        else np.array([row[name] for row in found])
        for name in names
    }


def _attempt_figures(made: Attempt) -> dict[str, str | float]:
    """What a row holds of an attempt; its paths and pictures can go."""
    same = (
        *("level", "policy", "attempt", "outcome", "cause", "candidates", "seal_pressure"),
        *("lifted_height_m", "duration_s", "corrections", "regrasps", "seals", "carried_m_s2"),
        *("borne_n", "weight_n", "judge"),
    )
    return {
        "scene": made.scene_id,
        "object": made.target,
        "predicted_q": made.predicted_quality,
        "reached_q": made.reached_quality,
        **{name: getattr(made, name) for name in same},
    }


def whole_shards(index: Path) -> Iterator[tuple[Path, str]]:
    """The shards of an index, each only if it is of the making that the index tells of.

    Parameters
    ----------
    index
        The index of a sharded artifact.

    Yields
    ------
    tuple[Path, str]
        A shard and its split.

    Raises
    ------
    ArtifactError
        A shard is gone or of another making: the stage is being made anew.
    """
    key = read_provenance(index).key
    for entry in read_index(index).shards:
        shard = index.parent / entry.path
        if not shard.resolve().is_relative_to(index.parent.resolve()):
            raise ArtifactError(
                f"{index} names '{entry.path}', which leads out of its folder",
                "The index is damaged: make it again",
            )
        if not shard.is_file() or read_provenance(shard).key != key:
            raise ArtifactError(
                f"{shard} is no longer the shard that {index} tells of: stage {index.stem} is "
                "being made anew, and nobody asked for its last whole state while it was there",
                "Ask again when it is made",
            )
        yield shard, entry.split


ROWS: Mapping[str, Callable[[Path], Iterator[Part]]] = {
    "objects": object_rows,
    "refused": refused_rows,
    "scenes": scene_rows,
    "placed_objects": placed_rows,
    "grasps": grasp_rows,
    "samples": sample_rows,
    "epochs": epoch_rows,
    "attempts": attempt_rows,
}
