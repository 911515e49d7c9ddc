"""Lineage as a picture: mesh → object → scene → grasp → sample → network → attempt.

Each box has its count and its size on disk, and leads to its recording, or to a table where no
recording shows it. The picture is SVG with links, which a page shows inside itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from pipeline.execution import RunFolder
from pipeline.geometry.catalogue import EMBEDDED
from pipeline.housekeeping.listing import disk_use_bytes, size_in_words
from pipeline.reporting.facts import CatalogueFacts
from pipeline.reporting.tables import SOURCES

# Of a box and the arrow behind it, in pixels of a page 54 rem wide.
BOX_WIDTH, BOX_HEIGHT, ARROW = 104, 62, 18
LINES = (20, 37, 53)  # baselines of a box's three lines, below its top, in pixels
# Stage → what it makes.
NAMES = {
    "objects": "objects",
    "scenes": "scenes",
    "grasps": "grasps",
    "shards": "samples",
    "train": "network",
    "evaluate": "attempts",
}
MARGIN = 2  # room for half of the outline, in pixels


@dataclass(frozen=True)
class Step:
    """One box of the lineage.

    Attributes
    ----------
    name
        What it holds, in the plural.
    count
        How many, in words.
    size_bytes
        On disk [bytes].
    link
        File of the run that shows it: its recording, else its table.
    """

    name: str
    count: str
    size_bytes: int
    link: str


def lineage_of(
    folder: RunFolder,
    summaries: dict[str, dict[str, Any] | None],
    catalogue: CatalogueFacts,
    table: Callable[[str], str],
) -> list[Step]:
    """The steps of a run as far as it was made.

    Parameters
    ----------
    folder
        The run.
    summaries
        Stage → headline figures; None where it was not made.
    catalogue
        The objects and what was refused.
    table
        Name of a step → path of its table, for a step without a recording.

    Returns
    -------
    The steps in the order of the pipeline.
    """
    files = {item.name if item.source == EMBEDDED else item.source for item in catalogue.objects}
    found = len(files | {name for name, _ in catalogue.refused})
    meshes = folder.noted_mesh_dir
    there = [meshes / name for name in files if (meshes / name).is_file()] if meshes else []
    size = sum(path.stat().st_size for path in there)
    steps = [Step(SOURCES, str(found), size, table(SOURCES))]
    for stage, name in NAMES.items():
        if (summary := summaries.get(stage)) is None:
            continue
        size = disk_use_bytes(folder.artifact(stage)) + disk_use_bytes(folder.shards(stage))
        recording = folder.recording(stage)
        link = recording.name if recording.is_file() else table(name)
        steps.append(Step(name, counted(stage, summary), size, link))
    return steps


def counted(stage: str, summary: dict[str, Any]) -> str:
    """How many a stage made, in words."""
    if stage == "shards":
        return str(sum(summary["samples"].values()))
    if stage == "train":
        return f"{summary['parameters']} weights"
    return str(summary[NAMES[stage]])


def lineage_svg(steps: Sequence[Step]) -> str:
    """The boxes from left to right with arrows between them, as SVG with links.

    Parameters
    ----------
    steps
        What is drawn, in order.

    Returns
    -------
    One ``<svg>`` element.
    """
    pitch = BOX_WIDTH + ARROW
    width = len(steps) * pitch - ARROW + 2 * MARGIN
    height = BOX_HEIGHT + 2 * MARGIN
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'width="{width}" height="{height}" role="img" aria-label="Lineage of the run" '
        'font-family="DejaVu Sans, Arial, sans-serif" font-size="11" text-anchor="middle">'
    ]
    for number, step in enumerate(steps):
        x = MARGIN + number * pitch
        parts.append(_box(step, x))
        if number + 1 < len(steps):
            y = MARGIN + BOX_HEIGHT / 2
            start, end = x + BOX_WIDTH, x + pitch
            head = f"M{end - 7} {y - 4}L{end - 1} {y}L{end - 7} {y + 4}"
            parts.append(f'<path d="M{start} {y}H{end - 5}{head}" fill="none" stroke="#666"/>')
    return "".join([*parts, "</svg>"])


def _box(step: Step, x: float) -> str:
    """One box, inside a link where it has one."""
    middle = x + BOX_WIDTH / 2
    size = size_in_words(step.size_bytes) if step.size_bytes else ""
    words = "".join(
        f'<text x="{middle}" y="{MARGIN + y}" fill="{colour}"{weight}>{escape(text)}</text>'
        for y, text, colour, weight in zip(
            LINES,
            (step.name, step.count, size),
            ("#0072b2" if step.link else "#1a1a1a", "#1a1a1a", "#666"),
            (' font-weight="bold"', "", ""),
            strict=True,
        )
    )
    box = (
        f'<rect x="{x}" y="{MARGIN}" width="{BOX_WIDTH}" height="{BOX_HEIGHT}" rx="5" '
        f'fill="#f4f8fb" stroke="#0072b2"/>{words}'
    )
    return f'<a href="{escape(step.link)}">{box}</a>' if step.link else box
