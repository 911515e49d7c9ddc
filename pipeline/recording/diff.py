"""diff.rrd: two runs compared, each bar of A with that of B at its right."""

from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import Float

from pipeline.recording import colours
from pipeline.recording.recording import set_step, time_panel

TIMELINE = "group"
SIDES = ("a", "b")
TITLES = {
    "labels": "Labels by tenth of q",
    "error": "Mean error by object, in the order of the table",
    "success": "Success by policy, in the order of the table",
}
BAR = 0.4  # width; what is compared stands around 0, 1, 2 and so on


def blueprint(names: Sequence[str], shown: Sequence[str]) -> rrb.Blueprint:
    """Labels, errors and success of both runs, their bars side by side on one scale.

    Parameters
    ----------
    names
        Names of the two runs.
    shown
        What there is to show, of `TITLES`.

    Returns
    -------
    How the viewer lays the recording out.
    """
    legend = f"A {names[0]}, B {names[1]}"
    bars = [
        rrb.BarChartView(origin=f"/curves/{quantity}", name=f"{TITLES[quantity]}: {legend}")
        for quantity in shown
    ]
    result = rrb.TextDocumentView(origin="/notes/result", name="Comparison")
    group = rrb.TextDocumentView(origin="/notes/group", name="Group")
    words = rrb.Vertical(group, result, row_shares=[1, 3]) if "labels" in shown else result
    columns = [rrb.Vertical(*bars), words] if bars else [words]
    return rrb.Blueprint(
        rrb.Horizontal(*columns, column_shares=[2, 1][-len(columns) :]),
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
    for quantity, both in (("error", errors), ("success", success)):
        if len(both[0]):
            _show_bars(stream, quantity, both, static=True)
    for step, (group, shares) in enumerate(histograms.items()):
        set_step(stream, TIMELINE, step)
        _note(stream, "group", words[group], static=False)
        _show_bars(stream, "labels", shares, static=False)


def _show_bars(
    stream: rr.RecordingStream,
    quantity: str,
    both: tuple[
        Sequence[float] | Float[np.ndarray, " n"], Sequence[float] | Float[np.ndarray, " n"]
    ],
    static: bool,
) -> None:
    for number, (side, values) in enumerate(zip(SIDES, both, strict=True)):
        heights = np.asarray(values, dtype=float)
        bars = rr.BarChart(
            heights,
            abscissa=np.arange(len(heights)) + (number - 1) * BAR,
            widths=np.full(len(heights), BAR, dtype=np.float32),
            color=colours.PALETTE[number],
        )
        stream.log(f"curves/{quantity}/{side}", bars, static=static)


def _note(stream: rr.RecordingStream, subject: str, text: str, static: bool) -> None:
    document = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
    stream.log(f"notes/{subject}", document, static=static)
