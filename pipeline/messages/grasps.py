"""Labelled grasps ↔ softgrip.v1.GraspBatch and CloudBatch, shown pads ↔ softgrip.v1.DrapedPads."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import accumulate
from pathlib import Path

import numpy as np

from pipeline.artifacts.reading import Artifact, open_artifact
from pipeline.artifacts.sharding import is_current
from pipeline.artifacts.tensors import set_tensors, tensors_of
from pipeline.artifacts.writing import ArtifactWriter
from pipeline.errors import ArtifactError, ContentError
from pipeline.labelling.grasps import GraspOrigin, LabelledGrasps
from pipeline.labelling.shown_pads import ShownPads
from pipeline.messages.clouds import cloud_batch, clouds_beside, with_clouds, write_apart
from schemas.softgrip.v1.clouds_pb2 import CloudBatch
from schemas.softgrip.v1.grasps_pb2 import DrapedPads, GraspBatch

# What each array is stored as; the field names are those of the message.
STORED_AS = {
    "object_index": "u2",
    "body_id": "u2",
    "world_from_gripper": "f8",
    "quality": "f8",
    "pressure": "f8",
    "wrench": "f8",
    "limit_slack": "f8",
    "weight_summary": "f8",
    "contact_mask": "u1",
    "status": "u1",
    "iterations": "u1",
    "tilt_rad": "f4",
    "proposal": "u1",
    "keep_probability": "f4",
    "touch_height_m": "f8",
    "pictures": "u1",
}
SHAPES = {
    **dict.fromkeys(STORED_AS, "n"),
    "world_from_gripper": "n 4 4",
    "wrench": "n 4",
    "limit_slack": "n k",
    "weight_summary": "n 3",
    "contact_mask": "n v",
}
# What the fields hold that v1 did not have from the start.
UNLESS_THERE = {"pictures": 1}


PADS_STORED_AS = {"grasp": "u4", "height_m": "f4", "pressure": "f4"}
PADS_SHAPES = {"grasp": "k", "height_m": "k v", "pressure": "k t"}


TOPIC, PADS_TOPIC = "/grasps", "/pads"

GraspMessage = tuple[GraspBatch, CloudBatch]


def write_grasps(
    artifact: ArtifactWriter,
    batches: Sequence[tuple[GraspOrigin, LabelledGrasps]],
    size: int,
    rounded: bool,
    key: str = "",
) -> int:
    """Write the grasps of a scene, and apart from them their clouds.

    Parameters
    ----------
    artifact
        The shard.
    batches
        The grasps by viewpoint.
    size
        Most grasps in a message.
    rounded
        Whether clouds may be rounded to steps.
    key
        Digest of what the grasps rest on.

    Returns
    -------
    How many grasps were written.
    """
    return write_messages(artifact, grasp_messages(batches, size, rounded, key))


def grasp_messages(
    batches: Sequence[tuple[GraspOrigin, LabelledGrasps]], size: int, rounded: bool, key: str
) -> list[GraspMessage]:
    """The messages of a portion of a scene's grasps.

    Parameters
    ----------
    batches
        The grasps by viewpoint.
    size
        Most grasps in a message.
    rounded
        Whether clouds may be rounded to steps.
    key
        Digest of what the portion rests on.

    Returns
    -------
    Rows, and their clouds.
    """
    return [
        (grasp_batch(origin, part, key), cloud_batch(part.cloud, part.cloud_mask, rounded))
        for origin, grasps in batches
        for start in range(0, len(grasps), size)
        for part in [grasps.rows(start, min(start + size, len(grasps)))]
    ]


def write_messages(artifact: ArtifactWriter, messages: Sequence[GraspMessage]) -> int:
    """Write rows, each at the number of its first grasp, and apart from them their clouds.

    Parameters
    ----------
    artifact
        The shard.
    messages
        Rows and their clouds, in order.

    Returns
    -------
    How many grasps were written.
    """
    counts = [rows.quality.shape[0] for rows, _ in messages]
    starts = list(accumulate(counts, initial=0))[:-1]
    rows = [(at, rows) for at, (rows, _) in zip(starts, messages, strict=True)]
    clouds = [(at, clouds) for at, (_, clouds) in zip(starts, messages, strict=True)]
    write_apart(artifact, TOPIC, rows, clouds)
    return sum(counts)


def portions_by_key(folder: Path, besides: str = "") -> dict[str, Path]:
    """Which shard holds which portion of grasps; no cloud is read.

    Parameters
    ----------
    folder
        Of the shards.
    besides
        Key of shards that are left out: those that stay as they are.

    Returns
    -------
    Key of each portion → the shard that holds it.
    """
    found: dict[str, Path] = {}
    for shard in sorted(folder.glob("*.mcap")):
        if besides and is_current(shard, besides):
            continue
        with suppress(ArtifactError), open_artifact(shard) as artifact:  # such are made anew
            found |= {rows.key: shard for _, rows in artifact.messages(GraspBatch) if rows.key}
    return found


def read_portion(shard: Path, key: str) -> list[GraspMessage]:
    """The messages of one portion of grasps; none where the shard does not hold it any more."""
    with suppress(ArtifactError), open_artifact(shard) as artifact:  # made anew
        pairs = with_clouds(artifact, GraspBatch)
        return [(rows, clouds) for rows, clouds in pairs if rows.key == key and clouds]
    return []


def read_grasps(
    artifact: Artifact, clouds: bool = True
) -> Iterator[tuple[GraspOrigin, LabelledGrasps]]:
    """The grasps of a shard, message by message.

    Parameters
    ----------
    artifact
        A shard of stage grasps, of any version.
    clouds
        Whether clouds are read; if not, they have no cells.

    Yields
    ------
    tuple[GraspOrigin, LabelledGrasps]
        Where the grasps are from, and the grasps.
    """
    if clouds:
        for message, batch in with_clouds(artifact, GraspBatch):
            yield grasps_of(message, batch)
    else:
        for _, message in artifact.messages(GraspBatch):
            yield grasps_of(message)


def grasp_batch(origin: GraspOrigin, grasps: LabelledGrasps, key: str = "") -> GraspBatch:
    """The message of some grasps, their clouds left out."""
    message = GraspBatch(
        key=key,
        scene_id=origin.scene_id,
        viewpoint=origin.viewpoint,
        level=origin.level,
        split=origin.split,
        object_names=origin.object_names,
        limit_names=origin.limit_names,
        status_names=origin.status_names,
        proposal_names=origin.proposal_names,
        pad_vertices=grasps.contact_mask.shape[1],
    )
    packed = {"contact_mask": np.packbits(grasps.contact_mask, axis=1)}
    set_tensors(message, vars(grasps) | packed, STORED_AS)
    return message


def grasps_of(
    message: GraspBatch, clouds: CloudBatch | None = None
) -> tuple[GraspOrigin, LabelledGrasps]:
    """The grasps of a message: views of its bytes wherever possible.

    Parameters
    ----------
    message
        Of a shard of stage grasps.
    clouds
        The message of their clouds; without it clouds that lie apart have no cells.

    Returns
    -------
    Where the grasps are from, and the grasps.

    Raises
    ------
    ContentError
        a tensor is missing, or they do not fit together.
    """
    arrays = tensors_of(message, STORED_AS, SHAPES, UNLESS_THERE)
    if arrays["contact_mask"].shape[1] != -(-message.pad_vertices // 8):
        raise ContentError(f"A contact mask is not of {message.pad_vertices} pad vertices")
    if (arrays["object_index"] >= len(message.object_names)).any():
        raise ContentError("A grasp is of an object that has no name")
    arrays["contact_mask"] = np.unpackbits(
        arrays["contact_mask"], axis=1, count=message.pad_vertices
    ).view(bool)
    rows = len(arrays["quality"])
    arrays["cloud"], arrays["cloud_mask"] = clouds_beside(message, clouds, rows)
    origin = GraspOrigin(
        scene_id=message.scene_id,
        viewpoint=message.viewpoint,
        level=message.level,
        split=message.split,
        object_names=tuple(message.object_names),
        limit_names=tuple(message.limit_names),
        status_names=tuple(message.status_names),
        proposal_names=tuple(message.proposal_names),
    )
    return origin, LabelledGrasps(**arrays)


def pads_message(pads: ShownPads) -> DrapedPads:
    """The message of some pads."""
    message = DrapedPads()
    set_tensors(message, vars(pads), PADS_STORED_AS)
    return message


def pads_of(message: DrapedPads) -> ShownPads:
    """The pads of a message. Raises ContentError where its tensors do not fit together."""
    return ShownPads(**tensors_of(message, PADS_STORED_AS, PADS_SHAPES))
