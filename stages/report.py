"""`make report`: a run on one page, from its artifacts and summaries alone."""

import os
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import typer
from loguru import logger

from pipeline.artifacts import Provenance, open_artifact, package_version, publish_bytes
from pipeline.config import RunConfig, load_run_config
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder, run_command
from pipeline.execution.freshness import content_digests
from pipeline.messages.objects import read_objects
from pipeline.reporting import plots
from pipeline.reporting.facts import (
    CatalogueFacts,
    licence_of_folder,
    read_catalogue,
    read_failures,
    read_origins,
    read_success,
    read_summary,
    read_training,
)
from pipeline.reporting.failures import failure_picture
from pipeline.reporting.page import html_page, markdown_page
from schemas.softgrip.v1.evaluation_pb2 import LevelResult
from schemas.softgrip.v1.scenes_pb2 import Scene
from stages.graph import MADE, RUNS_DIR, SWEEP

GOALS = {"evaluate": "eval"}  # what `make` calls a stage, where it is another word
FAILURES = 8
FIGURES = "report"


def make_report(folder: RunFolder) -> Path:
    """Write ``report.html``, which needs no other file, and ``report.md`` with ``report/``.

    Raises
    ------
    ArtifactError : the run has not even its objects.
    """
    run = folder.path.name
    config = load_run_config(folder.config)
    names = list(MADE)
    summaries = {name: read_summary(folder.summary(name)) for name in names}
    if summaries["objects"] is None:
        raise ArtifactError(
            f"{folder.summary('objects')} is missing", f"Make it first: make dataset RUN={run}"
        )
    catalogue = read_catalogue(folder.artifact("objects"))
    success = read_success(folder.artifact("evaluate")) if summaries["evaluate"] else {}
    files = figures_of(folder, summaries, catalogue, success)
    failures = failures_of(folder, config, next(iter(success)), files) if success else []
    provenance = read_origins([folder.artifact(name) for name in names])
    meshes, licence, licence_text = words_on_meshes(folder, config, catalogue)
    title = config.dataset.title or f"softgrip, run {run}"
    text = markdown_page(
        "report.md.jinja",
        {
            **{name: summaries[name] for name in names},
            "title": title,
            "run": run,
            "version": package_version(),
            "headline": headline(summaries),
            "provenance": provenance,
            "mixed": mixed_parts(folder, provenance),
            "missing": [(n, GOALS.get(n, n)) for n in names if summaries[n] is None],
            "catalogue": catalogue,
            "classes": dict(sorted(Counter(o.shape_class for o in catalogue.objects).items())),
            "splits": dict(Counter(o.split for o in catalogue.objects)),
            "levels": sorted(config.scenes.levels),
            "meshes": meshes,
            "licence": licence,
            "licence_text": licence_text,
            "figures": {Path(path).stem for path in files},
            "figure": lambda name: f"{FIGURES}/{name}.svg",
            "not_yet": lambda what, goal: f"Not made yet: `make {goal} RUN={run}`.",
            "success": success,
            "overall": overall_rates(summaries["evaluate"]),
            "comparisons": (summaries["evaluate"] or {}).get("comparisons", {}),
            "failures": failures,
            "timings": {name: found for name, found in summaries.items() if found},
            "shards_key": next((p.key[:12] for p in provenance if p.stage == "shards"), "none"),
        },
    )
    for path, data in files.items():
        publish_bytes(folder.path / path, data)
    publish_bytes(folder.path / "report.md", text.encode())
    page = folder.path / "report.html"
    publish_bytes(page, html_page(text, title, files).encode())
    return page


def headline(summaries: dict[str, dict[str, Any] | None]) -> str:
    """The run in a sentence."""
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


def mixed_parts(folder: RunFolder, provenance: list[Provenance]) -> list[str]:
    """What was made from another state of an artifact than the one that lies there now."""
    there = {path.name: path for path in map(folder.artifact, MADE) if path.is_file()}
    now = content_digests(there, folder.state("hashes.json"))
    return [
        f"{origin.stage} was made from another {used.path}"
        for origin in provenance
        for used in origin.inputs
        if now.get(used.path, used.sha256) != used.sha256
    ]


def words_on_meshes(
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
    place = folder.state("mesh_dir")
    mesh_dir = place.read_text() if place.is_file() else ""
    found = licence_of_folder(Path(mesh_dir)) if mesh_dir else None
    if found is None:
        return meshes, "not stated: set dataset.licence in run.toml", ""
    name, text = found
    return meshes, f"see {name} of the mesh folder, below", text


def figures_of(
    folder: RunFolder,
    summaries: dict[str, dict[str, Any] | None],
    catalogue: CatalogueFacts,
    success: dict[str, dict[int, LevelResult]],
) -> dict[str, bytes]:
    """Path in the run → SVG of every figure that the run has numbers for."""
    nsvr = {item.name: item.nsvr for item in catalogue.objects}
    classes = {item.name: item.shape_class for item in catalogue.objects}
    svg = {"nsvr": plots.nsvr_scale(nsvr, classes)}
    if shards := summaries["shards"]:
        svg["labels"] = plots.label_histogram(shards["quality_histogram"])
    if train := summaries["train"]:
        facts = read_training(folder.artifact("train"))
        svg["curve"] = plots.training_curve(
            facts.train_mae, facts.val_mae, train["best_epoch"], train["mean_predictor_mae"]
        )
        predicted, true, count = zip(*facts.calibration, strict=True)
        svg["calibration"] = plots.calibration(predicted, true, count)
    if sweep := summaries[SWEEP.name]:
        members = [
            plots.TrainedMember(
                channels=tuple(network["channels"]),
                layers=network["layers"],
                error=network["test_mae"],
                ms_a_grasp=network["ms_a_grasp"],
                chosen=network["chosen"],
            )
            for network in sweep["networks"]
            if network["group"] == "family"
        ]
        svg["fig-1"] = plots.fig_1(members, sweep["budget"]["mean_predictor_mae"])
    if success:
        svg["success"] = plots.success_by_level(rates(success))
    svg["timings"] = plots.wall_times(
        {name: found["wall_time_s"] for name, found in summaries.items() if found}
    )
    return {f"{FIGURES}/{name}.svg": text.encode() for name, text in svg.items()}


def overall_rates(evaluate: dict[str, Any] | None) -> dict[str, Any]:
    """Policy → its figures over all levels, where several were evaluated."""
    return {policy: row(r) for policy, r in (evaluate or {}).get("policies", {}).items()}


def row(figures: dict[str, Any]) -> dict[str, Any]:
    """A rate with the ends of its interval by name."""
    low, high = figures["interval_95"]
    return {**figures, "low": low, "high": high}


def rates(results: dict[str, dict[int, LevelResult]]) -> dict[str, dict[int, plots.Rate]]:
    """Policy → level → rate and interval."""
    return {
        policy: {
            level: plots.Rate(r.success_rate, r.interval_low, r.interval_high)
            for level, r in by_level.items()
        }
        for policy, by_level in results.items()
    }


def failures_of(
    folder: RunFolder, config: RunConfig, policy: str, files: dict[str, bytes]
) -> list[dict[str, Any]]:
    """Some failed attempts of a policy; their pictures are added to ``files``."""
    objects = {name: item for name, (item, _) in read_objects(folder.artifact("objects")).items()}
    with open_artifact(folder.artifact("scenes")) as artifact:
        names = {
            scene.scene_id: tuple(placed.object_name for placed in scene.objects)
            for _, scene in artifact.messages(Scene)
        }
    found = []
    for number, attempt in enumerate(read_failures(folder.artifact("evaluate"), policy, FAILURES)):
        bodies, radius = names[attempt.scene_id], config.gripper.pad.radius_m
        jpeg = failure_picture(attempt, bodies, objects, config.scenes, radius)
        path = f"{FIGURES}/failure-{number}.jpg" if jpeg else ""
        if jpeg:
            files[path] = jpeg
        found.append(
            {
                "cause": attempt.cause,
                "scene_id": attempt.scene_id,
                "number": attempt.attempt,
                "target": attempt.target or "nothing",
                "predicted": attempt.predicted_quality,
                "reached": attempt.reached_quality,
                "pressure": attempt.seal_pressure,
                "picture": path,
            }
        )
    return found


def report(
    run: Annotated[str, typer.Option(envvar="RUN", help="name of the run")] = "default",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
) -> None:
    """Write a run's report: report.html, which needs no other file, and report.md."""
    logger.info("report: {}", make_report(RunFolder(runs_dir / run)))


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "svg")
    run_command(report)
