"""Stage 1, objects: meshes in → repaired, rescaled, classed by NSVR, cut into convex parts."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from loguru import logger

from pipeline.artifacts import publish_bytes
from pipeline.artifacts.named_inputs import FAMILIES_FILE, MASSES_FILE
from pipeline.config import section_digest
from pipeline.errors import MeshError
from pipeline.execution import (
    Allowance,
    Isolation,
    Lost,
    StageContext,
    Summary,
    generator,
    progress,
    stage_command,
)
from pipeline.execution.items import item_key, object_key, objects_basis
from pipeline.execution.left_out import LeftOut
from pipeline.geometry.catalogue import CatalogueObject, MeasuredObject
from pipeline.geometry.families import DeclaredFamily, read_declared
from pipeline.geometry.intake import (
    Source,
    all_sources,
    files_of,
    finished_or_why_not,
    measured_or_why_not,
    with_all_files,
)
from pipeline.geometry.masses import mass_of, read_masses
from pipeline.geometry.plan import Plan, plan_catalogue
from pipeline.geometry.random_solids.catalogued import (
    solid_names,
    solid_or_why_not,
    solids_for_training,
)
from pipeline.geometry.selection import Split
from pipeline.geometry.settled import SETTLED_FILE, read_settled
from pipeline.geometry.stretching import stretched_for_training
from pipeline.messages.objects import objects_by_key, write_objects
from schemas.softgrip.v1.objects_pb2 import RefusedMesh
from stages.graph import OBJECTS, inputs_of


def build(stage: StageContext) -> Summary:
    """Turn meshes into the object catalogue: repair, rescale, NSVR, convex parts, split."""
    config, seed = stage.config.objects, stage.config.seed
    jobs, added = sources(stage)
    settled_in = stage.folder.state(SETTLED_FILE)
    planned = partial(
        plan_catalogue,
        added=added,
        declared=declared_families(stage),
        configs=(config, stage.config.split),
        seed=seed,
        settled=read_settled(settled_in, settling_basis(stage)),
    )
    left_out, most = LeftOut(), Allowance(config.max_seconds, config.max_memory_mib)
    former = objects_by_key(stage.output)
    with (
        stage.lending(stage.mesh_dir, files_of(jobs)),
        Isolation(stage.workers, most, stage.executor, stage.store) as apart,
    ):
        measured = measure(stage, jobs, apart, left_out)
        plan, objects = finish(stage, measured, planned, apart, left_out, former)
        solids = random_solids(stage, plan, apart, left_out, former)
    for source, why in plan.left_out:
        left_out.add(source, why)
    rng_of = partial(generator, seed, "object")
    threshold = stage.config.split.family_threshold
    solids, solids_near = solids_for_training(solids, plan, threshold)
    objects += solids
    stretched, near = stretched_for_training(objects, plan, config, rng_of, threshold)
    objects += [replace(item, key=item_key(item.key, copy=item.name)) for item in stretched]
    split: dict[str, Split] = dict.fromkeys((item.name for item in objects), "train")
    split |= plan.split
    publish_bytes(settled_in, plan.settled.to_json().encode())
    for remark in plan.remarks:
        logger.warning("{}", remark)
    made_by = stage.provenance(left_out.cut_short)
    write_objects(stage.output, made_by, objects, split, left_out.refused)
    figures = {"stretched_near_held_out": near, "solids_near_held_out": solids_near, **plan.figures}
    taken_over = sum(item.key in former for item in objects[: len(objects) - len(stretched)])
    figures |= {"taken_over": taken_over, "made": len(objects) - taken_over}
    figures |= {"items_basis": objects_basis(stage.key, stage.config)}
    return summary(objects, split, left_out.refused) | figures


def settling_basis(stage: StageContext) -> str:
    """What settled splits rest on: with another seed or way of splitting, all are split anew."""
    return section_digest(stage.config, ("seed", "split", "objects.embedded_in_training"))


def declared_families(stage: StageContext) -> tuple[DeclaredFamily, ...]:
    """The families that run.toml's file, or else the mesh folder's, declares."""
    return read_declared(path) if (path := stage.inputs.get(FAMILIES_FILE)) else ()


def sources(stage: StageContext) -> tuple[list[Source], frozenset[str]]:
    """Every source, and the names of the embedded ones that meshes are trained beside."""
    config = stage.config.objects
    paths = [path for name, path in stage.inputs.items() if name.startswith("meshes/")]
    found, added = all_sources(paths, stage.mesh_dir, config.embedded_in_training)
    named = with_all_files(found, stage.mesh_dir, config) if stage.works_from_store else found
    return named, added


def measure(
    stage: StageContext, jobs: list[Source], apart: Isolation, left_out: LeftOut
) -> list[MeasuredObject]:
    """Load, repair and measure every source; what is refused is named, the others go on."""
    job = partial(measured_or_why_not, config=stage.config.objects, folder=stage.mesh_dir)
    shown = progress(apart.run_in_order(job, jobs), len(jobs), "objects: repair and NSVR", "mesh")
    return left_out.sifted([job.label for job in jobs], shown)


def random_solids(
    stage: StageContext,
    plan: Plan,
    apart: Isolation,
    left_out: LeftOut,
    former: Mapping[str, CatalogueObject],
) -> list[CatalogueObject]:
    """Solids drawn from the seed; their shapes are nobody's. Those made before are taken over."""
    config, cache = stage.config.objects, stage.folder.cache / "convex_parts"
    basis = objects_basis(stage.key, stage.config)
    keys = {n: item_key(basis, solid=n) for n in solid_names(config, plan.measured)}
    names = [name for name, key in keys.items() if key not in former]
    job = partial(solid_or_why_not, config=config, cache=cache)
    results = apart.run_in_order(job, [(n, generator(stage.config.seed, n)) for n in names])
    shown = progress(results, len(names), "objects: random solids", "solid")
    made = {keys[i.name]: replace(i, key=keys[i.name]) for i in left_out.sifted(names, shown)}
    there = {**former, **made}
    return [there[key] for key in keys.values() if key in there]


def finish(
    stage: StageContext,
    measured: list[MeasuredObject],
    planned: Callable[[Sequence[MeasuredObject]], Plan],
    apart: Isolation,
    left_out: LeftOut,
    former: Mapping[str, CatalogueObject],
) -> tuple[Plan, list[CatalogueObject]]:
    """Size, weigh and cut into convex parts what is taken; plan anew without what cannot be cut.

    What was finished before, by its key, is taken over.
    """
    config, cache = stage.config.objects, stage.folder.cache / "convex_parts"
    job = partial(finished_or_why_not, config=config, cache=cache)
    rng_of = partial(generator, stage.config.seed, "object")
    masses = read_masses(path) if (path := stage.inputs.get(MASSES_FILE)) else {}
    key_of = partial(object_key, objects_basis(stage.key, stage.config), masses=masses)
    plan, done = planned(measured), dict(former)
    while todo := [item for item in plan.taken if key_of(item) not in done]:
        drawn = [(i, rng_of(i.content), mass_of(i.source.name, masses)) for i in todo]
        results = apart.run_in_order(job, drawn)
        shown = progress(results, len(todo), "objects: convex parts", "object")
        failed = set()
        for item, result in zip(todo, shown, strict=True):
            if isinstance(result, MeshError | Lost):
                left_out.add(item.origin, result)
                failed.add(item.origin)
            else:
                done[key_of(item)] = replace(result, key=key_of(item))
        if failed:
            measured = [item for item in measured if item.origin not in failed]
            plan = planned(measured)
    of, copies = plan.families.of, plan.copies
    made = [done[key_of(item)] for item in plan.taken]
    return plan, [replace(i, family=of[i.name], copies=copies.get(i.name, ())) for i in made]


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
    from pipeline.recording.objects import draw_objects  # not in workers: they draw nothing

    stage_command(OBJECTS, build, inputs_of, draw=draw_objects)
