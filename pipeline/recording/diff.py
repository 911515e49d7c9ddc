"""diff.rrd: two runs side by side, A at the left and B at the right."""

from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import Float

from pipeline.recording import colours
from pipeline.recording.recording import set_step, time_panel

TIMELINE = "group"
SIDES = ("a", "b")


def blueprint(names: Sequence[str]) -> rrb.Blueprint:
    """Labels, errors and success of either run, in two columns of one layout.

    Parameters
    ----------
    names
        Names of the two runs.

    Returns
    -------
    How the viewer lays the recording out.
    """
    columns = [
        rrb.Vertical(
            rrb.BarChartView(origin=f"/curves/labels/{side}", name=f"{name}: labels by tenth of q"),
            rrb.BarChartView(origin=f"/curves/error/{side}", name=f"{name}: error by object"),
            rrb.BarChartView(origin=f"/curves/success/{side}", name=f"{name}: success by policy"),
        )
        for side, name in zip(SIDES, names, strict=True)
    ]
    return rrb.Blueprint(
        rrb.Horizontal(
            *columns,
            rrb.Vertical(
                rrb.TextDocumentView(origin="/notes/group", name="Group"),
                rrb.TextDocumentView(origin="/notes/result", name="Comparison"),
                row_shares=[1, 3],
            ),
            column_shares=[1, 1, 1],
        ),
        time_panel(TIMELINE),
        collapse_panels=True,
    )


def show_diff(
    stream: rr.RecordingStream,
    histograms: Mapping[str, tuple[Float[np.ndarray, " tenths"], Float[np.ndarray, " tenths"]]],
    words: Mapping[str, str],
    errors: tuple[Sequence[float], Sequence[float]],
    success: tuple[Sequence[float], Sequence[float]],
    text: str,
) -> None:
    """Log both sides, a step of the timeline for each group of labels.

    Parameters
    ----------
    stream
        The recording.
    histograms
        Group → share of labels by tenth of q, of either side, shape (10,).
    words
        Group → what the comparison says of it, Markdown.
    errors
        Mean |q̂ − q| of the objects that both tested, of either side.
    success
        Success by policy, of either side.
    text
        The whole comparison, Markdown.
    """
    _note(stream, "result", text, static=True)
    for number, side in enumerate(SIDES):
        colour = colours.PALETTE[number]
        for quantity, values in (("error", errors[number]), ("success", success[number])):
            if len(values):
                bars = rr.BarChart(np.asarray(values, dtype=float), color=colour)
                stream.log(f"curves/{quantity}/{side}", bars, static=True)
    for step, (group, both) in enumerate(histograms.items()):
        set_step(stream, TIMELINE, step)
        _note(stream, "group", words[group], static=False)
        for number, side in enumerate(SIDES):
            bars = rr.BarChart(both[number], color=colours.PALETTE[number])
            stream.log(f"curves/labels/{side}", bars)


def _note(stream: rr.RecordingStream, subject: str, text: str, static: bool) -> None:
    document = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
    stream.log(f"notes/{subject}", document, static=static)
