"""train.rrd: curves, calibration, and the samples the network is most wrong about."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import Float, Integer

from pipeline.artifacts import open_artifact
from pipeline.messages.samples import read_chosen, read_rows
from pipeline.messages.training import figures_of, fine_tuning_of, metrics_of
from pipeline.network.fitted_baselines import MEAN, TITLES
from pipeline.network.samples import Samples
from pipeline.network.training_figures import EpochMetrics, FineTuning, TestFigures
from pipeline.recording import colours
from pipeline.recording.recording import (
    SHEET_SPACING,
    FinishedStage,
    eye_at,
    name_curve,
    recording,
    set_step,
    time_panel,
)
from schemas.softgrip.v1.training_pb2 import Epoch, TrainingResult

TIMELINE = "epoch"
SHEET_COLUMNS = 6  # clouds in a row of the sheet
SHEET_SAMPLES = 24  # as many as can be looked at one by one
SCATTER_POINTS = 5000  # more hide each other in the plot


def draw_train(stage: FinishedStage, figures: Mapping[str, Any]) -> None:
    """Draw the recording: the curve and the figures of the artifact, on the test clouds."""
    shards = stage.upstream("shards")
    with open_artifact(stage.output) as artifact:
        history = [metrics_of(message) for _, message in artifact.messages(Epoch)]
        result = artifact.one(TrainingResult)
    held_out, tuned = figures_of(result, read_rows(shards, "test")), fine_tuning_of(result)
    worst = worst_first(held_out)[: min(stage.config.recording.clouds, SHEET_SAMPLES)]
    with recording(stage, blueprint()) as stream:
        show_training(stream, history, held_out)
        shown = read_chosen(shards, "test", worst)
        numbers = np.arange(len(worst))
        show_sheet(stream, "world/worst", shown, held_out.predicted[worst], numbers)
        if tuned:
            told = rr.TextDocument(tuning_table(tuned), media_type=rr.MediaType.MARKDOWN)
            stream.log("notes/fine_tuning", told, static=True)


def blueprint() -> rrb.Blueprint:
    """Opens on the curves, with calibration and the worst samples beside."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.TimeSeriesView(origin="/curves/error", name="mean |q-hat - q| by epoch"),
                rrb.TimeSeriesView(origin="/curves/rate", name="learning rate"),
                rrb.BarChartView(
                    origin="/curves/by_tenth", name="mean |q-hat - q| by tenth of q, test split"
                ),
                rrb.Tabs(
                    rrb.TextDocumentView(origin="/notes/result", name="Result on held-out objects"),
                    rrb.TextDocumentView(
                        origin="/notes/fine_tuning", name="Gained and forgotten, if train.start"
                    ),
                ),
                row_shares=[3, 1, 2, 3],
            ),
            rrb.Vertical(
                rrb.Spatial2DView(
                    origin="/curves/calibration", name="q-hat (up) against q (right), test split"
                ),
                rrb.Spatial3DView(
                    origin="/world/worst",
                    name="Worst test samples: q / q-hat",
                    eye_controls=eye_at((7.5, -18.0, 12.0), (7.5, -4.5, 0.0)),
                ),
            ),
        ),
        time_panel(TIMELINE),
        collapse_panels=True,
    )


def worst_first(figures: TestFigures) -> Integer[np.ndarray, " n"]:
    """Numbers of the test samples, those of the largest errors first, shape (n,)."""
    return np.argsort(-np.abs(figures.predicted - figures.quality), kind="stable")


def show_training(
    stream: rr.RecordingStream, history: Sequence[EpochMetrics], figures: TestFigures
) -> None:
    """Log the curve and the calibration."""
    for name, colour in (("train", 4), ("val", 0), ("mean_predictor", 7)):
        name_curve(stream, f"curves/error/{name}", name.replace("_", " "), colours.PALETTE[colour])
    name_curve(stream, "curves/rate", "learning rate", colours.PALETTE[6])
    for metrics in history:
        set_step(stream, TIMELINE, metrics.epoch)
        stream.log("curves/error/train", rr.Scalars(metrics.train_mae))
        stream.log("curves/error/val", rr.Scalars(metrics.val_mae))
        stream.log("curves/error/mean_predictor", rr.Scalars(figures.baselines.balanced[MEAN]))
        stream.log("curves/rate", rr.Scalars(metrics.learning_rate))
    show_calibration(stream, figures.quality, figures.predicted, figures.calibration)
    tenths = np.array([0.0 if error is None else error for error in figures.by_tenth])
    stream.log("curves/by_tenth", rr.BarChart(tenths, color=colours.PALETTE[0]), static=True)
    stream.log(
        "notes/result",
        rr.TextDocument(result_table(figures), media_type=rr.MediaType.MARKDOWN),
        static=True,
    )


def result_table(figures: TestFigures) -> str:
    """The errors on held-out objects, as a person reads them (Markdown)."""
    errors = figures.baselines
    rows = [
        ("**GA-CNN**", f"**{figures.mae:.4f}**", len(figures.quality)),
        ("of one prediction a grasp", f"{figures.mae_single:.4f}", len(figures.quality)),
        *(
            (name, f"{errors.balanced[key]:.4f}", len(figures.quality))
            for key, name in TITLES.items()
            if key in errors.balanced
        ),
    ]
    if figures.mae_as_proposed is not None:
        count = figures.first_proposals
        rows += [("GA-CNN over grasps as first proposed", f"{figures.mae_as_proposed:.4f}", count)]
        rows += [
            (f"{name} over the same", f"{errors.as_proposed[key]:.4f}", count)
            for key, name in TITLES.items()
            if key in errors.as_proposed
        ]
    rows += [
        (f"GA-CNN on clouds cut from {pictures}", f"{error:.4f}", count)
        for pictures, (error, count) in figures.by_pictures.items()
    ]
    rows += [
        (f"GA-CNN on {name} objects", f"{error:.4f}", figures.count_by_class[name])
        for name, error in figures.by_class.items()
    ]
    lines = "\n".join(f"| {name} | {error} | {count} |" for name, error, count in rows)
    return f"| | mean &#124;q-hat - q&#124; | grasps |\n|-|-|-|\n{lines}\n"


def tuning_table(tuned: FineTuning) -> str:
    """What a network gained and forgot, as a person reads it (Markdown)."""
    rows = [
        ("this run's test split", tuned.own_before, tuned.own_after),
        (
            f"{tuned.released_grasps} test grasps of the released network",
            tuned.released_before,
            tuned.released_after,
        ),
    ]
    if tuned.learnt_before is not None and tuned.learnt_after is not None:
        name = f"{tuned.learnt_grasps} grasps that the released network was trained on"
        rows.append((name, tuned.learnt_before, tuned.learnt_after))
    lines = "\n".join(f"| {name} | {was:.4f} | {now:.4f} |" for name, was, now in rows)
    return f"| mean &#124;q-hat - q&#124;, one prediction | before | after |\n|-|-|-|\n{lines}\n"


def show_calibration(
    stream: rr.RecordingStream,
    quality: Float[np.ndarray, " n"],
    predicted: Float[np.ndarray, " n"],
    by_tenth: Sequence[tuple[float | None, float | None, int]],
) -> None:
    """Samples as dots, the tenths' means as a line; upwards is y = 1 - q-hat on a picture.

    Parameters
    ----------
    stream
        The recording.
    quality
        q, shape (n,).
    predicted
        q̂, shape (n,).
    by_tenth
        Mean q̂, mean q and count of each tenth of q̂.
    """
    every = max(1, len(quality) // SCATTER_POINTS)
    dots = np.column_stack([quality, 1.0 - predicted])[::every]
    stream.log(
        "curves/calibration/samples",
        rr.Points2D(dots, radii=0.003, colors=colours.PALETTE[1]),
        static=True,
    )
    diagonal = rr.LineStrips2D([[[0, 1], [1, 0]]], radii=0.002, colors=[120, 120, 120])
    stream.log("curves/calibration/perfect", diagonal, static=True)
    tenths = [(q, 1.0 - p) for p, q, _ in by_tenth if p is not None and q is not None]
    stream.log(
        "curves/calibration/tenths",
        rr.LineStrips2D([tenths], radii=0.004, colors=colours.PALETTE[5]),
        static=True,
    )


def show_sheet(
    stream: rr.RecordingStream,
    path: str,
    samples: Samples,
    predicted: Float[np.ndarray, " n"],
    chosen: Integer[np.ndarray, " k"],
    static: bool = True,
) -> None:
    """Clouds side by side, coloured by q, each with its q and q-hat.

    Parameters
    ----------
    stream
        The recording.
    path
        Where in the recording.
    samples
        The n samples.
    predicted
        q̂ of each, shape (n,).
    chosen
        Indices of those that are shown.
    static
        Whether they are shown at every step.
    """
    for number, index in enumerate(chosen):
        shift = SHEET_SPACING * np.array([number % SHEET_COLUMNS, -(number // SHEET_COLUMNS), 0])
        points = samples.cloud[index][samples.cloud_mask[index]].astype(np.float32) + shift
        colour = colours.by_value(samples.quality[index : index + 1])
        shown = rr.Points3D(points, colors=colour, radii=0.04)
        stream.log(f"{path}/{number:03d}", shown, static=static)
        label = f"{samples.quality[index]:.2f} / {predicted[index]:.2f}"
        stream.log(
            f"{path}/{number:03d}/label",
            rr.Points3D(
                [shift + np.array([0, 1.4, 0])],
                labels=[label],
                radii=0.01,
                colors=colours.PALETTE[7],
            ),
            static=static,
        )
