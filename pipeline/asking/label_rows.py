"""Labelled grasps and samples → the columns of `schemas.tables`, a message at a time; no cloud."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pipeline.artifacts import open_artifact, read_provenance
from pipeline.artifacts.sharding import place_of, read_index
from pipeline.asking.columns import Part, Words, one_word
from pipeline.asking.poses import pose_columns
from pipeline.clutter.levels import level_of
from pipeline.errors import ArtifactError
from pipeline.geometry.shape import ShapeClass
from pipeline.labelling.grasps import GraspOrigin, LabelledGrasps
from pipeline.messages.grasps import read_grasps
from pipeline.messages.samples import samples_of
from pipeline.network.samples import Samples
from schemas.softgrip.v1.samples_pb2 import SampleBatch

CLASSES = tuple(str(shape_class) for shape_class in ShapeClass)


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
        A shard is gone or of another making: the stage is being made anew; or it lies elsewhere.
    """
    key = read_provenance(index).key
    for entry in read_index(index).shards:
        shard = place_of(index, entry)
        if not shard.is_file() or read_provenance(shard).key != key:
            raise ArtifactError(
                f"{shard} is no longer the shard that {index} tells of: stage {index.stem} is "
                "being made anew, and nobody asked for its last whole state while it was there",
                "Ask again when it is made",
            )
        yield shard, entry.split
