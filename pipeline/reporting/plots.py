"""Figures of the report: vector, with units, told apart in print and by colour-blind eyes.

The same numbers give the same bytes. Curves differ in colour (Okabe and Ito, 2008), marker and
dash, so that a page printed in grey still reads.
"""

import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pipeline.geometry.shape import COMPLEX_FROM, TYPICAL_FROM
from pipeline.messages.proposed_contacts import WorstContact
from pipeline.recording.colours import PALETTE, SHAPE_CLASS, SPLIT
from pipeline.recording.proposed_contacts import WORST_EACH, WORST_OBJECTS

MARKERS = "osD^vPX*"
DASHES = ("-", "--", "-.", ":")
STYLE = {
    "svg.hashsalt": "softgrip",
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "0.9",
    "legend.frameon": False,
}
WIDTH_IN = 6.4  # of a column of text on the page


@dataclass(frozen=True)
class TrainedMember:
    """A network of Fig. 1. channels : its four stages. error : mean |q-hat - q|."""

    channels: tuple[int, ...]
    layers: int
    error: float
    ms_a_grasp: float
    chosen: bool


@dataclass(frozen=True)
class Rate:
    """A success rate with its interval, both in [0, 1]."""

    rate: float
    low: float
    high: float


def nsvr_scale(nsvr: Mapping[str, float], shape_class: Mapping[str, str]) -> str:
    """Every object's NSVR, Eq. (15), in order, with the two thresholds."""
    ordered = sorted(nsvr, key=lambda name: (nsvr[name], name))
    place = {name: index + 1 for index, name in enumerate(ordered)}
    with mpl.rc_context(STYLE):
        figure, (axes,) = _axes(1, 2.4)
        for (kind, colour), marker in zip(SHAPE_CLASS.items(), MARKERS, strict=False):
            own = [name for name in ordered if shape_class[name] == kind]
            x, y = [place[name] for name in own], [nsvr[name] for name in own]
            axes.plot(x, y, marker, color=rgb(colour), label=f"{kind} ({len(own)})", ms=5)
        for threshold in (TYPICAL_FROM, COMPLEX_FROM):
            axes.axhline(threshold, color="0.3", lw=0.8, ls="--")
            axes.annotate(f"{threshold}", (0.2, threshold), va="bottom", color="0.3")
        axes.set(xlabel="objects by growing NSVR", ylabel="NSVR [1]")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.legend()
        return svg_text(figure)


def label_histogram(by_split: Mapping[str, Sequence[int]]) -> str:
    """Labels by tenth of q, a bar a split."""
    hatches = ("", "///", "xxx")
    styles = [
        {"color": rgb(SPLIT[split]), "hatch": hatches[number % len(hatches)]}
        for number, split in enumerate(by_split)
    ]
    return _bars_by_tenth(by_split, by_split.values(), styles, "grasps")


def compared_histograms(by_run: Mapping[str, Sequence[int]]) -> str:
    """Labels of several runs by tenth of q, as shares, a bar a run."""
    shares = [np.array(counts) / max(sum(counts), 1) for counts in by_run.values()]
    styles = [{"color": rgb(PALETTE[number % len(PALETTE)])} for number in range(len(by_run))]
    return _bars_by_tenth(by_run, shares, styles, "share of grasps")


def _bars_by_tenth(
    counts: Mapping[str, Sequence[int]],
    heights: Iterable[Sequence[float] | np.ndarray],
    styles: Sequence[dict[str, Any]],
    ylabel: str,
) -> str:
    """Bars side by side over the tenths of q, each group named with its number of grasps."""
    with mpl.rc_context(STYLE):
        figure, (axes,) = _axes(1, 2.4)
        width = 0.8 / len(counts)
        drawn = zip(counts.items(), heights, styles, strict=True)
        for number, ((name, own), height, style) in enumerate(drawn):
            x = np.arange(len(own)) + 0.1 + width * (number + 0.5)
            axes.bar(x, height, width, label=f"{name} ({sum(own)})", ec="white", **style)
        axes.set_xticks(range(11), [f"{tenth / 10:.1f}" for tenth in range(11)])
        axes.set(xlabel="grasp quality q [1]", ylabel=ylabel)
        axes.legend()
        return svg_text(figure)


def training_curve(
    train: Sequence[float], val: Sequence[float], kept_epoch: int, mean_predictor: float
) -> str:
    """Error by epoch; epochs are counted from 1 in the figure, ``kept_epoch`` from 0."""
    with mpl.rc_context(STYLE):
        figure, (axes,) = _axes(1, 2.6)
        epochs = np.arange(len(train)) + 1
        axes.plot(epochs, train, "o-", color=rgb(PALETTE[4]), label="train", ms=3)
        axes.plot(epochs, val, "s--", color=rgb(PALETTE[5]), label="val", ms=3)
        axes.axhline(mean_predictor, color="0.4", ls=":", label="mean predictor, on test")
        axes.axvline(kept_epoch + 1, color="0.6", lw=0.8, label=f"kept epoch: {kept_epoch + 1}")
        axes.set(xlabel="epoch", ylabel="mean |q̂ − q| [1]")
        axes.set_ylim(bottom=0)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.legend(ncols=2)
        return svg_text(figure)


def calibration(predicted: Sequence[float], true: Sequence[float], count: Sequence[int]) -> str:
    """Mean q over mean q-hat by tenth of q-hat; dots grow with the number of grasps."""
    with mpl.rc_context(STYLE):
        figure, (axes,) = _axes(1, 3.0, width=3.4)
        axes.plot([0, 1], [0, 1], color="0.6", lw=0.8, ls="--", label="perfect")
        size = 10 + 90 * np.asarray(count) / max(*count, 1)
        axes.plot(predicted, true, color=rgb(PALETTE[4]), lw=1)
        axes.scatter(predicted, true, s=size, color=rgb(PALETTE[4]), zorder=3, label="test")
        axes.set(xlabel="mean predicted q̂ [1]", ylabel="mean true q [1]", xlim=(0, 1), ylim=(0, 1))
        axes.set_aspect("equal")
        axes.legend(loc="upper left")
        return svg_text(figure)


def lifted_by_quality(by_ranking: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    """Share of tried contacts that lifted, with its interval, over mean q-hat, a curve a ranking.

    Parameters
    ----------
    by_ranking
        Name of a source of q-hat → bins with ``mean_predicted``, ``share``, ``interval_95`` and
        ``contacts``, which stands beside each point.

    Returns
    -------
    SVG.
    """
    with mpl.rc_context(STYLE):
        figure, (axes,) = _axes(1, 3.2, width=4.4)
        axes.plot([0, 1], [0, 1], color="0.6", lw=0.8, ls="--", label="q̂")
        for number, (name, bins) in enumerate(by_ranking.items()):
            x = [one["mean_predicted"] for one in bins]
            share = np.array([one["share"] for one in bins])
            low, high = np.array([one["interval_95"] for one in bins]).T
            axes.errorbar(
                x,
                share,
                yerr=np.clip([share - low, high - share], 0, None),
                color=rgb(PALETTE[4 + number]),
                marker=MARKERS[number],
                ls=DASHES[number],
                capsize=2,
                label=name,
            )
            for at, height, one in zip(x, share, bins, strict=True):
                axes.annotate(
                    str(one["contacts"]), (at, height), (4, 4), textcoords="offset points"
                )
        axes.set(xlabel="mean predicted q̂ [1]", ylabel="share lifted [1]", xlim=(0, 1))
        axes.set_ylim(-0.02, 1.08)
        axes.legend(loc="upper left")
        return svg_text(figure)


def fig_1(members: Sequence[TrainedMember], mean_predictor: float, deviation: float) -> str:
    """Supplement IV, Fig. 1: error and time against depth, a curve a channel set.

    Parameters
    ----------
    members
        The family.
    mean_predictor
        Error of the mean on the same test samples, told in the legend [1].
    deviation
        Standard deviation of an error from seed to seed, drawn as a bar on each; 0: none [1].

    Returns
    -------
    The picture as SVG.
    """
    with mpl.rc_context(STYLE):
        figure, (errors, times) = _axes(2, 3.0)
        for number, channels in enumerate(sorted({member.channels for member in members})):
            own = sorted((m for m in members if m.channels == channels), key=lambda m: m.layers)
            line: dict[str, Any] = {
                "marker": MARKERS[number % len(MARKERS)],
                "ls": DASHES[number % len(DASHES)],
                "color": rgb(PALETTE[(4, 5, 2, 6, 0, 1)[number % 6]]),
                "label": "-".join(map(str, channels)),
                "ms": 4,
            }
            layers = [member.layers for member in own]
            error = [member.error for member in own]
            errors.errorbar(layers, error, yerr=deviation or None, capsize=2, **line)
            times.plot(layers, [member.ms_a_grasp for member in own], **line)
        for member in members:
            if member.chosen:
                ring: dict[str, Any] = {
                    "marker": "o",
                    "ms": 12,
                    "mfc": "none",
                    "mec": "0.2",
                    "ls": "",
                }
                errors.plot([member.layers], [member.error], label="chosen", **ring)
                times.plot([member.layers], [member.ms_a_grasp], **ring)
        # Named and not drawn: it lies so far above that it would flatten what is compared.
        errors.plot([], [], " ", label=f"mean predictor: {mean_predictor:.3f}")
        depths = sorted({member.layers for member in members})
        depths = depths[:: 1 + len(depths) // 8]  # as many as are legible
        errors.set(xlabel="layers", ylabel="mean |q̂ − q| on test [1]", xticks=depths)
        times.set(xlabel="layers", ylabel="time a grasp [ms]", xticks=depths)
        times.set_ylim(bottom=0)
        figure.legend(*errors.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        return svg_text(figure)


def success_by_level(rates: Mapping[str, Mapping[int, Rate]]) -> str:
    """Success of each policy at each level, with its 95 % interval."""
    with mpl.rc_context(STYLE):
        figure, (axes,) = _axes(1, 2.8)
        for number, (policy, by_level) in enumerate(rates.items()):
            shift = 0.12 * (number - (len(rates) - 1) / 2)
            x = [level + shift for level in by_level]
            y = np.array([rate.rate for rate in by_level.values()])
            low = np.array([rate.low for rate in by_level.values()])
            high = np.array([rate.high for rate in by_level.values()])
            axes.errorbar(
                x,
                100 * y,
                yerr=100 * np.maximum([y - low, high - y], 0),
                fmt=MARKERS[number % len(MARKERS)],
                color=rgb(PALETTE[(4, 5, 2, 6, 0, 1)[number % 6]]),
                capsize=2,
                ms=5,
                label=policy or "closed loop",
            )
        levels = sorted({level for by_level in rates.values() for level in by_level})
        axes.set_xticks(levels)
        axes.set_xlim(levels[0] - 0.6, levels[-1] + 0.6)
        axes.set(xlabel="clutter level of Table II", ylabel="lifted [% of attempts]")
        axes.set_ylim(0, 103)
        axes.legend(ncols=3, loc="lower left")
        return svg_text(figure)


def success_by_errors(rates: Mapping[str, Mapping[float, Rate]]) -> str:
    """Success of each policy over the factor on the robot's errors, with its 95 % interval."""
    with mpl.rc_context(STYLE):
        figure, (axes,) = _axes(1, 2.6, width=4.2)
        for number, (policy, by_scale) in enumerate(rates.items()):
            y = np.array([rate.rate for rate in by_scale.values()])
            low = np.array([rate.low for rate in by_scale.values()])
            high = np.array([rate.high for rate in by_scale.values()])
            axes.errorbar(
                list(by_scale),
                100 * y,
                yerr=100 * np.maximum([y - low, high - y], 0),
                marker=MARKERS[number % len(MARKERS)],
                color=rgb(PALETTE[(4, 5, 2, 6, 0, 1)[number % 6]]),
                capsize=2,
                ms=5,
                label=policy,
            )
        scales = sorted({scale for by_scale in rates.values() for scale in by_scale})
        axes.set_xticks(scales)
        axes.set(xlabel="errors of the robot, times as published [1]")
        axes.set(ylabel="lifted [% of attempts]", ylim=(0, 103))
        axes.legend(loc="lower left")
        return svg_text(figure)


def load_by_quality(by_tenth: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    """What grasps of each tenth of a score bear: median, and quartiles as bars, a panel a score."""
    with mpl.rc_context(STYLE):
        figure, panels = _axes(len(by_tenth), 2.6)
        for axes, (name, rows), colour in zip(panels, by_tenth.items(), PALETTE[4:], strict=False):
            there = [row for row in rows if row["count"]]
            low, middle, high = np.array([row["quartiles_n"] for row in there]).T
            axes.errorbar(
                [(row["tenth"] + 0.5) / 10 for row in there],
                middle,
                yerr=[middle - low, high - middle],
                fmt="o-",
                ms=4,
                capsize=2,
                color=rgb(colour),
            )
            axes.set(xlabel=f"{name} [1]", xlim=(0, 1))
            axes.set_ylim(bottom=0)
        panels[0].set_ylabel("weight borne [N], quartiles")
        return svg_text(figure)


def worst_contacts(by_object: Mapping[str, Sequence[WorstContact]]) -> str:
    """Heights under the pad of the worst contacts, an object a row, without noise beside each."""
    rows = list(by_object.items())[:WORST_OBJECTS]
    with mpl.rc_context(STYLE | {"axes.grid": False, "font.size": 7}):
        figure = Figure(figsize=(WIDTH_IN, 1.3 * len(rows)), layout="constrained")
        grid = figure.subplots(len(rows), 2 * WORST_EACH, squeeze=False)
        for axes in grid.flat:
            axes.set_axis_off()
        for line, (name, contacts) in zip(grid, rows, strict=True):
            for number, one in enumerate(contacts[:WORST_EACH]):
                _heights(line[2 * number], one.cloud)
                _heights(line[2 * number + 1], one.cloud_without_noise)
                title = f"q {one.quality:.2f}, q-hat {one.predicted:.2f}"
                line[2 * number].set_title(f"{name}\n{title}" if number == 0 else f"\n{title}")
                line[2 * number + 1].set_title(f"\nq-hat {one.predicted_without_noise:.2f}")
        return svg_text(figure)


def _heights(axes: Axes, cloud: Float[np.ndarray, "g g 3"]) -> None:
    axes.imshow(cloud[..., 2], cmap="viridis", vmin=-1.0, vmax=1.0, interpolation="nearest")


def wall_times(seconds: Mapping[str, float]) -> str:
    """Wall time of each stage."""
    with mpl.rc_context(STYLE):
        figure, (axes,) = _axes(1, 0.6 + 0.28 * len(seconds))
        names = list(seconds)[::-1]
        bars = axes.barh(names, [seconds[name] for name in names], color=rgb(PALETTE[1]))
        axes.bar_label(bars, [f"{seconds[name]:.1f} s" for name in names], padding=3)
        axes.set(xlabel="wall time [s]")
        axes.margins(x=0.15)
        axes.grid(visible=False, axis="y")
        return svg_text(figure)


def _axes(columns: int, height_in: float, width: float = WIDTH_IN) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width, height_in), layout="constrained")
    return figure, list(figure.subplots(1, columns, squeeze=False)[0])


def rgb(colour: np.ndarray) -> tuple[float, ...]:
    """A colour of bytes as Matplotlib takes it, in [0, 1]."""
    return tuple(float(part) / 255 for part in colour)


def svg_text(figure: Figure) -> str:
    """The figure as SVG, the same bytes for the same figure."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return text.getvalue()
