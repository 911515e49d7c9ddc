"""Logged attempts, of a robot or of a simulation, and the contacts that were tried in them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.artifacts.reading import open_artifact
from pipeline.artifacts.tensors import from_tensor
from pipeline.errors import ArtifactError
from pipeline.network.outcomes import TriedContacts
from schemas.softgrip.v1.evaluation_pb2 import Attempt


def read_attempts(files: Sequence[Path]) -> list[Attempt]:
    """All attempts of files, in order.

    Parameters
    ----------
    files
        Of stages robot and evaluate.

    Returns
    -------
    The messages, at least one.

    Raises
    ------
    ArtifactError
        A file is missing or damaged, or there is no attempt in any.
    """
    found: list[Attempt] = []
    for path in files:
        with open_artifact(path) as artifact:
            found += [attempt for _, attempt in artifact.messages(Attempt)]
    if not found:
        raise ArtifactError(
            f"{', '.join(map(str, files))} hold no attempt", "Make some: make robot, or make eval"
        )
    return found


def tried_contacts(attempts: Sequence[Attempt]) -> TriedContacts:
    """The contacts that were sealed in attempts.

    Parameters
    ----------
    attempts
        Of one gripper.

    Returns
    -------
    Every contact, at least one, in order.

    Raises
    ------
    ArtifactError
        None was sealed, an older program logged them, or their grids or pads differ.
    """
    radii = {attempt.pad_radius_m for attempt in attempts}
    if radii == {0.0}:
        raise ArtifactError(
            "the attempts keep no tried contacts: an older program logged them", "Make them again"
        )
    if len(radii) > 1:
        told = ", ".join(f"{1e3 * radius_m:g}" for radius_m in sorted(radii))
        raise ArtifactError(
            f"the attempts are of pads of {told} mm", "Compare those of one gripper at a time"
        )
    contacts = [one for attempt in attempts for one in attempt.contacts]
    if not contacts:
        raise ArtifactError(
            f"in none of {len(attempts)} attempts was a contact sealed",
            "Look at their causes: nothing was seen, reached or touched",
        )
    clouds = [from_tensor(one.cloud) for one in contacts]
    if len({cloud.shape for cloud in clouds}) > 1:
        raise ArtifactError("the attempts' clouds differ in size", "Compare those of one run")
    return TriedContacts(
        cloud=np.array(clouds),
        mask=np.array([from_tensor(one.cloud_mask) for one in contacts]).astype(bool),
        predicted=np.array([one.predicted_quality for one in contacts]),
        lifted=np.array([one.lifted for one in contacts], dtype=bool),
    )
