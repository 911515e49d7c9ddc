"""What `make referee` found, as a person and a spreadsheet read it."""

import csv
import io
from collections.abc import Mapping
from typing import Any

import numpy as np


def as_csv(columns: Mapping[str, np.ndarray]) -> str:
    """A column a name, a line a grasp."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*columns.values(), strict=True):
        writer.writerow([f"{cell:.6g}" if isinstance(cell, float) else cell for cell in row])
    return text.getvalue()


def as_markdown(figures: Mapping[str, Any]) -> str:
    """Tables of every score, of q by tenths, and of q under each variation."""
    loads = list(figures["auroc"])
    lines = [
        f"{figures['grasps']} grasps of {figures['objects']} objects, "
        f"{figures['ms_a_grasp']:.0f} ms a grasp.",
        "",
        *_head("score", loads),
    ]
    lines += [_row(name, found, loads) for name, found in figures["scores"].items()]
    lines += ["", "Against the straight pull, no weight's lever:", "", *_head("score", loads)]
    lines += [_row(name, found, loads) for name, found in figures["straight_pull"].items()]
    lines += ["", "| q | grasps | borne [N]: quartiles |", "|-|-|-|"]
    for row in figures["by_tenth"]["q"]:
        quartiles = ", ".join("none" if n is None else f"{n:.2f}" for n in row["quartiles_n"])
        low = row["tenth"] / 10
        lines.append(f"| {low:.1f} to {low + 0.1:.1f} | {row['count']} | {quartiles} |")
    if figures["varied"]:
        lines += ["", "q, where one figure of the referee is another:", "", *_head("figure", loads)]
        lines += [_row(name, found, loads) for name, found in figures["varied"].items()]
    return "\n".join(lines) + "\n"


def _head(first: str, loads: list[str]) -> tuple[str, str]:
    auroc = " | ".join(f"AUROC, bears {load} N" for load in loads)
    return f"| {first} | grasps | Spearman | {auroc} |", "|-" * (3 + len(loads)) + "|"


def _row(name: str, found: Mapping[str, Any], loads: list[str]) -> str:
    interval = found["spearman_interval"]
    around = f" ({interval[0]:.2f} to {interval[1]:.2f})" if interval else ""
    auroc = " | ".join(_figure(found["auroc"][load]) for load in loads)
    return f"| {name} | {found['grasps']} | {_figure(found['spearman'])}{around} | {auroc} |"


def _figure(value: float | None) -> str:
    return "none" if value is None else f"{value:.3f}"
