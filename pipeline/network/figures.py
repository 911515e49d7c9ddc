"""Test figures of predicted qualities: errors overall, by bin and by class, and calibration."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, Num

from pipeline.errors import ArtifactError

BINS = 10  # of q in a histogram: tenths


@dataclass(frozen=True)
class BinnedError:
    """Error over the samples whose true quality lies in [low, high).

    Attributes
    ----------
    low
        Lower end of the bin.
    high
        Upper end of the bin.
    count
        Samples in it.
    mae
        Mean |q̂ − q|; None where the bin is empty.
    """

    low: float
    high: float
    count: int
    mae: float | None


@dataclass(frozen=True)
class CalibrationBin:
    """Predicted against true quality where the prediction lies in [low, high).

    Calibrated predictions have equal means.

    Attributes
    ----------
    low
        Lower end of the bin.
    high
        Upper end of the bin.
    count
        Samples in it.
    mean_predicted
        Mean q̂; None where the bin is empty.
    mean_quality
        Mean q; None where the bin is empty.
    """

    low: float
    high: float
    count: int
    mean_predicted: float | None
    mean_quality: float | None


def mean_absolute_error(
    predicted: Float[np.ndarray, " n"], quality: Float[np.ndarray, " n"]
) -> float:
    """Mean |q̂ − q|, the prediction error of Supplement IV.

    Parameters
    ----------
    predicted
        q̂, shape (n,).
    quality
        q, shape (n,).

    Returns
    -------
    The error.

    Raises
    ------
    ArtifactError
        There are no samples, or their numbers disagree.
    """
    if predicted.shape != quality.shape or predicted.size == 0:
        raise ArtifactError(
            f"no error can be taken over {predicted.size} predictions of {quality.size} samples",
            "Ask for more grasps or objects, so that every split has samples.",
        )
    return float(np.abs(predicted.astype(np.float64) - quality.astype(np.float64)).mean())


def weighted_error(
    predicted: Float[np.ndarray, " n"],
    quality: Float[np.ndarray, " n"],
    weight: Float[np.ndarray, " n"],
) -> float | None:
    """Mean |q̂ − q| weighted by ``weight``; None where weights are unknown (NaN) or all zero."""
    total = float(weight.sum(dtype=np.float64))
    if not total > 0:
        return None
    error = np.abs(predicted.astype(np.float64) - quality.astype(np.float64))
    return float(error @ weight.astype(np.float64)) / total


def error_by_quality_bin(
    predicted: Float[np.ndarray, " n"], quality: Float[np.ndarray, " n"]
) -> tuple[BinnedError, ...]:
    """Mean |q̂ − q| in ten equal bins of the true quality; q = 1 is in the last."""
    bins = _bin_of(quality)
    rows = []
    for index in range(BINS):
        inside = bins == index
        rows.append(
            BinnedError(
                low=index / BINS,
                high=(index + 1) / BINS,
                count=int(inside.sum()),
                mae=_mean_or_none(np.abs(predicted - quality), inside),
            )
        )
    return tuple(rows)


def error_by_group(
    predicted: Float[np.ndarray, " n"],
    quality: Float[np.ndarray, " n"],
    groups: Num[np.ndarray, " n"] | np.ndarray,
) -> dict[str, float]:
    """Mean |q̂ − q| of each group that occurs, keyed by its name, in order."""
    return {
        str(name): mean_absolute_error(predicted[groups == name], quality[groups == name])
        for name in np.unique(groups)
    }


def calibration(
    predicted: Float[np.ndarray, " n"], quality: Float[np.ndarray, " n"]
) -> tuple[CalibrationBin, ...]:
    """Mean q̂ and mean q in ten equal bins of the prediction."""
    bins = _bin_of(predicted)
    rows = []
    for index in range(BINS):
        inside = bins == index
        rows.append(
            CalibrationBin(
                low=index / BINS,
                high=(index + 1) / BINS,
                count=int(inside.sum()),
                mean_predicted=_mean_or_none(predicted, inside),
                mean_quality=_mean_or_none(quality, inside),
            )
        )
    return tuple(rows)


def _bin_of(values: Float[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
    bins: Int[np.ndarray, " n"] = np.clip(np.floor(values * BINS), 0, BINS - 1).astype(np.int64)
    return bins


def _mean_or_none(values: Float[np.ndarray, " n"], inside: np.ndarray) -> float | None:
    return float(values[inside].mean(dtype=np.float64)) if inside.any() else None
