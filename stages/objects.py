"""Stage 1, objects: meshes in → repaired, rescaled, classed by NSVR, cut into convex parts."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from loguru import logger

from pipeline.artifacts import ArtifactWriter, publish_bytes
from pipeline.config import ObjectsConfig, section_digest
from pipeline.errors import MeshError
from pipeline.execution import (
    StageContext,
    Summary,
    generator,
    progress,
    run_in_order,
    stage_command,
)
from pipeline.geometry.catalogue import (
    CatalogueObject,
    MeasuredObject,
    finish_object,
    measure_object,
)
from pipeline.geometry.families import DeclaredFamily, read_declared
from pipeline.geometry.masses import mass_of, read_masses
from pipeline.geometry.mesh_folders import FAMILIES_FILE, MASSES_FILE
from pipeline.geometry.object_names import readable_name
from pipeline.geometry.parametric import PARAMETRIC_OBJECTS, parametric_source
from pipeline.geometry.plan import Plan, plan_catalogue
from pipeline.geometry.selection import Split
from pipeline.geometry.settled import SETTLED_FILE, read_settled
from pipeline.geometry.stretching import stretched_for_training
from pipeline.geometry.urdf_files import load_object_file, standalone
from pipeline.messages.objects import REFUSED_TOPIC, TOPIC, object_message, refused_message
from pipeline.recording.objects import draw_objects
from schemas.softgrip.v1.objects_pb2 import RefusedMesh
from stages.graph import OBJECTS, inputs_of

Source = tuple[Path | None, str]  # a mesh file and its path in its folder, or an embedded name


def build(stage: StageContext) -> Summary:
    """Turn meshes into the object catalogue: repair, rescale, NSVR, convex parts, split."""
    config, seed = stage.config.objects, stage.config.seed
    jobs, added = sources(stage)
    measured, refused = measure(stage, jobs)
    settled_in = stage.folder.state(SETTLED_FILE)
    settled = read_settled(settled_in, settling_basis(stage))
    plan = plan_catalogue(
        measured, added, declared_families(stage), (config, stage.config.split), seed, settled
    )
    refused += [told(source, why) for source, why in plan.left_out]
    objects = finish(stage, plan)
    rng_of = partial(generator, seed, "object")
    threshold = stage.config.split.family_threshold
    stretched, near = stretched_for_training(objects, plan, config, rng_of, threshold)
    objects += stretched
    split = plan.split | dict.fromkeys((item.name for item in stretched), "train")
    publish_bytes(settled_in, plan.settled.to_json().encode())
    for remark in plan.remarks:
        logger.warning("{}", remark)
    publish(stage, objects, split, refused)
    return summary(objects, split, refused) | {"stretched_near_held_out": near, **plan.figures}


def settling_basis(stage: StageContext) -> str:
    """What settled splits rest on: with another seed or way of splitting, all are split anew."""
    sections = ("seed", "split", "objects.embedded_in_training")
    return section_digest(stage.config, sections)


def declared_families(stage: StageContext) -> tuple[DeclaredFamily, ...]:
    """The families that run.toml's file, or else the mesh folder's, declares."""
    path = stage.inputs.get(FAMILIES_FILE)
    return read_declared(path) if path else ()


def sources(stage: StageContext) -> tuple[list[Source], frozenset[str]]:
    """Every source, and the names of the embedded ones that meshes are trained beside.

    Raises MeshError where a mesh has the name of an embedded object that would stand beside it.
    """
    embedded: list[Source] = [(None, name) for name in sorted(PARAMETRIC_OBJECTS)]
    folder = stage.mesh_dir
    if folder is None:
        return embedded, frozenset()
    paths = [path for name, path in stage.inputs.items() if name.startswith("meshes/")]
    meshes: list[Source] = [
        (path, path.relative_to(folder).as_posix()) for path in standalone(paths, folder)
    ]
    if not stage.config.objects.embedded_in_training:
        return meshes, frozenset()
    for path, label in meshes:
        if readable_name(label) in PARAMETRIC_OBJECTS:
            raise MeshError(
                f"{path} has the name of an embedded object",
                "Rename the file, or set objects.embedded_in_training = false",
            )
    return meshes + embedded, frozenset(PARAMETRIC_OBJECTS)


def measure(
    stage: StageContext, jobs: list[Source]
) -> tuple[list[MeasuredObject], list[RefusedMesh]]:
    """Load, repair and measure every source; what is refused is named, the others go on."""
    job = partial(measured_or_why_not, config=stage.config.objects, folder=stage.mesh_dir)
    results = run_in_order(job, jobs, stage.workers, stage.executor)
    measured, refused = [], []
    shown = progress(results, len(jobs), "objects: repair and NSVR", "mesh")
    for (_, name), result in zip(jobs, shown, strict=True):
        if isinstance(result, MeshError):
            refused.append(told(name, result))
        else:
            measured.append(result)
    return measured, refused


def told(name: str, why: MeshError) -> RefusedMesh:
    """The record of a source that is left out, and a word to the reader."""
    logger.warning("left out: {}", why)
    return refused_message(name, why)


def measured_or_why_not(
    job: Source, config: ObjectsConfig, folder: Path | None
) -> MeasuredObject | MeshError:
    """One source measured, or why it cannot be."""
    path, name = job
    try:
        if path is None or folder is None:
            return measure_object(parametric_source(name), config)
        return measure_object(load_object_file(path, folder, name, config), config)
    except MeshError as error:
        return error


def finish(stage: StageContext, plan: Plan) -> list[CatalogueObject]:
    """Bring every object that is taken to its size, and cut it into convex parts."""
    cache = stage.folder.cache / "convex_parts"
    path = stage.inputs.get(MASSES_FILE)
    masses = read_masses(path) if path else {}
    config, seed = stage.config.objects, stage.config.seed
    job = partial(finished, config=config, seed=seed, cache=cache, masses=masses)
    results = run_in_order(job, plan.taken, stage.workers, stage.executor)
    shown = progress(results, len(plan.taken), "objects: convex parts", "object")
    of, copies = plan.families.of, plan.copies
    return [replace(item, family=of[item.name], copies=copies.get(item.name, ())) for item in shown]


def finished(
    measured: MeasuredObject,
    config: ObjectsConfig,
    seed: int,
    cache: Path,
    masses: Mapping[str, float],
) -> CatalogueObject:
    """Rescale one object, weigh it and cut it into convex parts."""
    rng = generator(seed, "object", measured.content)
    return finish_object(measured, config, rng, cache, mass_of(measured.source.name, masses))


def publish(
    stage: StageContext,
    objects: list[CatalogueObject],
    split: Mapping[str, Split],
    refused: list[RefusedMesh],
) -> None:
    """Write the artifact."""
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        for index, item in enumerate(objects):
            artifact.write(TOPIC, object_message(item, split[item.name]), log_time_ns=index)
        for index, message in enumerate(refused):
            artifact.write(REFUSED_TOPIC, message, log_time_ns=index)


def summary(
    objects: list[CatalogueObject], split: Mapping[str, Split], refused: list[RefusedMesh]
) -> Summary:
    """The stage's headline figures."""
    return {
        "objects": len(objects),
        "by_class": dict(sorted(Counter(str(item.shape_class) for item in objects).items())),
        "by_split": dict(sorted(Counter(split.values()).items())),
        "families": len({item.family for item in objects}),
        "transparent": sorted(item.name for item in objects if item.material == "transparent"),
        "copies": {item.name: list(item.copies) for item in objects if item.copies},
        "repaired": sum(bool(item.repairs) for item in objects),
        "nsvr": {item.name: round(item.nsvr, 6) for item in objects},
        "left_out": [{"source": r.source, "reason": r.reason, "remedy": r.remedy} for r in refused],
    }


if __name__ == "__main__":
    stage_command(OBJECTS, build, inputs_of, draw=draw_objects)
