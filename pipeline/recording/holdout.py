"""holdout.rrd: a given network on meshes that nothing was trained on, the worst object first.

One step of the timeline an object: its worst clouds with q and q-hat, and its figures.
"""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import Float

from pipeline.network.by_object import ObjectError
from pipeline.network.figures import calibration
from pipeline.network.samples import Samples
from pipeline.recording import colours
from pipeline.recording.recording import eye_at, set_step, start_path, time_panel
from pipeline.recording.train import show_calibration, show_sheet

TIMELINE = "object"


def blueprint() -> rrb.Blueprint:
    """Opens on the object that the network errs most on."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(
                origin="/world/worst",
                name="Worst clouds of the object: q / q-hat, units of r_G",
                eye_controls=eye_at((7.5, -18.0, 12.0), (7.5, -4.5, 0.0)),
            ),
            rrb.Vertical(
                rrb.TextDocumentView(origin="/notes/object", name="Object"),
                rrb.BarChartView(
                    origin="/curves/by_object", name="mean |q-hat - q| by object, worst first"
                ),
                rrb.Spatial2DView(
                    origin="/curves/calibration", name="q-hat (up) against q (right)"
                ),
                rrb.TextDocumentView(origin="/notes/result", name="Result"),
                row_shares=[2, 2, 3, 3],
            ),
            column_shares=[3, 2],
        ),
        time_panel(TIMELINE),
        collapse_panels=True,
    )


def show_holdout(
    stream: rr.RecordingStream,
    errors: Sequence[ObjectError],
    names: Sequence[str],
    samples: Samples,
    predicted: Float[np.ndarray, " n"],
    shown: int,
    text: str,
) -> None:
    """Log every object by falling error.

    Parameters
    ----------
    stream
        The recording.
    errors
        Of each object.
    names
        The names that ``samples.object_index`` points into.
    samples
        All labelled grasps.
    predicted
        q̂ of one prediction a grasp, shape (n,).
    shown
        Clouds of each object.
    text
        The result as a person reads it, Markdown.
    """
    ordered = sorted(errors, key=lambda one: (-one.mae, one.name))
    quality = samples.quality
    by_tenth = [
        (found.mean_predicted, found.mean_quality, found.count)
        for found in calibration(predicted, quality)
    ]
    show_calibration(stream, quality, predicted, by_tenth)
    bars = rr.BarChart(np.array([one.mae for one in ordered]), color=colours.PALETTE[0])
    stream.log("curves/by_object", bars, static=True)
    _note(stream, "result", text, static=True)
    error = np.abs(predicted - quality)
    for number, one in enumerate(ordered):
        set_step(stream, TIMELINE, number)
        own = np.flatnonzero(samples.object_index == names.index(one.name))
        worst = own[np.argsort(-error[own], kind="stable")[:shown]]
        path = start_path(stream, "world/worst", number)
        show_sheet(stream, path, samples, predicted, worst, static=False)
        _note(stream, "object", _facts(one), static=False)


def _note(stream: rr.RecordingStream, subject: str, text: str, static: bool) -> None:
    document = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
    stream.log(f"notes/{subject}", document, static=static)


def _facts(one: ObjectError) -> str:
    held = "can be gripped" if one.graspable else "can hardly be gripped anywhere"
    return (
        f"**{one.name}**: {held}\n\n| | |\n|-|-|\n"
        f"| grasps | {one.grasps} |\n"
        f"| mean q | {one.mean_quality:.3f} |\n"
        f"| mean &#124;q-hat - q&#124;, one prediction | {one.mae:.4f} |\n"
        f"| the same, eight averaged | {one.mae_averaged:.4f} |\n"
    )
