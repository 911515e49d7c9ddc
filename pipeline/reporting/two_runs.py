"""What a comparison of two runs reads of either, and what differs between them."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.artifacts.sharding import listed_shards
from pipeline.config import RunConfig, load_run_config
from pipeline.config.written import as_toml
from pipeline.control.success import Outcome
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from pipeline.execution.freshness import Key
from pipeline.execution.staleness import built_key
from pipeline.housekeeping.listing import disk_use_bytes
from pipeline.messages.grasps import read_grasps
from pipeline.messages.samples import samples_of
from pipeline.reporting.differences import Labels
from pipeline.reporting.facts import CatalogueFacts, read_catalogue, read_summary
from schemas.softgrip.v1.evaluation_pb2 import Attempt
from schemas.softgrip.v1.objects_pb2 import CatalogueObject
from schemas.softgrip.v1.samples_pb2 import SampleBatch
from schemas.softgrip.v1.scenes_pb2 import Scene
from schemas.softgrip.v1.training_pb2 import TrainingResult

MOST_NAMED = 3  # of what differs in a part of a key: a cell of a table has room for no more
Clutter = tuple[str, tuple[str, ...]]  # its name and the objects that lie in it


@dataclass(frozen=True)
class Side:
    """One of the two runs.

    Attributes
    ----------
    folder
        Its files.
    config
        Its configuration.
    catalogue
        Its objects.
    content
        Object → what tells its surface apart: digest of its source, scale, stretch.
    labels
        Its labels; None where no grasps were made.
    error
        Object of the test split → mean |q̂ − q|, averaged over the symmetries.
    outcomes
        Policy → clutter → attempts; policies in their order.
    summaries
        Stage → headline figures.
    """

    folder: RunFolder
    config: RunConfig
    catalogue: CatalogueFacts
    content: dict[str, tuple[object, ...]]
    labels: Labels | None
    error: dict[str, float]
    outcomes: dict[str, dict[Clutter, Outcome]]
    summaries: dict[str, dict[str, Any]]


def read_side(folder: RunFolder, stages: tuple[str, ...]) -> Side:
    """Read one of the two runs, as far as it was made.

    Parameters
    ----------
    folder
        The run.
    stages
        Names of all stages, in the order of the pipeline.

    Returns
    -------
    What is compared.

    Raises
    ------
    ArtifactError
        The run has no objects, or a file of it is damaged.
    """
    objects = folder.artifact("objects")
    if not objects.is_file():
        name = folder.path.name
        raise ArtifactError(f"{objects} is missing", f"Make it first: make dataset RUN={name}")
    catalogue = read_catalogue(objects)
    scenes = read_clutters(folder.artifact("scenes"))
    return Side(
        folder=folder,
        config=load_run_config(folder.config),
        catalogue=catalogue,
        content=read_content(objects),
        labels=read_labels(folder.artifact("grasps"), catalogue, scenes),
        error=read_errors(folder),
        outcomes=read_outcomes(folder.artifact("evaluate"), scenes),
        summaries={name: read_summary(folder.summary(name)) or {} for name in stages},
    )


def read_content(objects: Path) -> dict[str, tuple[object, ...]]:
    """Object → what its surface was made from."""
    with open_artifact(objects) as artifact:
        return {
            m.name: (m.source_sha256, m.scale, m.stretch.data, m.split, m.shape_class)
            for _, m in artifact.messages(CatalogueObject)
        }


def read_clutters(scenes: Path) -> dict[str, tuple[int, Clutter]]:
    """Name of a scene → its level and the clutter that it is; empty where none was made."""
    if not scenes.is_file():
        return {}
    with open_artifact(scenes) as artifact:
        return {
            m.scene_id: (m.level, (m.scene_id, tuple(sorted(o.object_name for o in m.objects))))
            for _, m in artifact.messages(Scene)
        }


def read_labels(
    grasps: Path, catalogue: CatalogueFacts, scenes: Mapping[str, tuple[int, Clutter]]
) -> Labels | None:
    """The labels of a run with class, level and object of each; None where none was made."""
    if not grasps.is_file():
        return None
    shape_class = {item.name: item.shape_class for item in catalogue.objects}
    quality, clutter, names, levels = [], [], [], []
    numbers = {name: number for number, name in enumerate(scenes)}
    for shard in listed_shards(grasps):
        with open_artifact(shard) as artifact:
            for origin, found in read_grasps(artifact):
                quality.append(found.quality)
                names.append(np.array(origin.object_names)[found.object_index])
                clutter.append(np.full(len(found), numbers[origin.scene_id]))
                levels.append(np.full(len(found), scenes[origin.scene_id][0]))
    if not quality:
        return None
    objects = np.concatenate(names)
    return Labels(
        np.concatenate(quality),
        np.concatenate(clutter),
        {
            "class": np.array([shape_class[name] for name in objects.tolist()]),
            "level": np.concatenate(levels),
            "object": objects,
        },
    )


def read_errors(folder: RunFolder) -> dict[str, float]:
    """Object of the test split → mean |q̂ − q| of the run's own network; empty without one.

    The training's result holds predictions in the order of the test shards' samples.
    """
    train, shards = folder.artifact("train"), folder.artifact("shards")
    if not (train.is_file() and shards.is_file()):
        return {}
    with open_artifact(train) as artifact:
        result = artifact.one(TrainingResult)
        predicted, told = from_tensor(result.test_prediction), from_tensor(result.test_quality)
    names, quality = [], []
    for shard in listed_shards(shards, ["test"]):
        with open_artifact(shard) as artifact:
            for _, message in artifact.messages(SampleBatch):
                samples = samples_of(message)
                names.append(np.array(list(message.object_names))[samples.object_index])
                quality.append(samples.quality)
    if not quality or not np.array_equal(np.concatenate(quality), told):
        return {}  # trained on other shards than those that lie there now
    objects, error = np.concatenate(names), np.abs(predicted - told)
    return {name: float(error[objects == name].mean()) for name in np.unique(objects).tolist()}


def read_outcomes(
    evaluate: Path, scenes: Mapping[str, tuple[int, Clutter]]
) -> dict[str, dict[Clutter, Outcome]]:
    """Policy → clutter → how many attempts lifted; empty where none was made."""
    found: dict[str, dict[Clutter, Outcome]] = {}
    if not evaluate.is_file():
        return found
    with open_artifact(evaluate) as artifact:
        for _, attempt in artifact.messages(Attempt):
            own = found.setdefault(attempt.policy, {})
            clutter = scenes[attempt.scene_id][1]
            before = own.get(clutter, Outcome(0, 0))
            lifted = attempt.outcome == "lifted"
            own[clutter] = Outcome(before.lifted + lifted, before.attempts + 1)
    return found


def config_changes(ours: RunConfig, theirs: RunConfig) -> list[tuple[str, str, str]]:
    """Field, value here, value there, of every field of the configuration that differs."""
    mine, other = (_flat(tomllib.loads(as_toml(config))) for config in (ours, theirs))
    return [
        (name, str(mine.get(name, "")), str(other.get(name, "")))
        for name in sorted(mine.keys() | other.keys())
        if mine.get(name) != other.get(name)
    ]


def _flat(tree: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in tree.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{name}.")
        else:
            flat[prefix + name] = value
    return flat


def made_otherwise(ours: RunFolder, theirs: RunFolder, stages: tuple[str, ...]) -> dict[str, str]:
    """Stage → what of its code, versions and inputs differs, in words; without equal stages."""
    found = {}
    for stage in stages:
        mine, other = built_key(ours, stage), built_key(theirs, stage)
        if mine is None or other is None:
            lacking = ours if mine is None else theirs
            if (mine is None) != (other is None):
                found[stage] = f"not made in {lacking.path.name}"
        elif mine.digest != other.digest:
            found[stage] = "; ".join(
                change
                for word in ("configuration", "code", "input", "machine")
                for change in part_changes(word, _part(mine, word), _part(other, word))
            )
    return found


def part_changes(word: str, mine: Mapping[str, str], other: Mapping[str, str]) -> list[str]:
    """Name what differs between two parts of keys, some of many.

    Parameters
    ----------
    word
        What the part's names are.
    mine
        Name → digest, of A.
    other
        The same, of B.

    Returns
    -------
    At most three sentences: what differs, what is in A alone, what is in B alone.
    """
    groups = {
        "of other content": [name for name in mine if name in other and mine[name] != other[name]],
        "in A alone": [name for name in mine if name not in other],
        "in B alone": [name for name in other if name not in mine],
    }
    found = []
    for how, names in groups.items():
        more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        if names:
            found.append(f"{word} {', '.join(names[:MOST_NAMED])}{more} {how}")
    return found


def _part(key: Key, word: str) -> Mapping[str, str]:
    return {
        "configuration": key.config,
        "code": key.code,
        "input": key.inputs,
        "machine": key.machine,
    }[word]


@dataclass(frozen=True)
class ObjectChanges:
    """Objects that came, went, and that have one name and another content."""

    come: list[str]
    gone: list[str]
    changed: list[str]


def object_changes(ours: Side, theirs: Side) -> ObjectChanges:
    """Compare two catalogues, seen from ours: what theirs has beside it has come."""
    mine, other = ours.content, theirs.content
    return ObjectChanges(
        come=sorted(other.keys() - mine.keys()),
        gone=sorted(mine.keys() - other.keys()),
        changed=sorted(name for name in mine.keys() & other.keys() if mine[name] != other[name]),
    )


def sizes_bytes(folder: RunFolder, stages: tuple[str, ...]) -> dict[str, int]:
    """Stage → bytes of its artifact and shards [bytes]."""
    return {
        name: disk_use_bytes(folder.artifact(name)) + disk_use_bytes(folder.shards(name))
        for name in stages
    }
