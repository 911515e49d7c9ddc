"""How much of a stage's work is there already and is taken over when the stage is made again."""

from collections.abc import Callable, Collection, Mapping
from typing import Any

from pipeline.artifacts import open_artifact
from pipeline.clutter.levels import clutter_ids
from pipeline.clutter.settled import CLUTTERS_FILE, read_settled_clutters
from pipeline.errors import SoftgripError
from pipeline.execution.items import grasps_basis, objects_basis, scenes_basis
from pipeline.execution.running import read_summary
from pipeline.execution.stage import StageContext
from pipeline.execution.staleness import built_key
from pipeline.geometry.catalogue import EMBEDDED
from schemas.softgrip.v1.objects_pb2 import CatalogueObject

# Stages whose items have keys of their own, in order, and what all items of each rest on.
BASIS_OF = {"objects": objects_basis, "scenes": scenes_basis, "grasps": grasps_basis}
BASIS = "items_basis"  # in a stage's summary
ContextOf = Callable[[str], StageContext]


def taken_over(stage: str, context_of: ContextOf, work: float) -> float:
    """How much of a stage's work will be taken over from its former artifact, about.

    Parameters
    ----------
    stage
        Name of the stage.
    context_of
        The context of a stage, as things are now.
    work
        How much work the whole stage is, by `work_of`.

    Returns
    -------
    Objects, clutters or grasps, at most all of the work; 0 for other stages, and where settings,
    program or packages changed that all items rest on.
    """
    if stage not in BASIS_OF:
        return 0.0
    names = list(BASIS_OF)[: 1 + list(BASIS_OF).index(stage)]
    try:
        contexts = [context_of(name) for name in names]
        if not all(map(_basis_stays, contexts)):
            return 0.0
        former = read_summary(contexts[-1].folder, stage)
        if stage == "objects":
            return min(work * _share_known(contexts[0]), float(former["objects"]), work)
        clutters = _clutters_kept(contexts[0], contexts[1])
        return float(clutters) if stage == "scenes" else _grasps_kept(contexts[2], former, clutters)
    except (SoftgripError, KeyError):
        return 0.0  # never made so far, or by a program that did not say so


def _basis_stays(context: StageContext) -> bool:
    summary = read_summary(context.folder, context.name)
    now = BASIS_OF[context.name](context.key, context.config)
    return context.output.is_file() and summary.get(BASIS) == now


def _share_known(objects: StageContext) -> float:
    """Share of today's mesh files that the catalogue was made from; 1 of the embedded set."""
    built = built_key(objects.folder, objects.name)
    before = set(built.inputs.values()) if built else set()
    meshes = _meshes(objects)
    return sum(digest in before for digest in meshes) / len(meshes) if meshes else 1.0


def _meshes(objects: StageContext) -> list[str]:
    inputs = objects.key.inputs
    return [digest for name, digest in inputs.items() if name.startswith("meshes/")]


def _clutters_kept(objects: StageContext, scenes: StageContext) -> int:
    """Clutters of today whose members are all there."""
    basis = scenes_basis(scenes.key, scenes.config)
    settled = read_settled_clutters(scenes.folder.state(CLUTTERS_FILE), basis)
    meshes = {*_meshes(objects), EMBEDDED}
    with open_artifact(objects.output) as artifact:
        found = [item for _, item in artifact.messages(CatalogueObject)]
    there = {item.key for item in found if item.source_sha256 in meshes}
    wanted = _wanted_clutters(scenes)
    return sum(
        scene_id in wanted and there.issuperset(clutter.members)
        for scene_id, clutter in settled.clutters.items()
    )


def _wanted_clutters(scenes: StageContext) -> Collection[str]:
    config = scenes.config.scenes
    return {
        scene_id
        for level in config.levels
        for split in config.splits
        for scene_id in clutter_ids(level, split, getattr(config.clutters_per_level, split))
    }


def _grasps_kept(grasps: StageContext, former: Mapping[str, Any], clutters: int) -> float:
    """Grasps in portions of today's size, on clutters that are kept."""
    had = int(former["taken_over"] + former["made"])
    size = float(former["grasps"]) / had
    today = grasps.config.grasps.of_scenes(max(len(_wanted_clutters(grasps)), 1))[0]
    if abs(today[0] - size) >= 1.0:
        return 0.0
    return size * clutters * min(len(today), had // int(former["scenes"]))
