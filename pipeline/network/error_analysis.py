"""Where predictions of q err: by object, by class, by tilt, by distance to an edge, by noise."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Shaped

from pipeline.network.baselines import fit_monotone
from pipeline.network.figures import mean_absolute_error

# Ends of groups: tilts in degrees (a camera sees less the more a surface is turned away), and
# distances to an edge in units of r_G (the pad covers what is nearer than 1).
TILTS_DEG = (0.0, 10.0, 20.0, 30.0, 45.0, 90.0)
EDGES_RG = (0.0, 0.25, 0.5, 0.75, 1.0)


@dataclass(frozen=True, eq=False)
class Predictions:
    """Predicted and true q of n grasps, and what they are grouped by.

    Attributes
    ----------
    quality
        q, shape (n,).
    predicted
        Predictor → q-hat, shape (n,).
    seal_ratio
        Seal ratio, shape (n,); the rising function of it that fits these grasps best is a baseline,
        flattered by that, and so is the constant that fits them best, their median.
    object_name
        Name of the object, empty on none, shape (n,).
    shape_class
        Its class, empty on none, shape (n,).
    tilt_rad
        Angle of the approach off the vertical, shape (n,).
    edge_rg
        Distance to the nearest edge of the measured cloud in units of r_G, shape (n,); inf: none.
    """

    quality: Float[np.ndarray, " n"]
    predicted: Mapping[str, Float[np.ndarray, " n"]]
    seal_ratio: Float[np.ndarray, " n"]
    object_name: Shaped[np.ndarray, " n"]
    shape_class: Shaped[np.ndarray, " n"]
    tilt_rad: Float[np.ndarray, " n"]
    edge_rg: Float[np.ndarray, " n"]


def error_analysis(found: Predictions) -> dict[str, Any]:
    """Mean |q̂ − q| of every predictor and baseline, over all grasps and group by group.

    Parameters
    ----------
    found
        The predictions, of at least one grasp.

    Returns
    -------
    ``all``, ``by_object`` (that with the largest error of the first predictor first), ``by_class``,
    ``by_tilt`` and ``by_edge``: of each group the number of grasps, mean q and the errors.
    """
    ratio = np.asarray(found.seal_ratio, dtype=np.float64)
    predicted = dict(found.predicted) | {
        "seal ratio, fitted to these": fit_monotone(ratio, found.quality).predict(ratio),
        "median of these": np.full(found.quality.shape, np.median(found.quality)),
    }
    first = next(iter(predicted))

    def rows(groups: Mapping[str, Bool[np.ndarray, " n"]]) -> dict[str, dict[str, Any]]:
        return {name: _row(found.quality, predicted, own) for name, own in groups.items()}

    by_object = rows(_equal(found.object_name))
    return {
        "all": _row(found.quality, predicted, np.ones(len(found.quality), dtype=bool)),
        "by_object": dict(
            sorted(by_object.items(), key=lambda row: (-row[1]["errors"][first], row[0]))
        ),
        "by_class": rows(_equal(found.shape_class)),
        "by_tilt": rows(_between(np.rad2deg(found.tilt_rad), TILTS_DEG, "°")),
        "by_edge": rows(_between(found.edge_rg, (*EDGES_RG, np.inf), " r_G")),
    }


def _row(
    quality: Float[np.ndarray, " n"],
    predicted: Mapping[str, Float[np.ndarray, " n"]],
    own: Bool[np.ndarray, " n"],
) -> dict[str, Any]:
    return {
        "grasps": int(own.sum()),
        "mean_q": float(quality[own].mean(dtype=np.float64)),
        "errors": {
            name: mean_absolute_error(each[own], quality[own]) for name, each in predicted.items()
        },
    }


def _equal(names: Shaped[np.ndarray, " n"]) -> dict[str, Bool[np.ndarray, " n"]]:
    """A group for each name; those on no object are in none."""
    return {name: names == name for name in sorted(set(names.tolist())) if name}


def _between(
    values: Float[np.ndarray, " n"], ends: Sequence[float], unit: str
) -> dict[str, Bool[np.ndarray, " n"]]:
    """A group for each interval that holds a value; the last takes its end too."""
    groups = {}
    for number, (low, high) in enumerate(pairwise(ends)):
        last = number == len(ends) - 2
        own = (values >= low) & ((values <= high) if last else (values < high))
        name = f"over {low:g}{unit}" if np.isinf(high) else f"{low:g} to {high:g}{unit}"
        if own.any():
            groups[name] = own
    return groups
