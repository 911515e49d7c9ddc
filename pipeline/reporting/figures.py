"""The figures of a report as SVG, from a run's summaries and artifacts."""

from collections.abc import Mapping
from typing import Any

from pipeline.execution import RunFolder
from pipeline.recording.proposed_contacts import errors_markdown, precision_markdown
from pipeline.reporting import plots
from pipeline.reporting.facts import CatalogueFacts, read_training, read_worst
from schemas.softgrip.v1.evaluation_pb2 import LevelResult


def figures_of(
    folder: RunFolder,
    summaries: Mapping[str, dict[str, Any] | None],
    catalogue: CatalogueFacts,
    success: dict[str, dict[int, LevelResult]],
    referee: dict[str, Any] | None,
) -> dict[str, str]:
    """Name to SVG of every figure that the run has numbers for."""
    nsvr = {item.name: item.nsvr for item in catalogue.objects}
    classes = {item.name: item.shape_class for item in catalogue.objects}
    svg = {"nsvr": plots.nsvr_scale(nsvr, classes)}
    if shards := summaries["shards"]:
        svg["labels"] = plots.label_histogram(shards["quality_histogram"])
    if train := summaries["train"]:
        facts = read_training(folder.artifact("train"))
        svg["curve"] = plots.training_curve(
            facts.train_mae, facts.val_mae, train["kept_epoch"], train["mean_predictor_mae"]
        )
        predicted, true, count = zip(*facts.calibration, strict=True)
        svg["calibration"] = plots.calibration(predicted, true, count)
    if sweep := summaries["sweep"]:
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
        deviation = sweep.get("seeds", {}).get("deviation", 0.0)
        svg["fig-1"] = plots.fig_1(members, sweep["budget"]["mean_predictor_mae"], deviation)
    if success:
        svg["success"] = plots.success_by_level(rates(success))
    if curve := (summaries["evaluate"] or {}).get("imperfection"):
        svg["errors"] = plots.success_by_errors(
            {
                policy: {
                    float(scale): plots.Rate(one["rate"], *one["interval_95"])
                    for scale, one in by_scale.items()
                }
                for policy, by_scale in curve.items()
            }
        )
    if analysis := (summaries["evaluate"] or {}).get("error_analysis"):
        path, ordered = folder.artifact("evaluate"), list(analysis["by_object"])
        if worst := read_worst(path, analysis["split"], ordered):
            svg["worst"] = plots.worst_contacts(worst)
    if referee:
        svg["load"] = plots.load_by_quality(referee["by_tenth"])
    svg["timings"] = plots.wall_times(
        {name: found["wall_time_s"] for name, found in summaries.items() if found}
    )
    return svg


def proposed_tables(evaluate: dict[str, Any] | None) -> dict[str, str]:
    """Average precision and error analysis as Markdown; empty where they were not made."""
    found = evaluate or {}
    ranked, analysis = found.get("average_precision"), found.get("error_analysis")
    return {
        "precision": precision_markdown(ranked) if ranked else "",
        "errors": errors_markdown(analysis) if analysis else "",
    }


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
