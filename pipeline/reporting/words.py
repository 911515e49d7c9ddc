"""Sentences of a report: its headline, its meshes, and parts that do not belong together."""

from collections.abc import Iterable
from typing import Any

from pipeline.artifacts import Provenance
from pipeline.artifacts.digests import MEMO, content_digests
from pipeline.config import RunConfig
from pipeline.execution import RunFolder
from pipeline.reporting.facts import CatalogueFacts, licence_of_folder


def headline(summaries: dict[str, dict[str, Any] | None]) -> str:
    """The run in a sentence, from its stages' summaries."""
    parts = []
    if grasps := summaries["grasps"]:
        parts.append(f"{grasps['grasps']} labelled grasps on {grasps['objects']} objects")
    if train := summaries["train"]:
        parts.append(
            f"mean \\|q̂ − q\\| {train['test_mae']:.3f} on held-out objects "
            f"(mean predictor {train['mean_predictor_mae']:.3f})"
        )
    if evaluate := summaries["evaluate"]:
        levels = evaluate["success_by_level"].values()
        lifted, attempts = (sum(r[key] for r in levels) for key in ("lifted", "attempts"))
        parts.append(f"{lifted} of {attempts} attempts lifted an object in closed loop")
    return "; ".join(parts) + "." if parts else "Objects alone so far."


def mixed_parts(
    folder: RunFolder, provenance: list[Provenance], stages: Iterable[str]
) -> list[str]:
    """Name the parts that were made from another version of an artifact than the present one."""
    there = {path.name: path for path in map(folder.artifact, stages) if path.is_file()}
    now = content_digests(there, folder.state(MEMO))
    return [
        f"{origin.stage} was made from another {used.path}"
        for origin in provenance
        for used in origin.inputs
        if now.get(used.path, used.sha256) != used.sha256
    ]


def describe_meshes(
    folder: RunFolder, config: RunConfig, catalogue: CatalogueFacts
) -> tuple[str, str, str]:
    """Where the meshes are from, their licence in a line, and what their folder says of it."""
    embedded = sum(item.source == "parametric" for item in catalogue.objects)
    if embedded == len(catalogue.objects):
        return "softgrip's embedded parametric objects", "Apache-2.0, with softgrip", ""
    meshes = config.dataset.meshes or f"{len(catalogue.objects) - embedded} mesh files"
    if embedded:
        meshes += f", and {embedded} of softgrip's embedded objects"
    if config.dataset.licence:
        return meshes, config.dataset.licence, ""
    mesh_dir = folder.noted_mesh_dir
    found = licence_of_folder(mesh_dir) if mesh_dir else None
    if found is None:
        return meshes, "not stated: set dataset.licence in run.toml", ""
    name, text = found
    return meshes, f"see {name} of the mesh folder, below", text
