"""The picture and the table of what `pipeline.benchmarks.watching` wrote down.

python -m pipeline.benchmarks.memory_picture watched.jsonl memory.svg
"""

import json
import sys
from pathlib import Path
from typing import Annotated

import matplotlib as mpl
import typer
from matplotlib.figure import Figure

from pipeline.artifacts import publish_bytes
from pipeline.benchmarks.watching import Sample, Spent
from pipeline.execution import run_command
from pipeline.reporting.plots import STYLE, WIDTH_IN, svg_text

POINTS = 400  # of a curve: more are not seen on a page, and take room


def draw(
    watched: Annotated[Path, typer.Argument(help="what watching has written, JSON lines")],
    into: Annotated[Path, typer.Argument(help="the picture, SVG")],
) -> None:
    """Draw memory over time, and print what each stage took as a table."""
    samples, spent = read_watched(watched)
    publish_bytes(into, memory_picture(samples).encode())
    sys.stdout.write(table(samples, spent))


def read_watched(path: Path) -> tuple[list[Sample], list[Spent]]:
    """The looks, and what the finished stages took."""
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    samples = [Sample(**row) for row in rows if "t_s" in row]
    return samples, [Spent(**row) for row in rows if "wall_s" in row]


def memory_picture(samples: list[Sample]) -> str:
    """Memory of the driver and of the largest worker over time, stage by stage, as SVG."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH_IN, 2.6), layout="constrained")
        axes = figure.subplots()
        shown = highest_of_each(samples)
        minutes = [sample.t_s / 60 for sample in shown]
        axes.plot(minutes, [s.driver_mib for s in shown], "C0-", lw=1, label="driver")
        workers = [s.largest_worker_mib for s in shown]
        axes.plot(minutes, workers, "C1--", lw=1, label="largest worker")
        for number, stage in enumerate(dict.fromkeys(sample.stage for sample in samples)):
            start = next(s.t_s for s in samples if s.stage == stage) / 60
            axes.axvline(start, color="0.6", lw=0.8)
            above = 1.0 + 0.08 * (number % 2)  # short stages stand close together
            axes.text(start, above, f" {stage}", transform=axes.get_xaxis_transform(), va="bottom")
        axes.set(xlabel="time [min]", ylabel="resident memory [MiB]", ylim=(0, None))
        axes.legend(loc="upper center")
        return svg_text(figure)


def highest_of_each(samples: list[Sample]) -> list[Sample]:
    """Of neighbouring looks the one at which a process held most, so that few show all peaks."""
    size = -(-len(samples) // POINTS)
    parts = [samples[start : start + size] for start in range(0, len(samples), size)]
    return [max(part, key=lambda s: max(s.driver_mib, s.largest_worker_mib)) for part in parts]


def table(samples: list[Sample], spent: list[Spent]) -> str:
    """What the stages took, as Markdown."""
    lines = [
        "| stage | wall [s] | processor [s] | peak of the driver, of a worker [MiB] |",
        "|-|-|-|-|",
    ]
    for one in spent:
        mine = [sample for sample in samples if sample.stage == one.stage]
        driver, worker = (
            max((getattr(s, name) for s in mine), default=0.0)
            for name in ("driver_mib", "largest_worker_mib")
        )
        lines.append(
            f"| {one.stage} | {one.wall_s:.0f} | {one.processor_s:.0f} "
            f"| {driver:.0f}, {worker:.0f} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    run_command(draw)
