"""The results of `make referee` as CSV and as Markdown."""

import csv
import io
from collections.abc import Mapping
from typing import Any

import numpy as np


def as_csv(columns: Mapping[str, np.ndarray]) -> str:
    """Write the columns as CSV, a row for each grasp."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*columns.values(), strict=True):
        writer.writerow([f"{cell:.6g}" if isinstance(cell, float) else cell for cell in row])
    return text.getvalue()


def as_markdown(figures: Mapping[str, Any]) -> str:
    """Tables of every score, of q by tenths, and of all under each variation."""
    loads = list(figures["auroc"])
    lines = [
        f"{figures['grasps']} grasps of {figures['objects']} objects, "
        f"{figures['ms_a_grasp']:.0f} ms a grasp.",
        "",
        *_head("score", loads),
    ]
    lines += [_row(name, found, loads) for name, found in figures["scores"].items()]
    lines += [
        "",
        "Grasps are chosen evenly over q and objects; «as labelled» counts each as often as its "
        "tenth of q occurs, «within objects» is the median over objects.",
    ]
    lines += ["", "Against the straight pull, no weight's lever:", "", *_head("score", loads)]
    lines += [_row(name, found, loads) for name, found in figures["straight_pull"].items()]
    lines += ["", "| q | grasps | borne [N]: quartiles |", "|-|-|-|"]
    for row in figures["by_tenth"]["q"]:
        quartiles = ", ".join("none" if n is None else f"{n:.2f}" for n in row["quartiles_n"])
        low = row["tenth"] / 10
        lines.append(f"| {low:.1f} to {low + 0.1:.1f} | {row['count']} | {quartiles} |")
    lines += ["", *_varied(figures["varied"], loads)]
    return "\n".join(lines) + "\n"


def _varied(varied: Mapping[str, Any], loads: list[str]) -> list[str]:
    """Each score's rank correlation where one figure of the referee is another, and q's AUROC."""
    names = list(varied["as configured"]["scores"])
    heads = [f"Spearman, {name}" for name in names]
    heads += [f"AUROC of q, bears {load} N" for load in loads]
    lines = [
        "Where one figure of the referee is another:",
        "",
        f"| figure | median borne [N] | {' | '.join(heads)} |",
        "|-" * (2 + len(heads)) + "|",
    ]
    for figure, found in varied.items():
        cells = [_figure(found["median_borne_n"])]
        cells += [_figure(found["scores"][name]["spearman"]) for name in names]
        cells += [_figure(found["scores"]["q"]["auroc"][load]) for load in loads]
        lines.append(f"| {figure} | {' | '.join(cells)} |")
    return lines


def _head(first: str, loads: list[str]) -> tuple[str, str]:
    auroc = " | ".join(f"AUROC, bears {load} N" for load in loads)
    spearman = "Spearman | as labelled | within objects"
    return f"| {first} | grasps | {spearman} | {auroc} |", "|-" * (5 + len(loads)) + "|"


def _row(name: str, found: Mapping[str, Any], loads: list[str]) -> str:
    interval = found["spearman_interval"]
    around = f" ({interval[0]:.2f} to {interval[1]:.2f})" if interval else ""
    auroc = " | ".join(_figure(found["auroc"][load]) for load in loads)
    others = [_figure(found[f"spearman_{kind}"]) for kind in ("as_labelled", "within_objects")]
    return (
        f"| {name} | {found['grasps']} | {_figure(found['spearman'])}{around} "
        f"| {' | '.join(others)} | {auroc} |"
    )


def _figure(value: float | None) -> str:
    return "none" if value is None else f"{value:.3f}"
