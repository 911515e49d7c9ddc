"""What `make holdout` found, as a person reads it."""

from collections.abc import Mapping
from typing import Any

from pipeline.reporting.page import cell


def as_markdown(figures: Mapping[str, Any]) -> str:
    """The errors, by object too, and the closed loop by level."""
    ends = figures["mae_macro_graspable_interval_95"]
    interval = f" (95 %: {ends[0]:.4f} to {ends[1]:.4f}, bootstrap over them)" if ends else ""
    gripped = f"one prediction, mean over objects that can be gripped{interval}"
    errors = [
        ("eight predictions averaged, all grasps", figures["mae"]),
        ("one prediction a grasp, all grasps", figures["mae_single"]),
        ("the same over grasps as first proposed", figures["mae_as_proposed"]),
        ("one prediction, mean over objects", figures["mae_macro"]),
        (gripped, figures["mae_macro_graspable"]),
        ("the best constant, all grasps", figures["best_constant_mae"]),
        *((f"{name}, some of the grasps", error) for name, error in figures["baselines"].items()),
    ]
    graspable = sum(one["graspable"] for one in figures["by_object"].values())
    lines = [
        f"{cell(figures['network'])} on {figures['grasps']} grasps of {figures['objects']} objects "
        "that nothing was trained on here; labels are balanced over q.",
        "",
        "| | mean \\|q-hat - q\\| |",
        "|-|-|",
        *(f"| {cell(name)} | {_figure(error)} |" for name, error in errors),
        "",
        f"{graspable} of {figures['objects']} objects can be gripped (mean q over 0.1).",
        "",
        "| object | class | grasps | mean q | error, one prediction | eight averaged |",
        "|-|-|-|-|-|-|",
    ]
    lines += [
        f"| {cell(name)} | {one['shape_class']} | {one['grasps']} | {one['mean_q']:.3f} "
        f"| {one['mae']:.4f} | {one['mae_averaged']:.4f} |"
        for name, one in sorted(figures["by_object"].items(), key=lambda item: -item[1]["mae"])
    ]
    lines += ["", "| level | lifted | success (95 % interval) | cleared |", "|-|-|-|-|"]
    for level, found in figures["success_by_level"].items():
        low, high = found["interval_95"]
        lines.append(
            f"| {level} | {found['lifted']} / {found['attempts']} | {100 * found['rate']:.0f} % "
            f"({100 * low:.0f}-{100 * high:.0f}) | {found['cleared']} / {found['clutters']} |"
        )
    for what, why in {**figures["meshes_left_out"], **figures["clutters_left_out"]}.items():
        lines += ["", f"Left out: {cell(what)}: {cell(why)}."]
    return "\n".join(lines) + "\n"


def _figure(value: float | None) -> str:
    return "none" if value is None else f"{value:.4f}"
