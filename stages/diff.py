"""`make diff A=run B=run`: what differs between two runs, and what of it is due to chance.

In ``runs/<A>/diff-<B>``: diff.md, diff.html, diff.rrd, diff.summary.json.
"""

import hashlib
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from loguru import logger

from pipeline.artifacts import publish_bytes, read_provenance
from pipeline.errors import ConfigError
from pipeline.execution import RunFolder, generator, run_command
from pipeline.recording.diff import blueprint, show_diff
from pipeline.recording.recording import OwnRecording, recording
from pipeline.reporting.differences import (
    CHANCE,
    Distance,
    Labels,
    error_change,
    label_distances,
    part_of,
)
from pipeline.reporting.page import html_page, markdown_page
from pipeline.reporting.plots import compared_histograms
from pipeline.reporting.two_runs import (
    Side,
    config_changes,
    made_otherwise,
    object_changes,
    read_side,
    sizes_bytes,
)
from pipeline.reporting.verdict import success_changes, verdict
from stages.graph import RUNS_DIR, STAGES

NAME = "diff"
TENTHS = 10  # of [0, 1], as in all other pictures of labels
WIDE_GROUPS = ("all", "class", "level")  # looked at one by one in the recording


def diff(
    a: Annotated[str, typer.Option("--a", envvar="A", help="name of a run")],
    b: Annotated[str, typer.Option("--b", envvar="B", help="name of the other run")],
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
) -> None:
    """Compare two runs, to runs/<A>/diff-<B>."""
    if a == b:
        raise ConfigError(f"A and B are both {a}", "Name two runs")
    names = tuple(STAGES)
    sides = tuple(read_side(RunFolder(runs_dir / name), names) for name in (a, b))
    facts = compared(sides[0], sides[1])
    into = sides[0].folder.path / f"{NAME}-{b.replace('/', '-')}"
    text = markdown_page("diff.md.jinja", facts | {"figure": lambda name: f"{name}.svg"})
    files = {}
    if facts["distances"]:
        files["labels.svg"] = compared_histograms(label_counts(sides)).encode()
    pages = {
        "diff.md": text.encode(),
        "diff.html": html_page(text, f"{a} and {b}", files).encode(),
        "diff.summary.json": (json.dumps(summary(facts), indent=1) + "\n").encode(),
        **files,
    }
    for name, data in pages.items():
        publish_bytes(into / name, data)
    draw(sides[0], sides[1], facts, text, into)
    sys.stdout.write(facts["verdict"] + "\n")
    logger.info("diff: {}", into / "diff.html")


def compared(a: Side, b: Side) -> dict[str, Any]:
    """Everything that the page tells, by the names of its template."""
    distances: list[Distance] = []
    if a.labels is not None and b.labels is not None:
        distances = label_distances(a.labels, b.labels, lambda name: generator(0, NAME, name))
    common = sorted(a.error.keys() & b.error.keys())
    errors = error_change([a.error[n] for n in common], [b.error[n] for n in common])
    success = success_changes(a, b)
    names = tuple(STAGES)
    return {
        "a": a,
        "b": b,
        "config": config_changes(a.config, b.config),
        "otherwise": made_otherwise(a.folder, b.folder, names),
        "objects": object_changes(a, b),
        "distances": distances,
        "errors": errors,
        "by_object": sorted(
            ((n, a.error[n], b.error[n]) for n in common), key=lambda row: row[1] - row[2]
        ),
        "success": success,
        "chance": CHANCE,
        "stages": names,
        "sizes": (sizes_bytes(a.folder, names), sizes_bytes(b.folder, names)),
        "verdict": verdict(distances, errors.p if errors else None, success),
    }


def summary(facts: dict[str, Any]) -> dict[str, Any]:
    """The comparison for scripts."""
    return {
        "a": facts["a"].folder.path.name,
        "b": facts["b"].folder.path.name,
        "verdict": facts["verdict"],
        "configuration": {name: [mine, other] for name, mine, other in facts["config"]},
        "made_otherwise": facts["otherwise"],
        "objects": vars(facts["objects"]),
        "labels": {d.group: {"distance": d.distance, "p": d.p} for d in facts["distances"]},
        "errors": vars(facts["errors"]) if facts["errors"] else None,
        "success": {row.policy: {"rates": row.rates, "p": row.p} for row in facts["success"]},
    }


def tenths(labels: Labels) -> np.ndarray:
    """Share of labels by tenth of q, shape (10,)."""
    counts, _ = np.histogram(labels.quality, TENTHS, (0.0, 1.0))
    shares: np.ndarray = counts / counts.sum()
    return shares


def label_counts(sides: Sequence[Side]) -> dict[str, list[int]]:
    """Name of a run → its labels by tenth of q; runs without labels are left out."""
    return {
        side.folder.path.name: np.histogram(side.labels.quality, TENTHS, (0.0, 1.0))[0].tolist()
        for side in sides
        if side.labels is not None
    }


def draw(a: Side, b: Side, facts: dict[str, Any], text: str, into: Path) -> None:
    """The recording: both side by side."""
    histograms, words = {}, {}
    for one in facts["distances"]:
        grouping, _, value = one.group.partition(" ")
        if grouping not in WIDE_GROUPS:
            continue
        sides = []
        for labels in (a.labels, b.labels):
            if labels is None:
                continue
            own = labels
            if value:
                own = part_of(labels, labels.groups[grouping].astype(str) == value)
            sides.append(tenths(own))
        histograms[one.group] = (sides[0], sides[1])
        said = "chance may explain it" if one.is_chance else "more than chance"
        words[one.group] = f"**{one.group}**: distance {one.distance:.4f}, {said}"
    errors = ([row[1] for row in facts["by_object"]], [row[2] for row in facts["by_object"]])
    rates = tuple([row.rates[side] for row in facts["success"]] for side in (0, 1))
    recorded = OwnRecording(NAME, into / "diff.rrd", identity(a, b))
    there = {"labels": histograms, "error": errors[0], "success": rates[0]}
    shown = [quantity for quantity, values in there.items() if values]
    with recording(recorded, blueprint([s.folder.path.name for s in (a, b)], shown)) as stream:
        show_diff(stream, histograms, words, errors, (rates[0], rates[1]), text)


def identity(a: Side, b: Side) -> str:
    """What the viewer knows a comparison by: another one of the same objects opens beside it."""
    runs = []
    for side in (a, b):
        made = [path for name in STAGES if (path := side.folder.artifact(name)).is_file()]
        runs.append([str(side.folder.path), *(read_provenance(path).key for path in made)])
    return hashlib.sha256(json.dumps(runs).encode()).hexdigest()


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "svg")
    run_command(diff)
