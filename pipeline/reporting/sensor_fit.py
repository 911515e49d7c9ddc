"""A fitted depth sensor on a page: what was measured, the model through it, what it costs."""

import itertools
from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from pipeline.recording.colours import PALETTE
from pipeline.reporting.page import cell
from pipeline.reporting.plots import DASHES, MARKERS, STYLE, WIDTH_IN, rgb, svg_text
from pipeline.sensing.depth_noise import NoiseModel

ANGLES_DEG = (0, 20, 40, 60, 80)  # bounds of the groups that the figure shows


def spread_figure(bins: Float[np.ndarray, "n 4"], model: NoiseModel) -> str:
    """Spread over distance, dots as measured and lines of the model, a colour a group of angles.

    Parameters
    ----------
    bins
        Depth [m], incidence [rad], sigma [m] and blocks of each bin, shape (n, 4).
    model
        The fitted model.

    Returns
    -------
    SVG.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH_IN, 3.0), layout="constrained")
        axes = figure.subplots()
        angle = np.degrees(bins[:, 1])
        for number, (low, high) in enumerate(itertools.pairwise(ANGLES_DEG)):
            own = bins[(angle >= low) & (angle < high)]
            if len(own) == 0:
                continue
            colour = rgb(PALETTE[(4, 5, 2, 6)[number]])
            axes.scatter(
                own[:, 0],
                1e3 * own[:, 2],
                s=6 + 2 * np.sqrt(own[:, 3]),
                color=colour,
                marker=MARKERS[number],
                label=f"{low} to {high}°",
            )
            z = np.linspace(own[:, 0].min(), own[:, 0].max(), 20)
            cosine = np.full(len(z), float(np.cos(np.median(own[:, 1]))))
            axes.plot(z, 1e3 * model.sigma_m(z, cosine), color=colour, ls=DASHES[number])
        axes.set(xlabel="depth [m]", ylabel="spread off a plane [mm]")
        axes.set_yscale("log")
        axes.legend(title="incidence", ncols=2)
        return svg_text(figure)


def sensor_page(figures: Mapping[str, Any], picture: str) -> str:
    """The page in Markdown.

    Parameters
    ----------
    figures
        Of `stages.sensors`: name, frames, model, blocks, ranges, errors by sensor.
    picture
        Path of the figure as the page names it.

    Returns
    -------
    The text.
    """
    model = figures["model"]
    rows = "\n".join(f"| {cell(name)} | {value:g} |" for name, value in model.items())
    errors = "\n".join(
        f"| {cell(name)} | {one['grasps']} | {one['mae']:.4f} | {100 * one['unseen_share']:.0f} % |"
        for name, one in figures["network_error"].items()
    )
    depth, incidence = figures["depth_m"], figures["incidence_deg"]
    return (
        f"# Noise of {cell(figures['name'])}\n\n"
        f"From {figures['frames']} frames, {figures['blocks']} blocks of pixels on planes at "
        f"{depth[0]:.2f} to {depth[1]:.2f} m and {incidence[0]:.0f} to {incidence[1]:.0f} degrees "
        "off their normals. Nothing is known of the scenes: objects' curvature counts as noise, "
        "errors that are equal over a block (a bent floor, a wrong scale) do not. Outside these "
        "depths and angles the model is a guess. Spread = (floor + linear z + quadratic "
        "(z - 0.4)^2) / cos^steepness, metres.\n\n"
        f"| parameter | value |\n|-|-|\n{rows}\n\n![Spread over depth]({picture})\n\n"
        + (
            "The released network on equal grasps, whose clouds each sensor measured:\n\n"
            "| sensor | grasps | mean \\|q-hat - q\\| | cells without a point |\n|-|-|-|-|\n"
            f"{errors}\n"
            if errors
            else ""
        )
    )
