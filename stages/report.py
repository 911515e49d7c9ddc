"""`make report`: a run on one page, from its artifacts and summaries alone."""

import os
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.artifacts import package_version, publish_bytes
from pipeline.config import load_run_config
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder, run_command
from pipeline.network.fitted_baselines import SUMMARY_NAMES, TITLES
from pipeline.reporting.agreement import as_markdown
from pipeline.reporting.facts import read_catalogue, read_origins, read_success, read_summary
from pipeline.reporting.failures import failures_of
from pipeline.reporting.figures import figures_of, overall_rates, proposed_tables
from pipeline.reporting.lineage import lineage_of, lineage_svg
from pipeline.reporting.page import html_page, markdown_page
from pipeline.reporting.seals import seals_figure, seals_of
from pipeline.reporting.tables import table_pages
from pipeline.reporting.words import describe_meshes, headline, mixed_parts
from stages.graph import MADE, RUNS_DIR

GOALS = {"evaluate": "eval"}  # what `make` calls a stage, where it is another word
FAILURES = 8  # as many as a page has room for
SEALS_EACH = 3  # of seals that held, and of those that did not
LINEAGE = "lineage"
FIGURES = "report"  # folder of the pictures, beside the page


def make_report(folder: RunFolder) -> Path:
    """Write ``report.html``, which needs no other file, and ``report.md`` with ``report/``.

    Parameters
    ----------
    folder
        The run.

    Returns
    -------
    The HTML page.

    Raises
    ------
    ArtifactError
        The run has not even its objects.
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
    referee = read_summary(RunFolder(folder.path / "referee").summary("referee"))
    figures = figures_of(folder, summaries, catalogue, success, referee)
    steps = lineage_of(folder, summaries, catalogue, lambda step: f"{FIGURES}/{step}.html")
    figures[LINEAGE] = lineage_svg(steps)
    failures, pictures = (
        failures_of(folder, config, next(iter(success)), FAILURES) if success else ([], {})
    )
    if success and (seals := seals_of(folder, config, next(iter(success)), SEALS_EACH)):
        figures["seals"] = seals_figure(seals, config)
    provenance = read_origins([folder.artifact(name) for name in names])
    meshes, licence, licence_text = describe_meshes(folder, config, catalogue)
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
            "mixed": mixed_parts(folder, provenance, names),
            "missing": [(n, GOALS.get(n, n)) for n in names if summaries[n] is None],
            "catalogue": catalogue,
            "baselines": {SUMMARY_NAMES[kind]: title for kind, title in TITLES.items()},
            "classes": dict(sorted(Counter(o.shape_class for o in catalogue.objects).items())),
            "splits": dict(Counter(o.split for o in catalogue.objects)),
            "levels": sorted(config.scenes.levels),
            "meshes": meshes,
            "licence": licence,
            "licence_text": licence_text,
            "figures": set(figures),
            "figure": lambda name: f"{FIGURES}/{name}.svg",
            "picture": lambda name: f"{FIGURES}/{name}",
            "not_yet": lambda what, goal: f"Not made yet: `make {goal} RUN={run}`.",
            "success": success,
            **proposed_tables(summaries["evaluate"]),
            "referee": as_markdown(referee) if referee else "",
            "overall": overall_rates(summaries["evaluate"]),
            "comparisons": (summaries["evaluate"] or {}).get("comparisons", {}),
            "failures": failures,
            "expectations": {
                name: found["expectations"]
                for name, found in summaries.items()
                if found and found.get("expectations")
            },
            "timings": {name: found for name, found in summaries.items() if found},
            "shards_key": next((p.key[:12] for p in provenance if p.stage == "shards"), "none"),
        },
    )
    files = {f"{FIGURES}/{name}.svg": svg.encode() for name, svg in figures.items()}
    files |= {f"{FIGURES}/{name}": jpeg for name, jpeg in pictures.items()}
    tables = {step.name: step.link for step in steps if step.link.startswith(FIGURES)}
    made = {name: folder.artifact(name) for name in names if folder.artifact(name).is_file()}
    for path, data in (files | table_pages(folder, made, tables)).items():
        publish_bytes(folder.path / path, data)
    publish_bytes(folder.path / "report.md", text.encode())
    page, linked = folder.path / "report.html", f"{FIGURES}/{LINEAGE}.svg"
    publish_bytes(page, html_page(text, title, files, {linked}).encode())
    return page


def report(
    run: Annotated[str, typer.Option(envvar="RUN", help="name of the run")] = "default",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
) -> None:
    """Write a run's report: report.html, which needs no other file, and report.md."""
    logger.info("report: {}", make_report(RunFolder(runs_dir / run)))


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "svg")
    run_command(report)
