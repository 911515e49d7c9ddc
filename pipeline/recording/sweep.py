"""sweep.rrd: error and time by depth for each channel set, and the effect of each part."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pipeline.artifacts import open_artifact
from pipeline.errors import ArtifactError
from pipeline.messages.sweep import (
    channels_name,
    read_sweep,
    spread_of_seeds,
    told_differences,
)
from pipeline.network.family import VARIANTS
from pipeline.recording import colours
from pipeline.recording.recording import FinishedStage, name_curve, recording, set_step, time_panel
from schemas.softgrip.v1.training_pb2 import SweepBudget, SweepNetwork

TIMELINE = "layers"
_CHOSEN_COLOUR = (60, 200, 90)  # green, as Fig. 1 marks the chosen network


def draw_sweep(stage: FinishedStage, figures: Mapping[str, Any]) -> None:
    """Draw the recording: errors are of the artifact, times of the summary.

    Parameters
    ----------
    stage
        The finished stage.
    figures
        Its summary, which holds the times.

    Raises
    ------
    ArtifactError
        The summary, which holds the times, is lost.
    """
    networks = read_sweep(stage.output)
    times_ms = [row["ms_a_grasp"] for row in figures.get("networks", [])]
    if len(times_ms) != len(networks):
        raise ArtifactError(
            f"The summary beside {stage.output} is lost, and the recording shows its times",
            "Run the stage again with --force",
        )
    with open_artifact(stage.output) as artifact:
        budget = artifact.one(SweepBudget)
    with recording(stage, blueprint()) as stream:
        show_sweep(stream, networks, times_ms, budget)


def blueprint() -> rrb.Blueprint:
    """Fig. 1 as two plots over depth, the tables beside."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.TimeSeriesView(
                    origin="/curves/error", name="mean |q-hat - q| on test objects, by layers"
                ),
                rrb.TimeSeriesView(
                    origin="/curves/time", name="ms a grasp (batch 64, CPU), by layers"
                ),
            ),
            rrb.TextDocumentView(origin="/notes/sweep", name="Networks on one budget"),
            column_shares=[3, 2],
        ),
        time_panel(TIMELINE),
        collapse_panels=True,
    )


def show_sweep(
    stream: rr.RecordingStream,
    networks: Sequence[SweepNetwork],
    times_ms: Sequence[float],
    budget: SweepBudget,
) -> None:
    """Log a curve a channel set, the chosen network as a dot, and the tables."""
    family = [
        (network, time_ms)
        for network, time_ms in zip(networks, times_ms, strict=True)
        if network.group == "family"
    ]
    for number, channels in enumerate(dict.fromkeys(channels_name(n) for n, _ in family)):
        colour = colours.PALETTE[number % len(colours.PALETTE)]
        for curve in ("error", "time"):
            name_curve(stream, f"curves/{curve}/{channels}", channels, colour)
    dot = rr.SeriesPoints(names="chosen", colors=_CHOSEN_COLOUR, markers="circle", marker_sizes=6)
    for curve in ("error", "time"):
        stream.log(f"curves/{curve}/chosen", dot, static=True)
    for network, time_ms in family:
        set_step(stream, TIMELINE, network.layers)
        for curve, value in (("error", network.test_mae), ("time", time_ms)):
            stream.log(f"curves/{curve}/{channels_name(network)}", rr.Scalars(value))
            if network.chosen:
                stream.log(f"curves/{curve}/chosen", rr.Scalars(value))
    parts = (
        describe_budget(budget),
        describe_seeds(networks),
        family_table(family),
        ablation_table(networks),
    )
    text = "\n\n".join(filter(None, parts)) + "\n"
    document = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
    stream.log("notes/sweep", document, static=True)


def describe_budget(budget: SweepBudget) -> str:
    """One sentence on the samples and epochs that every network was given."""
    return (
        f"{budget.train_samples} training samples, {budget.epochs} epochs, batches of "
        f"{budget.batch_size}; {budget.test_samples} test samples, of which the mean predictor "
        f"errs by {budget.mean_predictor_mae:.4f}."
    )


def describe_seeds(networks: Sequence[SweepNetwork]) -> str:
    """What chance alone changes, and what differs by more; nothing where all were trained once."""
    spread = spread_of_seeds(networks)
    if spread is None:
        return ""
    told = told_differences(networks, spread)
    return (
        f"Another seed changes an error by {spread.deviation:.4f} (standard deviation, "
        f"{spread.degrees} degrees of freedom). Two networks trained once differ by more than "
        f"chance (95 %) where their errors differ by more than {spread.least_difference:.4f}: "
        f"{told['pairs_that_differ']} of {told['pairs']} pairs do. Of the family, "
        f"{len(told['better_than_chosen'])} are better than the chosen one by more than that, "
        f"{len(told['worse_than_chosen'])} worse."
    )


def family_table(family: Sequence[tuple[SweepNetwork, float]]) -> str:
    """Markdown table with a row for each network; the chosen one is bold."""
    rows = []
    for network, time_ms in family:
        bold = "**" if network.chosen else ""
        error = f"{bold}{network.test_mae:.4f}{bold}"
        size = f"{network.parameters / 1e6:.2f}"
        rows.append(
            f"| {channels_name(network)} | {network.layers} | {error} | {time_ms:.3f} | {size} |"
        )
    return "\n".join(["| channels | layers | error | ms | M parameters |", "|-|-|-|-|-|", *rows])


def ablation_table(networks: Sequence[SweepNetwork]) -> str:
    """Mean error over the seeds, of one prediction and of the mean over symmetries."""
    rows = []
    for variant in VARIANTS:
        mine = [n for n in networks if n.group == "ablation" and n.variant == variant]
        if mine:
            single = np.mean([n.test_mae_single for n in mine])
            averaged = np.mean([n.test_mae_averaged for n in mine])
            rows.append(f"| {variant} | {len(mine)} | {single:.4f} | {averaged:.4f} |")
    head = ["| run's network | seeds | one prediction | mean over symmetries |", "|-|-|-|-|"]
    return "\n".join([*head, *rows]) if rows else ""
