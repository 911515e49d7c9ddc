"""Facts of a run for its report, from provenance, summaries and a few artifacts."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.artifacts import Provenance, from_tensor, open_artifact, read_provenance
from pipeline.errors import ArtifactError
from pipeline.messages.proposed_contacts import WorstContact, worst_by_object
from pipeline.recording.proposed_contacts import WORST_EACH
from schemas.softgrip.v1.evaluation_pb2 import Attempt, LevelResult, ProposedContacts
from schemas.softgrip.v1.objects_pb2 import CatalogueObject, RefusedMesh
from schemas.softgrip.v1.training_pb2 import Epoch, TrainingResult

LICENCE_FILES = ("LICENSE", "LICENCE", "COPYING", "CITATION", "README")
LICENCE_LINES = 12  # of such a file: what a card has room for


@dataclass(frozen=True)
class ObjectFacts:
    """One object of the catalogue, without its meshes."""

    name: str
    shape_class: str
    split: str
    nsvr: float
    extent_m: float
    mass_kg: float
    faces: int
    source: str


@dataclass(frozen=True)
class CatalogueFacts:
    """The objects of a run, and what was refused: (source, reason)."""

    objects: tuple[ObjectFacts, ...]
    refused: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class TrainingFacts:
    """The curve by epoch, and the calibration by tenth of q-hat: (q-hat, q, count) of each."""

    train_mae: tuple[float, ...]
    val_mae: tuple[float, ...]
    calibration: tuple[tuple[float, float, int], ...]


def read_summary(path: Path) -> dict[str, Any] | None:
    """A stage's headline figures; None where it was not made.

    Parameters
    ----------
    path
        runs/<run>/<stage>.summary.json.

    Returns
    -------
    The figures by name, or None.

    Raises
    ------
    ArtifactError
        The file is damaged.
    """
    try:
        summary = json.loads(path.read_text())
    except FileNotFoundError:
        return None
    except ValueError as error:
        raise ArtifactError(f"{path} is damaged ({error})", "Make the stage again") from error
    if not isinstance(summary, dict):
        raise ArtifactError(f"{path} is no summary", "Make the stage again")
    return summary


def read_catalogue(path: Path) -> CatalogueFacts:
    """Facts of every object of an objects artifact."""
    with open_artifact(path) as artifact:
        objects = [
            ObjectFacts(
                name=message.name,
                shape_class=message.shape_class,
                split=message.split,
                nsvr=message.nsvr,
                extent_m=message.extent_m,
                mass_kg=message.mass_kg,
                faces=message.mesh.faces.shape[0],
                source=message.source,
            )
            for _, message in artifact.messages(CatalogueObject)
        ]
        refused = [(m.source, m.reason) for _, m in artifact.messages(RefusedMesh)]
    return CatalogueFacts(tuple(objects), tuple(refused))


def read_training(path: Path) -> TrainingFacts:
    """Curve and calibration of a train artifact; tenths without a grasp are left out."""
    with open_artifact(path) as artifact:
        epochs = [message for _, message in artifact.messages(Epoch)]
        rows = from_tensor(artifact.one(TrainingResult).calibration)
    return TrainingFacts(
        train_mae=tuple(epoch.train_mae for epoch in epochs),
        val_mae=tuple(epoch.val_mae for epoch in epochs),
        calibration=tuple((p, q, int(n)) for p, q, n in rows if np.isfinite([p, q]).all()),
    )


def read_worst(path: Path, split: str, ordered: Sequence[str]) -> dict[str, list[WorstContact]]:
    """Worst contacts of the worst objects in an evaluate artifact.

    Parameters
    ----------
    path
        The artifact.
    split
        Whose objects.
    ordered
        Objects by falling error.

    Returns
    -------
    Object → its worst contacts, in that order; those of which none was kept are left out.
    """
    with open_artifact(path) as artifact:
        messages = [message for _, message in artifact.messages(ProposedContacts)]
    found = worst_by_object(messages, split, WORST_EACH)
    return {name: found[name] for name in ordered if name in found}


def read_success(path: Path) -> dict[str, dict[int, LevelResult]]:
    """Policy → level → result, the run's own policy first, its baselines after it."""
    found: dict[str, dict[int, LevelResult]] = {}
    with open_artifact(path) as artifact:
        for _, result in artifact.messages(LevelResult, "/levels"):
            found.setdefault(result.policy, {})[result.level] = result
    return found


def read_failures(path: Path, policy: str, at_most: int) -> list[Attempt]:
    """Failed attempts of a policy in an evaluate artifact, of every cause in turn."""
    by_cause: dict[str, list[Attempt]] = {}
    with open_artifact(path) as artifact:
        for _, attempt in artifact.messages(Attempt):
            if attempt.outcome != "lifted" and attempt.policy == policy:
                by_cause.setdefault(attempt.cause, []).append(attempt)
    chosen: list[Attempt] = []
    while len(chosen) < at_most and any(by_cause.values()):
        for cause in sorted(by_cause):
            if by_cause[cause] and len(chosen) < at_most:
                chosen.append(by_cause[cause].pop(0))
    return chosen


def read_origins(paths: list[Path]) -> list[Provenance]:
    """The provenance of each artifact that there is."""
    return [read_provenance(path) for path in paths if path.is_file()]


def licence_of_folder(folder: Path) -> tuple[str, str] | None:
    """Name and first lines of the file that states the licence of a mesh folder; or None."""
    if not folder.is_dir():
        return None
    files = sorted(path for path in folder.iterdir() if path.is_file())
    for stem in LICENCE_FILES:
        for path in files:
            if path.stem.upper() == stem:
                lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
                return path.name, "\n".join(lines[:LICENCE_LINES])
    return None
