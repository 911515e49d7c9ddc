"""What `make folds` found, as a person reads it."""

from collections.abc import Mapping
from typing import Any

from pipeline.network.fitted_baselines import TITLES
from pipeline.reporting.page import cell


def as_markdown(figures: Mapping[str, Any]) -> str:
    """The headline with its intervals, every fold, and every object by falling error."""
    baselines = ", ".join(
        f"{TITLES[name]} {error:.4f}" for name, error in figures["baselines"].items()
    )
    how = f"a network of {figures['layers']} layers that saw no family of its fold"
    if figures["start"]:
        how += f", trained on from run {figures['start']}, which held out every mesh"
    if not figures["trained"]:
        how = (
            f"the network of run {figures['start']}, {figures['layers']} layers, which held out "
            "every mesh"
        )
    lines = [
        f"{figures['objects']} objects of {figures['families']} families in {figures['folds']} "
        f"folds, each tested once by {how}; {figures['grasps']} grasps, one prediction each.",
        "",
        "| mean over objects of \\|q-hat - q\\| | objects | error | 95 % interval |",
        "|-|-|-|-|",
    ]
    for name, found in figures["macro"].items():
        interval = found["interval_95"]
        around = f"{interval[0]:.4f} to {interval[1]:.4f}" if interval else "none"
        error = "none" if found["mae"] is None else f"{found['mae']:.4f}"
        lines.append(f"| {name} | {found['objects']} | {error} | {around} |")
    lines += [
        "",
        f"Over all grasps, not objects: {figures['mae_single']:.4f} with one prediction, "
        f"{figures['mae']:.4f} with eight averaged; of the baselines, fitted to other folds: "
        f"{baselines}.",
        "",
        "| fold | trained on | measured by epoch on | tested on | val error | test error |",
        "|-|-|-|-|-|-|",
    ]
    lines += [
        f"| {fold} | {one['train']} | {one['val']} | {one['test']} "
        f"| {'none' if one['val_mae'] is None else format(one['val_mae'], '.4f')} "
        f"| {one['mae_single']:.4f} |"
        for fold, one in figures["by_fold"].items()
    ]
    lines += ["", "| object | fold | grasps | mean q | error | as proposed |", "|-|-|-|-|-|-|"]
    for name, one in sorted(figures["by_object"].items(), key=lambda item: -item[1]["mae"]):
        proposed = one["mae_as_proposed"]
        lines.append(
            f"| {cell(name)} | {one['fold']} | {one['grasps']} | {one['mean_q']:.3f} "
            f"| {one['mae']:.4f} | {'none' if proposed is None else f'{proposed:.4f}'} |"
        )
    return "\n".join(lines) + "\n"
