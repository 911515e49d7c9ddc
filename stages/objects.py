"""Stage 1, objects: meshes in → repaired, rescaled, classed by NSVR, cut into convex parts."""

import difflib
from collections import Counter
from collections.abc import Collection
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path

from loguru import logger

from pipeline.artifacts import ArtifactWriter
from pipeline.config import ObjectsConfig
from pipeline.errors import ConfigError, MeshError
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
    stretched_copy,
)
from pipeline.geometry.mesh_folders import object_names
from pipeline.geometry.parametric import PARAMETRIC_OBJECTS, parametric_source
from pipeline.geometry.selection import choose_split, choose_subset
from pipeline.geometry.urdf_files import load_object_file, standalone
from pipeline.messages.objects import REFUSED_TOPIC, TOPIC, object_message
from pipeline.recording.objects import blueprint, show_catalogue
from pipeline.recording.recording import recording, spread
from schemas.softgrip.v1.objects_pb2 import RefusedMesh
from stages.graph import OBJECTS, inputs_of

Source = tuple[Path | None, str]  # a mesh file, or None for an embedded object, and its name


def build(stage: StageContext) -> Summary:
    """Turn meshes into the object catalogue: repair, rescale, NSVR, convex parts, split."""
    config, seed = stage.config.objects, stage.config.seed
    jobs, added = sources(stage)
    measured, refused = measure(stage, jobs)
    classes = {
        item.source.name: item.shape_class for item in measured if item.source.name not in added
    }
    if not classes:
        raise MeshError("Not one mesh could be used", "See the reasons above, or unset MESH_DIR")
    check_transparent(config, sorted({*classes, *added}))
    chosen = choose_subset(classes, config.limit, seed)
    split = choose_split({name: classes[name] for name in chosen}, stage.config.split, seed)
    split |= dict.fromkeys(added, "train")
    cache = stage.folder.cache / "convex_parts"
    finish = partial(finished, config=config, seed=seed, cache=cache)
    todo = [item for item in measured if item.source.name in split]
    results = run_in_order(finish, todo, stage.workers, stage.executor)
    objects = list(progress(results, len(todo), "objects: convex parts", "object"))
    copies = stretched_copies(
        [item for item in objects if split[item.name] == "train"], config, seed
    )
    check_names(copies, split)
    objects += copies
    split |= dict.fromkeys((item.name for item in copies), "train")
    publish(stage, objects, dict(split), refused)
    return summary(objects, dict(split), refused)


def sources(stage: StageContext) -> tuple[list[Source], frozenset[str]]:
    """Every source, and the names of the embedded ones that meshes are trained beside.

    Raises MeshError where a mesh has the name of an embedded object that would stand beside it.
    """
    embedded: list[Source] = [(None, name) for name in sorted(PARAMETRIC_OBJECTS)]
    folder = stage.mesh_dir
    if folder is None:
        return embedded, frozenset()
    paths = [path for name, path in stage.inputs.items() if name.startswith("meshes/")]
    names = object_names(standalone(paths, folder), folder)
    meshes: list[Source] = [(path, name) for path, name in names.items()]
    if not stage.config.objects.embedded_in_training:
        return meshes, frozenset()
    for path, name in names.items():
        if name in PARAMETRIC_OBJECTS:
            raise MeshError(
                f"{path} has the name of an embedded object",
                "Rename the file, or set objects.embedded_in_training = false",
            )
    return meshes + embedded, frozenset(PARAMETRIC_OBJECTS)


def check_transparent(config: ObjectsConfig, names: list[str]) -> None:
    """Raise ConfigError for a pattern of ``objects.transparent`` that no object has."""
    for pattern in config.transparent:
        if not any(fnmatchcase(name, pattern) for name in names):
            near = difflib.get_close_matches(pattern, names, n=3) or names[:3]
            raise ConfigError(
                f"objects.transparent names {pattern!r}, and no object is called so",
                f"Names are, for instance: {', '.join(near)}",
            )


def measure(
    stage: StageContext, jobs: list[Source]
) -> tuple[list[MeasuredObject], list[RefusedMesh]]:
    """Load, repair and measure every source; what is refused is named, the others go on."""
    job = partial(measured_or_refused, config=stage.config.objects, folder=stage.mesh_dir)
    results = run_in_order(job, jobs, stage.workers, stage.executor)
    measured, refused = [], []
    for result in progress(results, len(jobs), "objects: repair and NSVR", "mesh"):
        if isinstance(result, RefusedMesh):
            logger.warning("left out: {}. {}", result.reason, result.remedy)
            refused.append(result)
        else:
            measured.append(result)
    return measured, refused


def measured_or_refused(
    job: Source, config: ObjectsConfig, folder: Path | None
) -> MeasuredObject | RefusedMesh:
    """One source measured, or why it cannot be."""
    path, name = job
    try:
        if path is None or folder is None:
            return measure_object(parametric_source(name), config)
        return measure_object(load_object_file(path, folder, name, config), config)
    except MeshError as error:
        return RefusedMesh(source=name, reason=error.what, remedy=error.remedy)


def finished(
    measured: MeasuredObject, config: ObjectsConfig, seed: int, cache: Path
) -> CatalogueObject:
    """Rescale one object and cut it into convex parts."""
    return finish_object(measured, config, generator(seed, "object", measured.source.name), cache)


def stretched_copies(
    items: list[CatalogueObject], config: ObjectsConfig, seed: int
) -> list[CatalogueObject]:
    """As many further shapes of each object as are asked for."""
    return [
        stretched_copy(item, name, config, generator(seed, "object", name))
        for item in items
        for name in (f"{item.name}-stretched-{k + 1}" for k in range(config.stretched_copies))
    ]


def check_names(copies: list[CatalogueObject], taken: Collection[str]) -> None:
    """Raise MeshError where a copy's name is that of an object."""
    for item in copies:
        if item.name in taken:
            raise MeshError(
                f"A mesh is named {item.name}, as a stretched copy would be", "Rename its file"
            )


def publish(
    stage: StageContext,
    objects: list[CatalogueObject],
    split: dict[str, str],
    refused: list[RefusedMesh],
) -> None:
    """Write the recording, then the artifact: what is there last makes the stage whole."""
    shown = [objects[i] for i in spread(len(objects), stage.config.recording.objects)]
    opening = blueprint(len(shown), max(item.nsvr for item in shown))
    with recording(stage, opening) as stream:
        show_catalogue(stream, [(item, split[item.name]) for item in shown])
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        for index, item in enumerate(objects):
            artifact.write(TOPIC, object_message(item, split[item.name]), log_time_ns=index)
        for index, message in enumerate(refused):
            artifact.write(REFUSED_TOPIC, message, log_time_ns=index)


def summary(
    objects: list[CatalogueObject], split: dict[str, str], refused: list[RefusedMesh]
) -> Summary:
    """The stage's headline figures."""
    return {
        "objects": len(objects),
        "by_class": dict(sorted(Counter(str(item.shape_class) for item in objects).items())),
        "by_split": dict(sorted(Counter(split.values()).items())),
        "transparent": sorted(item.name for item in objects if item.material == "transparent"),
        "repaired": sum(bool(item.repairs) for item in objects),
        "nsvr": {item.name: round(item.nsvr, 6) for item in objects},
        "left_out": [{"source": r.source, "reason": r.reason, "remedy": r.remedy} for r in refused],
    }


if __name__ == "__main__":
    stage_command(OBJECTS, build, inputs_of)
